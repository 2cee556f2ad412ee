// Meshes of `btms export`, read by programs nobody here wrote: Khronos' validator, and three.js' loaders.
// node test/mesh.js BTMS
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import validator from 'gltf-validator';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { PLYLoader } from 'three/examples/jsm/loaders/PLYLoader.js';

globalThis.self ??= globalThis; // what the loaders take for a browser
const btms = process.argv[2];
const folder = mkdtempSync(join(tmpdir(), 'btms-mesh-'));
const run = (words, input) => execFileSync(btms, words, { encoding: 'utf8', input, maxBuffer: 1 << 28 });
const bytesOf = (file) => new Uint8Array(readFileSync(join(folder, file)));

// Every vertex is on the surface: its height is that of a query there, as float32.
function expectHeights(map, positions, origin) {
  const n = positions.length / 3;
  const places = Array.from({ length: n }, (_, i) => `${origin[0] + positions[3 * i]} ${origin[1] + positions[3 * i + 1]}`);
  const answers = JSON.parse(run(['query', map, '--json'], places.join('\n') + '\n')).places;
  answers.forEach((answer, i) => assert.equal(positions[3 * i + 2], Math.fround(answer.z), places[i]));
}

// Vertices at the ends of edges that belong to one triangle only; none belongs to more than two.
function outlineOf(positions, index) {
  const seen = new Set();
  for (let i = 0; i < positions.length; i += 3) seen.add(positions.slice(i, i + 2).join());
  assert.equal(seen.size, positions.length / 3, 'a vertex is there twice: the mesh has seams');
  const uses = new Map();
  for (let t = 0; t < index.length; t += 3)
    for (let k = 0; k < 3; ++k) {
      const [a, b] = [index[t + k], index[t + ((k + 1) % 3)]];
      const edge = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
      uses.set(edge, (uses.get(edge) ?? 0) + 1);
    }
  const outline = new Set();
  for (const [edge, n] of uses) {
    assert(n <= 2);
    if (n === 1) outline.add(Math.floor(edge / 2 ** 26)).add(edge % 2 ** 26);
  }
  return outline;
}

// The outline of a part without holes lies on the box, so there is no crack inside.
function expectOnBox(outline, positions, origin, [x0, y0, x1, y1]) {
  for (const i of outline) {
    const [x, y] = [origin[0] + positions[3 * i], origin[1] + positions[3 * i + 1]];
    assert(x === x0 || x === x1 || y === y0 || y === y1, `a crack at ${x} ${y}`);
  }
}

async function main() {
  // Where the blocks that a mesh is made of meet, in the middle of the map.
  run(['synth', '--points', '150000', '--origin=-64,-64', '-o', join(folder, 'truth'), '--quiet']);
  const map = join(folder, 'city.btms');
  run(['build', join(folder, 'truth'), '-o', map, '--tile-cells', '1', '--quiet']);
  for (const level of [0, 2, 4]) {
    const box = [-64, -64, 64, 64]; // over many tiles of 16 x 16 squares, and none at the end of the map
    const options = ['--level', `${level}`, '--bbox', box.join(), '--json'];
    const glb = JSON.parse(run(['export', map, '-o', join(folder, `${level}.glb`), ...options]));
    const ply = JSON.parse(run(['export', map, '-o', join(folder, `${level}.ply`), ...options]));
    assert.equal(glb.triangles, 4 * (128 / 2 ** level / 2) ** 2);

    const report = await validator.validateBytes(bytesOf(`${level}.glb`));
    assert.deepEqual([report.issues.numErrors, report.issues.numWarnings], [0, 0], JSON.stringify(report.issues));
    assert.equal(report.info.totalTriangleCount, glb.triangles);

    const scene = await new Promise((done, failed) => new GLTFLoader().parse(bytesOf(`${level}.glb`).buffer, '', done, failed));
    const { attributes, index } = scene.scene.children[0].geometry;
    const origin = scene.asset.extras.origin_m;
    const positions = new Float32Array(3 * attributes.position.count);
    for (let i = 0; i < attributes.position.count; ++i) {
      const p = attributes.position;
      positions.set([p.getX(i), -p.getZ(i), p.getY(i)], 3 * i);
      assert(attributes.normal.getY(i) > 0);
    }
    expectOnBox(outlineOf(positions, index.array), positions, origin, box);
    expectHeights(map, positions, origin);

    const geometry = new PLYLoader().parse(bytesOf(`${level}.ply`).buffer);
    assert.equal(geometry.index.count, 3 * ply.triangles);
    assert.deepEqual(Array.from(geometry.index.array), Array.from(index.array));
    assert.deepEqual(Array.from(geometry.attributes.position.array), Array.from(positions));
    assert.equal(geometry.attributes.color.count, ply.vertices);
    // Counter-clockwise from above.
    for (let t = 0; t < index.count; t += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => 3 * index.array[t + k]);
      const [ax, ay] = [positions[a], positions[a + 1]];
      assert((positions[b] - ax) * (positions[c + 1] - ay) > (positions[c] - ax) * (positions[b + 1] - ay));
    }
  }
}

await main().finally(() => rmSync(folder, { recursive: true, force: true }));
