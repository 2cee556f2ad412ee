// What is drawn over the terrain: routes, and the outlines of tiles that have just changed.
import * as THREE from 'three';
import { Line2 } from 'three/addons/lines/Line2.js';
import { LineGeometry } from 'three/addons/lines/LineGeometry.js';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';

const kLift_m = 0.6;

export function wayLine(points, origin, colour, width = 5, dashed = false) {
  const geometry = new LineGeometry();
  geometry.setPositions(points.flatMap(([x, y, z]) => [x - origin[0], y - origin[1], z - origin[2] + kLift_m]));
  const material = new LineMaterial({ color: colour, linewidth: width, depthTest: false, dashed, dashSize: 4, gapSize: 4, transparent: true });
  const line = new Line2(geometry, material);
  if (dashed) line.computeLineDistances();
  line.renderOrder = 2;
  return line;
}

// The border of a tile, at the height of the mesh's own border, where that is known; null where it is nowhere.
export function outline(mesh, colour) {
  const { positions, skirt, known } = mesh.shape;
  const points = [...skirt].filter((v) => known[v]).flatMap((v) => [positions[3 * v], positions[3 * v + 1], positions[3 * v + 2] + kLift_m]);
  if (points.length < 6) return null;
  const geometry = new LineGeometry();
  geometry.setPositions(points);
  const line = new Line2(geometry, new LineMaterial({ color: colour, linewidth: 3, depthTest: false, transparent: true }));
  line.position.copy(mesh.object.position);
  line.renderOrder = 3;
  return line;
}

export const place = ([x, y, z], origin) => new THREE.Vector3(x - origin[0], y - origin[1], z - origin[2]);
