// The page in a real browser, served by the real server: node test/browser.js BTMS VIEWER CHROMIUM PICTURES
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [btms, viewer, browserProgram, pictures] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), 'btms-viewer-'));
mkdirSync(pictures, { recursive: true });
const run = (...words) => execFileSync(btms, words, { encoding: 'utf8' });
const map = join(folder, 'city.btms');

function serve() {
  const server = spawn(btms, ['serve', map, '--port', '0', '--viewer', viewer], { stdio: ['ignore', 'pipe', 'inherit'] });
  const url = new Promise((resolve, reject) => {
    server.stdout.on('data', (text) => resolve(String(text).trim().split(/\s+/).at(-1)));
    server.on('exit', () => reject(new Error('the server ended')));
  });
  return { server, url };
}

async function main() {
  run('synth', '--points', '2000000', '-o', join(folder, 'truth'), '--quiet');
  run('build', join(folder, 'truth'), '-o', map, '--updatable', '--quiet');
  const { server, url } = serve();
  const origin = await url;
  const browser = await chromium.launch({
    executablePath: browserProgram,
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  });
  try {
    const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
    const wrong = [];
    page.on('console', (m) => ['error', 'warning'].includes(m.type()) && !/GPU stall|swiftshader/i.test(m.text()) && wrong.push(m.text()));
    page.on('pageerror', (e) => wrong.push(String(e)));
    page.on('request', (r) => !r.url().startsWith(origin) && !/^(data|blob):/.test(r.url()) && wrong.push(`asks elsewhere: ${r.url()}`));
    const idle = () => page.waitForSelector('body[data-idle=true]', { timeout: 30000 });
    const shot = async (name) => page.screenshot({ path: join(pictures, `${name}.png`) });
    // How many different colours the view shows, on a grid of pixels.
    const colours = () =>
      page.evaluate(async () => {
        const view = document.getElementById('view');
        const copy = new OffscreenCanvas(128, 80).getContext('2d');
        copy.drawImage(view, 0, 0, 128, 80);
        const { data } = copy.getImageData(0, 0, 128, 80);
        const seen = new Set();
        let sum = 0;
        for (let i = 0; i < data.length; i += 4) {
          seen.add((data[i] >> 3) * 1024 + (data[i + 1] >> 3) * 32 + (data[i + 2] >> 3));
          sum += data[i] + 3 * data[i + 1] + 7 * data[i + 2];
        }
        return { count: seen.size, sum };
      });

    await page.goto(origin);
    await idle();
    await shot('height');
    const height = await colours();
    assert.ok(height.count > 100, `the view shows terrain: ${height.count} colours`);

    // Every layer looks different, and says what its colours mean.
    const sums = new Map([['height', height.sum]]);
    const legends = new Set([await page.innerText('#legend')]);
    for (const id of ['state', 'cost', 'slope', 'uncertainty']) {
      await page.check(`input[value=${id}]`);
      await page.waitForTimeout(150);
      await idle();
      await page.waitForTimeout(150);
      await shot(id);
      const { sum } = await colours();
      for (const [other, was] of sums) assert.notEqual(sum, was, `${id} looks like ${other}`);
      sums.set(id, sum);
      const legend = await page.innerText('#legend');
      assert.ok(legend.length > 10 && !legends.has(legend), legend);
      legends.add(legend);
    }

    // A click says what `btms query` says.
    await page.check('input[value=height]');
    await idle();
    await page.mouse.click(760, 430);
    await page.waitForSelector('#answer dl dd');
    const said = await page.innerText('#answer');
    const [, x, y] = said.match(/(-?\d+\.\d), (-?\d+\.\d)/);
    const asked = JSON.parse(run('query', map, `--at=${x},${y}`, '--json'));
    assert.ok(Math.abs(Number(said.match(/(-?\d+\.\d+) m/)[1]) - asked.z) < 0.1, `${said} against ${asked.z}`);
    assert.match(said, new RegExp(asked.state));
    await shot('answer');

    // The same without a mouse.
    await page.keyboard.press('Escape');
    await page.focus('#view');
    for (const key of ['+', 'ArrowUp', '-', 'Enter']) await page.keyboard.press(key);
    await page.waitForSelector('#answer dl dd');
    assert.match(await page.innerText('#answer'), /Place/);
    await page.click('#home');

    // A route, its profile and its check. The places are where streets are in the picture.
    await page.check('input[value=cost]');
    await idle();
    await page.click('#tool-route');
    await page.mouse.click(800, 560);
    await page.waitForSelector('.mark.from', { state: 'attached' });
    await page.mouse.click(775, 245);
    await page.waitForSelector('.chart .line', { state: 'attached', timeout: 10000 });
    assert.match(await page.innerText('#answer'), /Length[\s\S]*can drive it/);
    await page.waitForTimeout(300);
    await shot('route');
    await page.keyboard.press('Escape');
    assert.ok(await page.isHidden('#answer'));

    // A new revision shows by itself.
    assert.equal(await page.getAttribute('body', 'data-revision'), '1');
    execFileSync('sh', ['-c', `"$0" synth --points 20000 --seed 5 -o "$1" --quiet && "$0" build "$1" -o "$2" --update --quiet`, btms, join(folder, 'more'), map]);
    const before = (await colours()).sum;
    await page.waitForSelector('body[data-revision="2"]', { timeout: 15000 });
    await idle();
    await page.waitForSelector('#message', { state: 'hidden', timeout: 15000 });
    assert.notEqual((await colours()).sum, before, 'the picture is that of the new revision');
    assert.ok(Number(await page.getAttribute('body', 'data-changed')) > 0);
    await shot('update');

    // A telephone.
    await page.setViewportSize({ width: 390, height: 800 });
    await page.click('#home');
    await idle();
    await page.waitForTimeout(300);
    await shot('narrow');
    const panel = await page.locator('#panel').boundingBox();
    assert.ok(panel.x >= 0 && panel.x + panel.width <= 390 && panel.height < 400);

    assert.deepEqual(wrong, []);
  } catch (error) {
    await browser.contexts()[0]?.pages()[0]?.screenshot({ path: join(pictures, 'failure.png') });
    throw error;
  } finally {
    await browser.close();
    server.kill();
  }
}

main()
  .then(() => console.log(`the viewer works; pictures are in ${pictures}`))
  .finally(() => rmSync(folder, { recursive: true, force: true }))
  .catch((error) => {
    console.error(error);
    process.exitCode = 1;
  });
