import assert from 'node:assert/strict';
import test from 'node:test';
import { step } from '../src/chart.js';
import { layers, ramp, shade } from '../src/layers.js';

test('a ramp runs through its stops and ends at them', () => {
  const stops = [[0, 0, 0], [100, 50, 0], [200, 200, 200]];
  assert.deepEqual(ramp(stops, 0), [0, 0, 0]);
  assert.deepEqual(ramp(stops, 0.25), [50, 25, 0]);
  assert.deepEqual(ramp(stops, 0.5), [100, 50, 0]);
  assert.deepEqual(ramp(stops, 7), [200, 200, 200]);
});

test('every layer has a colour for its values and a legend', () => {
  for (const layer of layers) {
    for (const value of [0, 0.5, 1, 3, layer.id === 'height' ? 5 : NaN])
      for (const c of layer.colour(value, [0, 10])) assert.ok(c >= 0 && c <= 255, `${layer.id} ${value}`);
    assert.ok(layer.legend([0, 10]).name);
  }
});

test('what faces the light is lighter', () => {
  assert.ok(shade(0.5, -0.5) > shade(0, 0));
  assert.ok(shade(0, 0) > shade(-0.5, 0.5));
});

test('steps of a chart are round', () => {
  assert.equal(step(439, 4), 200);
  assert.equal(step(2.3, 4), 1);
});

test('a border goes on as the slope inside does', async () => {
  const { heights } = await import('../src/tile_mesh.js');
  const tile = { rows: 4, cols: 4, layers: [Float32Array.from({ length: 16 }, (_, k) => (k % 4) * 2 + (3 - Math.floor(k / 4)) * 10)] };
  const height = heights(tile);
  assert.deepEqual([-1, 0, 1, 3, 4].map((i) => height(i, 1)), [9, 10, 12, 16, 17]);
  assert.deepEqual([-1, 0, 3, 4].map((j) => height(0, j)), [-5, 0, 30, 35]);
  assert.equal(height(4, 4), 42);
});
