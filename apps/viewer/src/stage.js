// Camera, controls and renderer; draws when something has changed, not all the time.
import * as THREE from 'three';
import { MapControls } from 'three/addons/controls/MapControls.js';

THREE.ColorManagement.enabled = false;
const kPanel_px = 290;

export class Stage {
  constructor(canvas, { onMove }) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.setClearColor('#dfe5e6');
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 1, 1e6);
    this.camera.up.set(0, 0, 1);
    this.world = new THREE.Group(); // scaled by the exaggeration of heights
    this.scene.add(this.world);
    this.controls = new MapControls(this.camera, canvas);
    this.controls.maxPolarAngle = 1.45;
    this.controls.screenSpacePanning = false;
    this.controls.listenToKeyEvents(canvas);
    this.controls.addEventListener('change', () => {
      this.dirty = true;
      onMove();
    });
    this.onMove = onMove;
    this.overlays = [];
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.renderer.setAnimationLoop(() => this.frame());
  }

  resize() {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    if (!w || !h) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    // The middle of what the panel leaves free is the middle of the view.
    if (w > 900) this.camera.setViewOffset(w, h, -kPanel_px / 2, 0, w, h);
    else this.camera.setViewOffset(w, h, 0, -0.2 * h, w, h);
    this.camera.updateProjectionMatrix();
    this.dirty = true;
    this.onMove();
  }

  // Looks at the middle of a map of that size, from the south.
  home(width, height) {
    const size = Math.max(1.15 * width / Math.min(Math.max(this.camera.aspect, 0.6), 1.3), height, 20);
    this.controls.target.set(0, 0, 0);
    this.camera.position.set(-0.16 * size, -0.92 * size, 0.82 * size);
    this.camera.near = size / 2000;
    this.camera.far = size * 20;
    this.camera.updateProjectionMatrix();
    this.controls.minDistance = 5;
    this.controls.maxDistance = size * 4;
    this.controls.update();
    this.redraw();
    this.onMove();
  }

  // The pixel of what is looked at.
  middle() {
    const [x, y] = this.project(this.world.worldToLocal(this.controls.target.clone()));
    return [x, y];
  }

  zoom(factor) {
    const { target, minDistance, maxDistance } = this.controls;
    const away = this.camera.position.clone().sub(target);
    away.setLength(Math.min(Math.max(away.length() * factor, minDistance), maxDistance));
    this.camera.position.copy(target).add(away);
    this.controls.update();
  }

  exaggerate(factor) {
    this.world.scale.z = factor;
    this.redraw();
    this.onMove();
  }

  redraw() {
    this.dirty = true;
  }

  frame() {
    this.controls.update();
    if (!this.dirty) return;
    this.dirty = false;
    // Near enough for what is looked at, far enough for a depth buffer's digits.
    const away = this.camera.position.distanceTo(this.controls.target);
    this.camera.near = Math.max(away / 100, 0.5);
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
    for (const draw of this.overlays) draw();
  }

  // Where a pixel of the canvas hits the objects, in the group's own coordinates; null beside them.
  pick(x, y, objects) {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    this.scene.updateMatrixWorld();  // of what has come since the last frame
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2((2 * x) / w - 1, 1 - (2 * y) / h), this.camera);
    const hit = ray.intersectObjects(objects, false)[0];
    return hit ? this.world.worldToLocal(hit.point.clone()) : null;
  }

  // CSS pixels of a place in the group; null behind the camera.
  project(point) {
    const v = this.world.localToWorld(point.clone()).project(this.camera);
    if (v.z > 1) return null;
    return [((v.x + 1) / 2) * this.canvas.clientWidth, ((1 - v.y) / 2) * this.canvas.clientHeight];
  }
}
