import assert from 'node:assert/strict';
import test from 'node:test';
import { children, choose, distanceTo, parseId, tileId } from '../src/tiles.js';

const levels = [0, 1, 2].map((level) => ({ level, cell_m: 2 * 2 ** level, tile_cells: 128 }));
const all = new Set(['2/0/0', ...children('2/0/0'), ...children('2/0/0').flatMap(children)]);
const chosen = (eye, ready) => choose({ levels, roots: ['2/0/0'], exists: (id) => all.has(id), ready: (id) => ready.has(id), eye });

const covers = (id, x, y) => {
  const [level, tx, ty] = parseId(id);
  const edge = 256 * 2 ** level;
  return tx === Math.floor(x / edge) && ty === Math.floor(y / edge);
};

test('children cover their parent', () => {
  assert.deepEqual(children('1/-1/2').sort(), ['0/-1/4', '0/-1/5', '0/-2/4', '0/-2/5'].sort());
  assert.deepEqual(children('0/3/3'), []);
});

test('distance is nothing above a tile and grows beside it', () => {
  assert.equal(distanceTo('0/0/0', levels, [10, 10, 0]), 0);
  assert.equal(distanceTo('0/0/0', levels, [256 + 30, 100, 40]), 50);
});

test('finest near the eye, coarse far away', () => {
  assert.deepEqual(chosen([512, 512, 1e5], all).draw, ['2/0/0']);
  assert.equal(chosen([512, 512, 10], all).draw.length, 16);
  const near = chosen([0, 0, 10], all);
  assert.ok(near.draw.includes('0/0/0'));
  assert.deepEqual(near.load, []);
});

test('every place is drawn once, whatever has been loaded', () => {
  for (let round = 0; round < 500; ++round) {
    const ready = new Set([...all].filter((id, i) => ((i * 2654435761 + round * 40503) >>> 7) % 3 !== 0));
    if (round % 2) ready.add('2/0/0');
    const { draw, load } = chosen([(round * 37) % 1024, (round * 91) % 1024, round % 400], ready);
    for (let x = 128; x < 1024; x += 256)
      for (let y = 128; y < 1024; y += 256) {
        const drawn = draw.filter((id) => covers(id, x, y)).length;
        const known = [...ready].some((id) => covers(id, x, y));
        assert.equal(drawn, known ? 1 : 0, `${x} ${y} by ${draw}`);
      }
    for (const id of draw) assert.ok(ready.has(id));
    for (const id of load) assert.ok(!ready.has(id) && all.has(id));
    assert.equal(new Set(load).size, load.length);
  }
});

test('coarse tiles are fetched before fine ones', () => {
  const { load } = chosen([0, 0, 10], new Set());
  assert.equal(load[0], '2/0/0');
  assert.deepEqual(load.map((id) => parseId(id)[0]), [...load.map((id) => parseId(id)[0])].sort((a, b) => b - a));
  assert.equal(tileId(...parseId('1/-3/4')), '1/-3/4');
});
