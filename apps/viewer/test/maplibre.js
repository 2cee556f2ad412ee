// MapLibre GL, which nobody here wrote, draws the terrarium tiles: node test/maplibre.js BTMS CHROMIUM PICTURES
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [btms, browserProgram, pictures] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), 'btms-maplibre-'));
mkdirSync(pictures, { recursive: true });
const run = (...words) => execFileSync(btms, words, { encoding: 'utf8' });

const page = (bounds) => `<!doctype html><meta charset="utf-8"><link rel="stylesheet" href="/maplibre-gl.css">
<style>html, body, #map { height: 100%; margin: 0 }</style><div id="map"></div><script src="/maplibre-gl.js"></script><script>
const map = new maplibregl.Map({ container: 'map', bounds: ${JSON.stringify(bounds)}, pitch: 0, preserveDrawingBuffer: true, style: { version: 8,
  sources: { heights: { type: 'raster-dem', url: '/xyz/city.json' } },
  layers: [{ id: 'paper', type: 'background', paint: { 'background-color': '#ffffff' } },
           { id: 'shade', type: 'hillshade', source: 'heights', paint: { 'hillshade-exaggeration': 1, 'hillshade-shadow-color': '#203040' } }] } });
map.on('idle', () => {
  document.body.dataset.idle = 'yes';
  window.tiles = map.querySourceFeatures ? map.isSourceLoaded('heights') : false;
});
map.on('error', (e) => (document.body.dataset.wrong = String(e.error)));
</script>`;

async function main() {
  run('synth', '--points', '2000000', '-o', join(folder, 'truth'), '--quiet');
  run('build', join(folder, 'truth'), '-o', join(folder, 'city.btms'), '--crs', 'EPSG:32632', '--quiet');
  const tiles = spawn(btms, ['serve', join(folder, 'city.btms'), '--port', '0'], { stdio: ['ignore', 'pipe', 'inherit'] });
  const origin = await new Promise((resolve) => tiles.stdout.on('data', (text) => resolve(String(text).trim().replace(/\/$/, ''))));
  const about = await (await fetch(`${origin}/xyz/city.json`)).json();
  const [w, s, e, n] = about.bounds;
  // One origin for the page, the library and the tiles.
  const dist = 'node_modules/maplibre-gl/dist';
  const site = createServer(async (request, response) => {
    if (request.url === '/') return response.setHeader('Content-Type', 'text/html').end(page([[w, s], [e, n]]));
    if (/^\/maplibre-gl\.(js|css)$/.test(request.url)) {
      return response.setHeader('Content-Type', request.url.endsWith('js') ? 'text/javascript' : 'text/css').end(readFileSync(dist + request.url));
    }
    const answer = await fetch(origin + request.url, { headers: { host: request.headers.host } });
    response.statusCode = answer.status;
    response.setHeader('Content-Type', answer.headers.get('content-type') ?? 'text/plain');
    const bytes = Buffer.from(await answer.arrayBuffer());
    response.end(request.url.endsWith('.json') ? String(bytes).replaceAll(/http:\/\/[^/"]+/g, `http://${request.headers.host}`) : bytes);
  }).listen(0, '127.0.0.1');
  const browser = await chromium.launch({ executablePath: browserProgram, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });
  try {
    const tab = await browser.newPage({ viewport: { width: 800, height: 800 } });
    let fetched = 0;
    tab.on('response', (r) => /\/xyz\/.*\.png$/.test(r.url()) && r.status() === 200 && ++fetched);
    await tab.goto(`http://127.0.0.1:${site.address().port}/`);
    await tab.waitForSelector('body[data-idle=yes]', { timeout: 30000 });
    await tab.waitForTimeout(500);
    await tab.screenshot({ path: join(pictures, 'maplibre.png') });
    const shades = await tab.evaluate(() => {
      const copy = new OffscreenCanvas(200, 200).getContext('2d');
      copy.drawImage(document.querySelector('canvas'), 0, 0, 200, 200);
      return new Set(copy.getImageData(0, 0, 200, 200).data.filter((_, i) => i % 4 === 1)).size;
    });
    assert.ok(fetched >= 4, `${fetched} tiles were fetched`);
    assert.ok(shades > 40, `hillshade of ${shades} shades`);
    console.log(`MapLibre drew ${fetched} tiles in ${shades} shades`);
  } finally {
    await browser.close();
    site.close();
    tiles.kill();
  }
}

main()
  .finally(() => rmSync(folder, { recursive: true, force: true }))
  .catch((error) => {
    console.error(error);
    process.exitCode = 1;
  });
