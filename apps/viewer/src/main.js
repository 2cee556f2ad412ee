// The page: wires the panel, the terrain and the tools together.
import { MapApi } from './api.js';
import { chart } from './chart.js';
import { layerOf, layers } from './layers.js';
import { showLegend } from './legend.js';
import { outline, place, wayLine } from './overlay.js';
import { Stage } from './stage.js';
import { Terrain } from './terrain.js';

const $ = (id) => document.getElementById(id);
const kRoute = '#1a5ad6', kBad = '#d42a3c', kChanged = '#e08a00';

let stage, terrain, api, facts, events;
let layer = layerOf(new URLSearchParams(location.search).get('layer'));
let tool = 'look';
let marks = []; // {element, point}
let drawn = []; // lines of the tool
let ends = []; // of the route that is being drawn

function say(text, stays = false) {
  $('message').textContent = text;
  $('message').hidden = !text;
  clearTimeout(say.timer);
  if (text && !stays) say.timer = setTimeout(() => say(''), 8000);
}
const failed = (error) => {
  console.warn(error);
  say(error.message || String(error));
};

function status() {
  const idle = terrain.idle;
  $('loading').hidden = idle;
  if (!idle) $('loading').value = terrain.drawn.length / Math.max(terrain.drawn.length + terrain.wanted, 1);
  $('status-text').textContent = `${terrain.drawn.length} tiles · revision ${facts.revision}`;
  document.body.dataset.idle = String(idle && terrain.drawn.length > 0);
  document.body.dataset.revision = facts.revision;
}

let pending = false;
// At most once a frame.
function update() {
  if (!terrain?.roots || pending) return;
  pending = true;
  requestAnimationFrame(() => {
    pending = false;
    const { x, y, z } = stage.camera.position;
    // Above the highest ground: hilltops are as near as they can be.
    const eye = [x + terrain.origin[0], y + terrain.origin[1], Math.max(z - (terrain.range[1] - terrain.origin[2]), 0)];
    terrain.update(eye);
    status();
  });
}

let turn = 0; // answers to what was asked before the last clearing are nobody's

function clearTool() {
  ++turn;
  for (const line of drawn) {
    stage.world.remove(line);
    line.geometry.dispose();
    line.material.dispose();
  }
  drawn = [];
  for (const mark of marks) mark.element.remove();
  marks = [];
  ends = [];
  $('answer').hidden = true;
  stage.redraw();
}

function addMark(point, name, text) {
  const element = document.createElement('span');
  element.className = `mark ${name}`;
  element.textContent = text;
  $('marks').append(element);
  marks.push({ element, point: place(point, terrain.origin) });
  stage.redraw();
}

function placeMarks() {
  for (const { element, point } of marks) {
    const at = stage.project(point);
    element.hidden = !at;
    if (at) element.style.translate = `${at[0]}px ${at[1]}px`;
  }
}

function answer(title, rows, more = []) {
  const heading = Object.assign(document.createElement('h2'), { textContent: title });
  const list = document.createElement('dl');
  for (const [key, value] of rows) {
    list.append(Object.assign(document.createElement('dt'), { textContent: key }), Object.assign(document.createElement('dd'), { textContent: value }));
  }
  const close = Object.assign(document.createElement('button'), { className: 'close', textContent: '×' });
  close.setAttribute('aria-label', 'Close');
  close.addEventListener('click', clearTool);
  $('answer').replaceChildren(close, heading, list, ...more);
  $('answer').hidden = false;
}

const metres = (v, digits = 2) => (v === null || v === undefined ? 'not known' : `${v.toFixed(digits)} m`);
const kStates = { observed: 'observed', predicted: 'predicted from its surroundings', obstacle: 'inferred below an obstacle', filled: 'a guess, far from any ground seen' };

async function look([x, y]) {
  clearTool();
  const asked = turn;
  const h = await api.height(x, y);
  if (asked !== turn) return;
  if (h.z === null) return answer('No surface here', [['Place', `${x.toFixed(1)}, ${y.toFixed(1)}`]]);
  addMark([x, y, h.z], 'pin', '');
  const slope = (Math.acos(Math.min(h.normal[2], 1)) * 180) / Math.PI;
  answer(`${h.z.toFixed(2)} m`, [
    ['Place', `${x.toFixed(1)}, ${y.toFixed(1)}`],
    ['Uncertainty', `± ${metres(h.sd)}`],
    ['State', kStates[h.state] ?? h.state],
    ['Slope', `${slope.toFixed(1)}°`],
    ['Step', metres(h.layers?.step)],
    ['Crossing', h.layers?.cost === null || h.layers?.cost === undefined ? 'not possible' : `costs ${h.layers.cost.toFixed(2)} of 1`],
  ]);
}

