import assert from 'node:assert/strict';
import test from 'node:test';
import { kHeader_bytes, parseRawTile } from '../src/raw_tile.js';

function rawTile({ rows = 2, cols = 3, layers = 2, magic = 'BTMSTILE', version = 1 } = {}) {
  const buffer = new ArrayBuffer(kHeader_bytes + layers * rows * cols * 4);
  const view = new DataView(buffer);
  [...magic].forEach((c, i) => view.setUint8(i, c.charCodeAt(0)));
  view.setUint16(8, version, true);
  view.setUint16(10, layers, true);
  view.setUint16(12, 1, true);
  view.setUint16(14, 1, true);
  view.setInt32(16, -2, true);
  view.setInt32(20, 5, true);
  view.setUint32(24, rows, true);
  view.setUint32(28, cols, true);
  view.setFloat64(32, -12, true);
  view.setFloat64(40, 30, true);
  view.setFloat64(48, 2, true);
  new Float32Array(buffer, kHeader_bytes).forEach((_, i, all) => (all[i] = i));
  return buffer;
}

test('a tile is read as it is described', () => {
  const tile = parseRawTile(rawTile());
  assert.deepEqual([tile.level, tile.tx, tile.ty, tile.rows, tile.cols, tile.cell_m], [1, -2, 5, 2, 3, 2]);
  assert.deepEqual(tile.min, [-12, 30]);
  assert.deepEqual([...tile.layers[1]], [6, 7, 8, 9, 10, 11]);
});

test('what is no tile is refused', () => {
  assert.throws(() => parseRawTile(new ArrayBuffer(10)), /cut short/);
  assert.throws(() => parseRawTile(rawTile({ magic: 'BTMSTALE' })), /not a tile/);
  assert.throws(() => parseRawTile(rawTile({ version: 2 })), /version/);
  assert.throws(() => parseRawTile(rawTile().slice(0, -4)), /cut short/);
  const huge = rawTile();
  new DataView(huge).setUint32(24, 0xffffffff, true);
  assert.throws(() => parseRawTile(huge), /too large/);
});
