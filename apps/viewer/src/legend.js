import { css } from './layers.js';

const make = (name, className, text) => Object.assign(document.createElement(name), { className, textContent: text ?? '' });

// Fills the figure with what the layer's colours mean.
export function showLegend(figure, legend) {
  figure.replaceChildren(make('figcaption', '', legend.name));
  if (legend.stops) {
    const bar = make('div', 'ramp');
    bar.style.background = `linear-gradient(to right, ${legend.stops.map(css).join(', ')})`;
    const ends = make('div', 'row ends');
    ends.append(make('span', '', `${legend.low} ${legend.unit}`), make('span', '', `${legend.high} ${legend.unit}`));
    figure.append(bar, ends);
  }
  for (const [colour, text] of legend.exceptions) {
    const line = make('div', 'entry');
    const patch = make('span', 'patch');
    patch.style.background = css(colour);
    line.append(patch, make('span', '', text));
    figure.append(line);
  }
}