// How far along the way its nearest point to the place is.
function distanceAlong(points, { x, y }) {
  let best = [Infinity, 0], so_far = 0;
  for (let i = 1; i < points.length; ++i) {
    const [ax, ay] = points[i - 1], [bx, by] = points[i];
    const length = Math.hypot(bx - ax, by - ay);
    const share = length > 0 ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length ** 2, 0), 1) : 0;
    const away = Math.hypot(x - ax - share * (bx - ax), y - ay - share * (by - ay));
    if (away < best[0]) best = [away, so_far + share * length];
    so_far += length;
  }
  return best[1];
}

async function route(point) {
  if (ends.length === 2) clearTool();
  ends.push(point);
  addMark(point, ends.length === 1 ? 'from' : 'to', ends.length === 1 ? 'from' : 'to');
  if (ends.length < 2) return answer('Route', [['Next', 'click where it should end']]);
  answer('Route', [['Searching', '…']]);
  const [from, to] = ends.map(([x, y]) => [x, y]);
  const asked = turn;
  const found = await api.route(from, to);
  if (asked !== turn) return;
  const isFound = found.status === 'found';
  const way = isFound ? found.points : ends;
  const line = way.map(([x, y]) => [x, y]);
  const length = isFound ? found.length_m : Math.hypot(to[0] - from[0], to[1] - from[1]);
  const [heights, check] = await Promise.all([api.profile(line, Math.max(length / 300, 0.5)), api.check(line)]);
  if (asked !== turn) return;
  const points = isFound ? way : heights.map(([d, z]) => [from[0] + (d / length) * (to[0] - from[0]), from[1] + (d / length) * (to[1] - from[1]), z ?? point[2]]);
  if (!isFound) drawn.push(wayLine(points, terrain.origin, kBad, 4, true));
  else drawn.push(wayLine(points, terrain.origin, '#ffffff', 9), wayLine(points, terrain.origin, kRoute, 5));
  drawn.forEach((l, i) => {
    l.renderOrder = 2 + i;
    stage.world.add(l);
  });
  stage.redraw();
  const why = { blocked: 'no way leads there', no_start: 'nothing can drive at the start', no_goal: 'nothing can drive at the end', too_far: 'too far for one search' };
  const bad = check.first_bad;
  if (bad) addMark([bad.x, bad.y, point[2]], 'bad', '!');
  const rows = isFound
    ? [['Length', metres(found.length_m, 1)], ['Steepest', `${found.steepest_deg.toFixed(1)}°`]]
    : [['No route', why[found.status] ?? found.status], ['Straight line', metres(length, 1)]];
  rows.push([`${facts.vehicle.width_m} m wide vehicle`, check.is_safe ? 'can drive it' : `stopped by ${bad ? bad.reason : 'something'}`]);
  answer(isFound ? 'Route' : 'No route', rows, [chart(heights, bad ? distanceAlong(line, bad) : null)]);
}

function choose(next) {
  layer = next;
  showLegend($('legend'), layer.legend(terrain.range));
  terrain.setStyle(layer);
  update();
}

function choseTool(next) {
  tool = next;
  clearTool();
  for (const name of ['look', 'route']) $(`tool-${name}`).setAttribute('aria-pressed', String(name === tool));
  if (tool === 'route') answer('Route', [['Next', 'click where it should begin']]);
}

// Tiles that changed are fetched anew; their borders show for a moment where they lie.
async function changed(data) {
  const before = api;
  const now = await api.facts();
  await terrain.refresh(now);
  if (before !== api) return; // another map is looked at
  facts = now;
  update();
  for (const { id } of data.tiles.filter((t) => terrain.drawn.includes(t.id)).slice(0, 64)) {
    const { mesh } = terrain.tiles.get(id);
    const line = mesh && outline(mesh, kChanged);
    if (!line) continue;
    stage.world.add(line);
    setTimeout(() => {
      stage.world.remove(line);
      line.geometry.dispose();
      line.material.dispose();
      stage.redraw();
    }, 4000);
  }
  document.body.dataset.changed = String(data.tiles.length);
  say(`Revision ${facts.revision}: ${data.tiles.length} ${data.tiles.length === 1 ? 'tile' : 'tiles'} changed`);
  stage.redraw();
}

