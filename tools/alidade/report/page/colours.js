// SPDX-License-Identifier: Apache-2.0
// Colours and dashes. They identify estimators in all figures.

// The palette of Okabe and Ito. The sixth and later estimators repeat the hues with dashes.
// Vermillion is reserved for rejected measurements.
const LIGHT = ['#0072B2', '#E08A00', '#009E73', '#CC79A7', '#4FA9DB'];

const DARK = ['#4AA8E8', '#E69F00', '#1FC796', '#DE93BC', '#8ACBF0'];
const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3]];

const colorOf = (name) => {
  const i = NAMES.indexOf(name);
  return i < 0 ? ink() : (page.dark ? DARK : LIGHT)[i % 5];
};

const dashOf = (name) => DASHES[Math.max(0, Math.floor(NAMES.indexOf(name) / 5)) % 4];

/** Colour and dashes of line `i` of a figure whose lines are no estimators. */
const seriesColour = (i) => (page.dark ? DARK : LIGHT)[i % 5];
const seriesDash = (i) => DASHES[Math.floor(i / 5) % 4];

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const colours = {};

function readPalette() {
  for (const k of ['ink', 'muted', 'faint', 'grid', 'line', 'panel', 'shade', 'accent'])
    colours[k] = css('--' + k);
}

const ink = () => colours.ink;
/** Zone of values that a consistent estimator has. */
const GOOD_ZONE = {alpha: 0.13, color: () => (page.dark ? '#2fbf93' : '#009E73')};
const REJECTED = () => (page.dark ? '#FF6A3D' : '#D55E00');
const nameStyle = document.head.appendChild(document.createElement('style'));

/** Names are text: darker on white than the lines, so that they can be read. */
const TEXT = ['#00639B', '#A65E00', '#007354', '#A34A7E', '#2A7BAA'];

const textColor = (n) => (page.dark ? colorOf(n) : TEXT[NAMES.indexOf(n) % 5]);

function setTheme(dark) {
  page.dark = dark;
  document.documentElement.dataset.theme = dark ? 'dark' : 'light';
  readPalette();
  nameStyle.textContent = NAMES.map(
    (n) => `[data-est="${CSS.escape(n)}"] { color: ${textColor(n)}; }`,
  ).join('\n');
  redraw();
}

/** Colours of a quantity from small to large. */
const RAMP = [
  [31, 111, 180],
  [106, 160, 200],
  [185, 180, 168],
  [232, 160, 76],
  [209, 68, 12],
];

/** The colour of a share from 0 to 1. */
function ramp(share) {
  const place = clamp(share, 0, 1) * (RAMP.length - 1);
  const i = Math.min(RAMP.length - 2, Math.floor(place));
  const mixed = RAMP[i].map((v, k) => Math.round(v + (place - i) * (RAMP[i + 1][k] - v)));
  return `rgb(${mixed.join(',')})`;
}
