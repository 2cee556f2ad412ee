// What the layers look like: colours of values, and legends.

const hex = (text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));
// Light to dark, so that it can be read without its hues.
const kHarm = ['#e2eccd', '#fadb78', '#f4963e', '#cc3e3a', '#701046'].map(hex);
const kHeights = ['#2f6f73', '#5c9a72', '#a9bd78', '#dccb8e', '#cfa877', '#b58a68', '#e9dfd2'].map(hex);

const kStates = ['#ffffff', '#c9c5b4', '#6fa8c9', '#e39a4f', '#e4e1d8'].map(hex);
const kBlocked = hex('#5c5464');
export const kPaper = hex('#eef0ec');

// [r, g, b] of a ramp, 0 to 1; clamped.
export function ramp(stops, share) {
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(at), stops.length - 2);
  return stops[i].map((c, k) => c + (at - i) * (stops[i + 1][k] - c));
}

const sample = (name, low, high, unit, stops, exceptions = []) => ({ low, high, unit, stops, exceptions, name });

// `source`: the layer asked of the server. `colour(value, range)`: of a cell.
export const layers = [
  {
    id: 'height',
    label: 'Height',
    source: 'elevation',
    colour: (v, [low, high]) => ramp(kHeights, (v - low) / (high - low)),
    legend: ([low, high]) => sample('Height', low.toFixed(1), high.toFixed(1), 'm', kHeights),
  },
  {
    id: 'state',
    label: 'State',
    source: 'class',
    colour: (v) => kStates[v] ?? kStates[0],
    legend: () => ({
      name: 'What is known of the ground',
      exceptions: [
        [kStates[1], 'observed'],
        [kStates[2], 'predicted from its surroundings'],
        [kStates[3], 'below an obstacle'],
        [kStates[4], 'a guess, far from any ground seen'],
      ],
    }),
  },
  {
    id: 'cost',
    label: 'Traversability',
    source: 'cost',
    colour: (v) => (Number.isNaN(v) ? kBlocked : ramp(kHarm, v)),
    legend: () => sample('What crossing costs the vehicle', '0', '1', '', kHarm, [[kBlocked, 'not traversable']]),
  },
  {
    id: 'slope',
    label: 'Slope',
    source: 'slope',
    colour: (v) => (Number.isNaN(v) ? kStates[4] : ramp(kHarm, v / 30)),
    legend: () => sample('Slope', '0', '30', '°', kHarm),
  },
  {
    id: 'uncertainty',
    label: 'Uncertainty',
    source: 'elevation_sd',
    colour: (v) => (Number.isNaN(v) ? kStates[4] : ramp(kHarm, v / 0.5)),
    legend: () => sample('Standard deviation of the height', '0', '0.5', 'm', kHarm),
  },
];
export const layerOf = (id) => layers.find((l) => l.id === id) ?? layers[0];
export const kFilled = 4;

// Light from the north-west on a surface that rises by `east` and `north` a metre, 0.45 to 1.15.
export function shade(east, north) {
  const light = [-0.5, 0.5, 0.7071];
  const up = 1 / Math.hypot(east, north, 1);
  const lit = (-east * light[0] - north * light[1] + light[2]) * up;
  return 0.45 + 0.7 * Math.max(lit, 0) ** 1.2;
}

export const css = (c) => `rgb(${c.map(Math.round).join(',')})`;