function listen() {
  events?.close();
  events = api.events();
  events.addEventListener('tiles', (e) => changed(JSON.parse(e.data)).catch(failed));
  events.addEventListener('reset', () => changed({ tiles: [] }).catch(failed));
  // The browser comes back by itself; what was missed it asks for then.
  events.onerror = () => $('status-text').append(' · not connected');
  events.onopen = status;
}

async function open(id) {
  if (terrain) {
    clearTool();
    stage.world.remove(terrain.group);
    terrain.dispose();
  }
  api = new MapApi(id);
  facts = await api.facts();
  const [x0, y0, x1, y1] = facts.bounds;
  $('title').textContent = facts.title;
  document.title = `${facts.title} – B-TMS`;
  const size = (m) => (m >= 2000 ? `${(m / 1000).toFixed(1)} km` : `${Math.round(m)} m`);
  $('facts').textContent = `${size(x1 - x0)} × ${size(y1 - y0)}, squares of ${facts.resolution_m} m${facts.epsg ? `, EPSG:${facts.epsg}` : ''}`;
  terrain = new Terrain(api, facts, {
    onChange: () => {
      stage.redraw();
      update();
    },
    onError: failed,
  });
  await terrain.open(layer);
  stage.world.add(terrain.group);
  stage.home(x1 - x0, y1 - y0);
  choose(layer);
  listen();
}

// What the tool does at a pixel of the view.
function act(x, y) {
  const hit = stage.pick(x, y, terrain.group.children);
  if (!hit) return;
  const point = [hit.x + terrain.origin[0], hit.y + terrain.origin[1], hit.z + terrain.origin[2]];
  (tool === 'look' ? look(point) : route(point)).catch(failed);
}

// A click is a press that does not move. With the keyboard: arrows move, + and - zoom, Enter acts in the middle.
function listenToView(canvas) {
  let down = null;
  canvas.addEventListener('pointerdown', (e) => (down = [e.clientX, e.clientY, e.button]));
  canvas.addEventListener('pointerup', (e) => {
    if (!down || down[2] !== 0 || Math.hypot(e.clientX - down[0], e.clientY - down[1]) > 4) return;
    const box = canvas.getBoundingClientRect();
    act(e.clientX - box.left, e.clientY - box.top);
  });
  canvas.addEventListener('keydown', (e) => {
    if (e.key === 'Enter') act(...stage.middle());
    if (e.key === '+' || e.key === '-') stage.zoom(e.key === '+' ? 0.8 : 1.25);
  });
}

async function start() {
  try {
    stage = new Stage($('view'), { onMove: update });
  } catch {
    $('status').hidden = true;
    return say('This page draws with WebGL 2, which this browser does not offer.', true);
  }
  stage.overlays.push(placeMarks);
  for (const l of layers) {
    const label = document.createElement('label');
    const input = Object.assign(document.createElement('input'), { type: 'radio', name: 'layer', value: l.id, checked: l === layer });
    input.addEventListener('change', () => choose(l));
    label.append(input, l.label);
    $('layers').append(label);
  }
  $('exaggeration').addEventListener('input', (e) => {
    $('exaggeration-value').textContent = `×${e.target.value}`;
    stage.exaggerate(Number(e.target.value));
  });
  $('tool-look').addEventListener('click', () => choseTool('look'));
  $('tool-route').addEventListener('click', () => choseTool('route'));
  $('home').addEventListener('click', () => stage.home(facts.bounds[2] - facts.bounds[0], facts.bounds[3] - facts.bounds[1]));
  addEventListener('keydown', (e) => e.key === 'Escape' && clearTool());
  const maps = await MapApi.list();
  if (maps.length === 0) return say('The server has no map.', true);
  const wanted = new URLSearchParams(location.search).get('map');
  for (const m of maps) $('maps').append(new Option(m.title, m.id, false, m.id === wanted));
  $('maps').hidden = maps.length === 1;
  $('maps').addEventListener('change', (e) => open(e.target.value).catch(failed));
  await open(maps.some((m) => m.id === wanted) ? wanted : maps[0].id);
  listenToView($('view'));
}

start().catch(failed);
