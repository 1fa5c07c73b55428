// SPDX-License-Identifier: Apache-2.0
// Figure of the correlations of the last covariance.

const POSITIVE = [0, 114, 178];
const NEGATIVE = [222, 120, 10];

/** The colour of a correlation from -1 to 1. */
function correlationColour(rho) {
  const end = rho > 0 ? POSITIVE : NEGATIVE;
  const base = page.dark ? [22, 28, 35] : [255, 255, 255];
  const share = Math.min(1, Math.abs(rho)) ** 0.7;
  return `rgb(${end.map((v, k) => Math.round(base[k] + share * (v - base[k]))).join(',')})`;
}

/** Returns the function (i, j) -> correlation of the elements i and j of P. */
function correlationsOf({lower}) {
  const numbers = columnOf(lower);
  const at = (i, j) => numbers[(Math.max(i, j) * (Math.max(i, j) + 1)) / 2 + Math.min(i, j)];
  return (i, j) => at(i, j) / Math.sqrt(at(i, i) * at(j, j));
}

function paintCorrelations(surface, X, Y, size, rhoOf) {
  const width = X.to(1) - X.to(0);
  const height = Y.to(0) - Y.to(1);
  for (let i = 0; i < size; i++)
    for (let j = 0; j < size; j++) {
      const rho = rhoOf(i, j);
      const [x, y] = [X.to(j), Y.to(size - 1 - i)];
      const style = {fill: correlationColour(rho)};
      surface.rect(x - width / 2 + 0.5, y - height / 2 + 0.5, width - 1, height - 1, style);
      if (width <= 34 || i === j || Math.abs(rho) <= 0.095) continue;
      const color = Math.abs(rho) > 0.6 ? '#fff' : colours.ink;
      const text = rho.toFixed(1).replace('-', '−');
      surface.text(text, x, y, {align: 'center', size: 10, color});
    }
}

function heatMap({last_p: covariance}) {
  const {labels} = covariance;
  const size = labels.length;
  const rhoOf = correlationsOf(covariance);
  const cells = Array.from({length: size * size}, (_, k) => [Math.floor(k / size), k % size]);
  const range = () => [-0.5, size - 0.5];
  const rows = labels.map((label) => label.replace(/^[^.]*\./, '')).reverse();
  const tip = (k) => {
    const [i, j] = cells[k];
    return [element('b', {}, numberText(rhoOf(i, j))), `${labels[i]} and ${labels[j]}`];
  };
  const paint = (surface, X, Y) => paintCorrelations(surface, X, Y, size, rhoOf);
  return new Plot({
    height: Math.max(170, Math.min(size, 26) * 24 + 30),
    name: 'correlation matrix',
    left: innerWidth < 520 ? 110 : 170,
    x: {ticks: [], range},
    y: {unit: '', rows, range},
    layers: () => [
      {kind: 'custom', x: null, paint},
      {
        kind: 'dots',
        x: cells.map(([, j]) => j),
        y: cells.map(([i]) => size - 1 - i),
        alpha: 0,
        color: ink,
        size: 1,
        name: 'correlation',
        tip,
      },
    ],
  });
}

/** The heat map of one estimator, with buttons that select the estimator. */
function correlationFigures(parent, estimators) {
  const holder = element('div');
  let plots = [];
  const show = (name) => {
    dispose(plots);
    plots = [heatMap(estimators.find((e) => e.name === name))];
    setContent(holder);
    figure(holder, {
      title: `Correlations of ${name}`,
      hint:
        'Blue: the errors have the same sign. Orange: they have opposite signs. A pair near ±1 ' +
        'is one direction that the measurements do not separate.',
      plots,
    });
  };
  const names = estimators.map((e) => [e.name, e.name]);
  if (names.length > 1)
    parent.append(element('div', {class: 'side'}, choice('estimator', names, names[0][0], show)));
  parent.append(holder);
  show(names[0][0]);
}
