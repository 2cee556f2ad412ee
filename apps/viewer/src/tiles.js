// Which tiles to draw: a quadtree over the levels, finest near the eye.

export const tileId = (level, tx, ty) => `${level}/${tx}/${ty}`;
export const parseId = (id) => id.split('/').map(Number);

// The four that cover the tile on the next finer level.
export function children(id) {
  const [level, tx, ty] = parseId(id);
  if (level === 0) return [];
  return [0, 1].flatMap((j) => [0, 1].map((i) => tileId(level - 1, 2 * tx + i, 2 * ty + j)));
}

export function edgeOf(id, levels) {
  const level = levels[parseId(id)[0]];
  return level.cell_m * level.tile_cells;
}

// Distance from the eye [x, y, z above the ground] to the tile.
export function distanceTo(id, levels, eye) {
  const [, tx, ty] = parseId(id);
  const edge = edgeOf(id, levels);
  const dx = Math.max(tx * edge - eye[0], 0, eye[0] - (tx + 1) * edge);
  const dy = Math.max(ty * edge - eye[1], 0, eye[1] - (ty + 1) * edge);
  return Math.hypot(dx, dy, eye[2]);
}

const kDepth = 3; // levels that are searched for what can stand in for a tile

// {draw, load}: ids to draw now, none over another, and those to fetch, most urgent first. `exists(id)` says what the
// map has, `ready(id)` what is here. A tile gives way to its children only when all of them can be drawn; where it is not
// here itself, what is below it is better than nothing.
export function choose({ levels, roots, exists, ready, eye, detail = 2.5 }) {
  const draw = [];
  const load = [];
  const want = (id) => load.push({ id, distance: distanceTo(id, levels, eye) / edgeOf(id, levels) });
  const readyBelow = (id, depth) =>
    depth === 0 ? [] : children(id).filter(exists).flatMap((child) => (ready(child) ? [child] : readyBelow(child, depth - 1)));
  const visit = (id, into) => {
    const finer = distanceTo(id, levels, eye) < detail * edgeOf(id, levels) ? children(id).filter(exists) : [];
    const below = [];
    if (finer.length > 0) {
      // All of them, so that what is missing is asked for at once.
      const whole = finer.map((child) => visit(child, below)).every(Boolean);
      if (whole) {
        into.push(...below);
        return true;
      }
    }
    if (ready(id)) {
      into.push(id);
      return true;
    }
    want(id);
    into.push(...(finer.length > 0 ? below : readyBelow(id, kDepth)));
    return false;
  };
  for (const id of roots) visit(id, draw);
  // What is coarse first: something to see everywhere before detail anywhere.
  load.sort((a, b) => parseId(b.id)[0] - parseId(a.id)[0] || a.distance - b.distance);
  return { draw, load: load.map((l) => l.id) };
}
