// Heights along a way, as an SVG.
const kNs = 'http://www.w3.org/2000/svg';

function element(name, attributes, text) {
  const e = document.createElementNS(kNs, name);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  if (text !== undefined) e.textContent = text;
  return e;
}

// A round step that makes about `n` of them in `span`.
export function step(span, n) {
  const raw = span / n;
  const unit = 10 ** Math.floor(Math.log10(raw));
  return unit * [1, 2, 5, 10].find((f) => f * unit >= raw);
}

// `profile`: [[distance_m, z_m or null, state]]; `badAt`: distance of what is in the way, or null.
export function chart(profile, badAt, { width = 340, height = 130 } = {}) {
  const left = 38, right = 8, top = 8, bottom = 22;
  const svg = element('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': 'Heights along the way', class: 'chart' });
  const known = profile.filter((p) => p[1] !== null);
  if (known.length < 2) return svg;
  const length = Math.max(profile.at(-1)[0], 1e-3);
  let low = Math.min(...known.map((p) => p[1])), high = Math.max(...known.map((p) => p[1]));
  const pad = Math.max(0.1 * (high - low), 0.5);
  low -= pad;
  high += pad;
  const x = (d) => left + (d / length) * (width - left - right);
  const y = (z) => height - bottom - ((z - low) / (high - low)) * (height - top - bottom);
  const zStep = step(high - low, 4);
  for (let z = Math.ceil(low / zStep) * zStep; z <= high; z += zStep) {
    svg.append(element('line', { x1: left, x2: width - right, y1: y(z), y2: y(z), class: 'grid' }));
    svg.append(element('text', { x: left - 4, y: y(z) + 4, 'text-anchor': 'end' }, zStep < 1 ? z.toFixed(1) : z.toFixed(0)));
  }
  const dStep = step(length, 4);
  for (let d = 0; d <= length; d += dStep)
    svg.append(element('text', { x: x(d), y: height - 6, 'text-anchor': 'middle' }, d === 0 ? '0 m' : String(Math.round(d * 10) / 10)));
  let path = '', pen = 'M';
  for (const [d, z] of profile) {
    if (z === null) {
      pen = 'M';
      continue;
    }
    path += `${pen}${x(d).toFixed(1)} ${y(z).toFixed(1)}`;
    pen = 'L';
  }
  svg.append(element('path', { d: path, class: 'line' }));
  if (badAt !== null) {
    svg.append(element('line', { x1: x(badAt), x2: x(badAt), y1: top, y2: height - bottom, class: 'bad' }));
  }
  return svg;
}
