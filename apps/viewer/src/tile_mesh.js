// A tile as a mesh: a vertex a cell, one more row around it at the tile's edge, and skirts that hide the seams between
// levels. Heights are relative to the scene's origin.
import * as THREE from 'three';
import { kFilled, kPaper, shade } from './layers.js';

const material = new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide });

// Values of the grid's vertex (i, j), i to the east from -1 to cols, j to the north from -1 to rows; those of the next
// cell at the border.
export function sampler(tile, layer) {
  const values = tile.layers[layer];
  return (i, j) => {
    const col = Math.min(Math.max(i, 0), tile.cols - 1);
    const row = tile.rows - 1 - Math.min(Math.max(j, 0), tile.rows - 1);
    return values[row * tile.cols + col];
  };
}

// Heights of vertices: at the border, half a cell further out, the slope goes on.
export function heights(tile) {
  const inside = sampler(tile, 0);
  const on = (a, b) => (Number.isNaN(b) ? a : 1.5 * a - 0.5 * b);
  const along = (i, j) => {
    if (i < 0) return on(inside(0, j), inside(1, j));
    if (i >= tile.cols) return on(inside(tile.cols - 1, j), inside(tile.cols - 2, j));
    return inside(i, j);
  };
  return (i, j) => {
    if (j < 0) return on(along(i, 0), along(i, 1));
    if (j >= tile.rows) return on(along(i, tile.rows - 1), along(i, tile.rows - 2));
    return along(i, j);
  };
}

// Metres from the tile's south-west corner to vertex i of n.
const along = (i, n, cell_m) => Math.min(Math.max(i + 0.5, 0), n) * cell_m;

// {positions, index}: the height of a place without a surface is NaN and no triangle touches it.
export function surface(tile, heightOrigin) {
  const { rows, cols, cell_m } = tile;
  const height = heights(tile);
  const w = cols + 2, h = rows + 2;
  const count = w * h + 2 * (w + h);
  const positions = new Float32Array(count * 3);
  const known = new Uint8Array(w * h);
  const index = [];
  let n = 0;
  for (let j = -1; j <= rows; ++j)
    for (let i = -1; i <= cols; ++i, ++n) {
      const z = height(i, j);
      known[n] = Number.isNaN(z) ? 0 : 1;
      positions.set([along(i, cols, cell_m), along(j, rows, cell_m), known[n] ? z - heightOrigin : 0], 3 * n);
    }
  for (let j = 0; j + 1 < h; ++j)
    for (let i = 0; i + 1 < w; ++i) {
      const a = j * w + i, b = a + 1, c = a + w, d = c + 1;
      if (known[a] && known[b] && known[d]) index.push(a, b, d);
      if (known[a] && known[d] && known[c]) index.push(a, d, c);
    }
  // Skirts hang down by as much as the levels may differ.
  const depth = 2 * cell_m;
  const border = [];
  for (let i = 0; i < w; ++i) border.push(i);
  for (let j = 0; j < h; ++j) border.push(j * w + w - 1);
  for (let i = w - 1; i >= 0; --i) border.push((h - 1) * w + i);
  for (let j = h - 1; j >= 0; --j) border.push(j * w);
  const skirt = new Uint32Array(border.length);
  border.forEach((v, k) => {
    positions.set([positions[3 * v], positions[3 * v + 1], positions[3 * v + 2] - depth], 3 * n);
    skirt[k] = v;
    if (k > 0 && known[border[k - 1]] && known[v]) {
      const a = border[k - 1], b = v, c = n - 1, d = n;
      index.push(a, c, d, a, d, b);
    }
    ++n;
  });
  return { positions, index, skirt, known, w, h };
}

// Colours of the vertices, shaded; `style`: a layer of layers.js, `range` what its ramp spans.
export function colours(tile, { w, h, skirt }, style, range, relief) {
  const { rows, cols, cell_m } = tile;
  const height = sampler(tile, 0), state = sampler(tile, 1), value = sampler(tile, tile.layers.length > 2 ? 2 : 0);
  const out = new Uint8Array((w * h + skirt.length) * 3);
  const rise = (a, b, run) => (Number.isNaN(a - b) ? 0 : (relief * (b - a)) / run);
  let n = 0;
  for (let j = -1; j <= rows; ++j)
    for (let i = -1; i <= cols; ++i, ++n) {
      if (Number.isNaN(height(i, j))) continue;
      // Of the two next cells inside where there is none on one side.
      const west = Math.min(Math.max(i - 1, 0), cols - 2), east = Math.max(Math.min(i + 1, cols - 1), 1);
      const south = Math.min(Math.max(j - 1, 0), rows - 2), north = Math.max(Math.min(j + 1, rows - 1), 1);
      const light = shade(
        rise(height(west, j), height(east, j), (east - west) * cell_m),
        rise(height(i, south), height(i, north), (north - south) * cell_m),
      );
      let c = style.colour(style.source === 'class' ? state(i, j) : value(i, j), range);
      // Guesses recede, unless they are what is looked at.
      if (style.source !== 'class' && state(i, j) === kFilled) c = c.map((v, k) => 0.35 * v + 0.65 * kPaper[k]);
      for (let k = 0; k < 3; ++k) out[3 * n + k] = Math.min(c[k] * light, 255);
    }
  for (const v of skirt) {
    for (let k = 0; k < 3; ++k) out[3 * n + k] = out[3 * v + k];
    ++n;
  }
  return out;
}

export class TileMesh {
  constructor(tile, origin) {
    this.tile = tile;
    this.shape = surface(tile, origin[2]);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(this.shape.positions, 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Uint8Array(this.shape.positions.length), 3, true));
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(this.shape.index), 1));
    this.object = new THREE.Mesh(geometry, material);
    this.object.position.set(tile.min[0] - origin[0], tile.min[1] - origin[1], 0);
    this.object.userData.tile = this;
  }
  paint(style, range, relief) {
    const colour = this.object.geometry.getAttribute('color');
    colour.array.set(colours(this.tile, this.shape, style, range, relief));
    colour.needsUpdate = true;
  }
  dispose() {
    this.object.geometry.dispose();
  }
}
