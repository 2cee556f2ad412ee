// The map's tiles in the scene: fetched by need, kept within a budget, coloured by the layer, renewed when they change.
import * as THREE from 'three';
import { parseRawTile } from './raw_tile.js';
import { TileMesh } from './tile_mesh.js';
import { choose, parseId, tileId } from './tiles.js';

const kFetches = 6, kMostTiles = 220, kRetry_ms = 3000;

export class Terrain {
  // `onChange()` when the picture should be drawn anew, `onError(error)`.
  constructor(api, facts, { onChange, onError }) {
    Object.assign(this, { api, facts, onChange, onError });
    this.levels = facts.levels;
    this.group = new THREE.Group();
    this.etags = new Map();
    this.tiles = new Map(); // id -> {mesh, etag, source, used}; mesh null: nothing there
    this.fetching = new Map(); // id -> AbortController
    this.failed = new Map(); // id -> when to try again
    this.drawn = [];
    this.wanted = 0;
    this.style = null;
    this.range = [0, 1];
    this.relief = 1;
    this.origin = [(facts.bounds[0] + facts.bounds[2]) / 2, (facts.bounds[1] + facts.bounds[3]) / 2, 0];
    this.clock = 0;
  }

  // What the map has; and from its coarsest tiles how high it is.
  async open(style) {
    this.style = style;
    await this.refresh(this.facts);
    const heights = [];
    for (const id of this.roots) {
      const tile = await this.fetchTile(id);
      if (!tile) continue;
      for (const [i, z] of tile.layers[0].entries()) if (!Number.isNaN(z) && tile.layers[1][i] < 4) heights.push(z);
    }
    heights.sort((a, b) => a - b);
    const at = (share) => heights[Math.floor(share * (heights.length - 1))] ?? 0;
    this.range = [at(0.01), Math.max(at(0.99), at(0.01) + 1)];
    this.origin[2] = at(0.5);
    const steep = (this.range[1] - this.range[0]) / Math.max(this.facts.bounds[2] - this.facts.bounds[0], 1);
    this.relief = Math.min(Math.max(0.25 / Math.max(steep, 1e-3), 1), 6);
  }

  // Of a revision: `facts` are its own.
  async refresh(facts) {
    this.facts = facts;
    this.levels = facts.levels;
    const lists = await Promise.all(this.levels.map((_, level) => this.api.tiles(level)));
    this.etags = new Map(lists.flat().map((t) => [t.id, t.etag]));
    this.roots = [...this.etags.keys()].filter((id) => parseId(id)[0] === this.levels.length - 1);
  }

  get source() {
    const extra = this.style.source;
    return extra === 'elevation' || extra === 'class' ? 'elevation,class' : `elevation,class,${extra}`;
  }

  async fetchTile(id, signal) {
    const layers = this.source;
    const buffer = await this.api.tile(id, layers, this.etags.get(id), signal);
    if (!buffer) return null;
    const tile = parseRawTile(buffer);
    if (tileId(tile.level, tile.tx, tile.ty) !== id || tile.layers.length !== layers.split(',').length) throw new Error('another tile than was asked for');
    return tile;
  }

  isFresh(id) {
    const tile = this.tiles.get(id);
    return tile && tile.etag === this.etags.get(id) && (tile.source === this.source || !tile.mesh);
  }

  setStyle(style) {
    this.style = style;
    for (const tile of this.tiles.values()) if (tile.mesh && tile.source === this.source) tile.mesh.paint(style, this.range, this.relief);
    this.onChange();
  }

  // Chooses what to draw as seen from `eye` (map coordinates, z above the ground); fetches what is missing or stale.
  update(eye) {
    ++this.clock;
    const { draw, load } = choose({
      levels: this.levels,
      roots: this.roots,
      exists: (id) => this.etags.has(id),
      ready: (id) => this.tiles.has(id),
      eye,
    });
    // With all above it: what is zoomed out to next.
    for (const id of draw)
      for (let [level, tx, ty] = parseId(id); level < this.levels.length; ++level, tx >>= 1, ty >>= 1) {
        const tile = this.tiles.get(tileId(level, tx, ty));
        if (tile) tile.used = this.clock;
      }
    const stale = draw.filter((id) => !this.isFresh(id));
    const wanted = [...load, ...stale];
    this.wanted = wanted.length;
    for (const [id, abort] of this.fetching) if (!wanted.includes(id)) abort.abort();
    const now = performance.now();
    for (const id of wanted) {
      if (this.fetching.size >= kFetches) break;
      if (!this.fetching.has(id) && !(this.failed.get(id) > now)) this.load(id);
    }
    const changed = draw.length !== this.drawn.length || draw.some((id, i) => id !== this.drawn[i]);
    if (changed) this.show(draw);
    this.evict();
  }

  show(draw) {
    this.drawn = draw;
    this.group.clear();
    for (const id of draw) {
      const { mesh } = this.tiles.get(id);
      if (mesh) this.group.add(mesh.object);
    }
    this.onChange();
  }

  async load(id) {
    const abort = new AbortController();
    this.fetching.set(id, abort);
    const { source } = this, etag = this.etags.get(id);
    try {
      const tile = await this.fetchTile(id, abort.signal);
      if (source !== this.source || abort.signal.aborted) return; // another layer is looked at by now
      const mesh = tile && new TileMesh(tile, this.origin);
      mesh?.paint(this.style, this.range, this.relief);
      this.tiles.get(id)?.mesh?.dispose();
      this.tiles.set(id, { mesh, etag, source, used: this.clock });
      this.failed.delete(id);
      if (this.drawn.includes(id)) this.show(this.drawn);
    } catch (error) {
      if (error.name !== 'AbortError') {
        this.failed.set(id, performance.now() + kRetry_ms);
        setTimeout(this.onChange, kRetry_ms + 10);
        this.onError(error);
      }
    } finally {
      this.fetching.delete(id);
      this.onChange();
    }
  }

  evict() {
    if (this.tiles.size <= kMostTiles) return;
    const old = [...this.tiles].filter(([id, t]) => t.used < this.clock && !this.roots.includes(id)).sort((a, b) => a[1].used - b[1].used);
    for (const [id, tile] of old.slice(0, this.tiles.size - kMostTiles)) {
      tile.mesh?.dispose();
      this.tiles.delete(id);
    }
  }

  dispose() {
    for (const abort of this.fetching.values()) abort.abort();
    for (const tile of this.tiles.values()) tile.mesh?.dispose();
    this.tiles.clear();
    this.group.clear();
    this.roots = null;
  }

  get idle() {
    return this.wanted === 0 && this.fetching.size === 0;
  }
}
