// SPDX-License-Identifier: Apache-2.0
// Section "Adjustment" of a bundle adjustment: its numbers, the cost, and the worst observations.

const BUNDLE = DATA.bundle;

/** Items of the list of facts. */
const bundleFacts = () =>
  ['cameras', 'points', 'observations'].map((name) => [
    strong(count(BUNDLE.results[name])),
    ' ' + name,
  ]);

/** Part of the hint of the map. */
function bundleMapHint({maps}) {
  const drawn = maps.length ? maps[0].x.length : 0;
  const {points} = BUNDLE.results;
  const sample = drawn < points ? ` ${count(drawn)} of ${count(points)} points are drawn.` : '';
  return (
    'Triangles are cameras, dots are points. The legend, or the keys 1 and 2, hide those before ' +
    `and after the adjustment.${sample}`
  );
}

function resultTable() {
  const rows = Object.entries(BUNDLE.results).filter(
    ([, value]) => typeof value === 'number' || (typeof value === 'string' && value),
  );
  const textOf = (value) => {
    if (typeof value !== 'number') return value;
    return Number.isInteger(value) ? count(value) : numberText(value, 5);
  };
  const columns = [
    {name: 'quantity', text: true, get: ([key]) => key.replace(/_/g, ' ')},
    {name: 'value', get: ([, value]) => Number(value), show: ([, value]) => textOf(value)},
  ];
  return dataTable(columns, rows);
}

/** The cost after each step. A step that is not accepted is a cross. */
function bundleCostFigure(box) {
  const cost = columnOf(BUNDLE.iterations.cost);
  if (!cost.length) return;
  const accepted = columnOf(BUNDLE.iterations.accepted);
  const iteration = Float64Array.from(cost, (_, i) => i);
  let current = cost[0];
  const kept = Float64Array.from(cost, (value, i) => {
    if (accepted[i]) current = value;
    return current;
  });
  const tip = (i) => [element('b', {}, `iteration ${i}`), `cost ${numberText(cost[i], 6)}`];
  const dots = (only, style) => ({kind: 'dots', x: iteration, y: cost, only, tip, ...style});
  const layers = () => [
    {kind: 'line', x: iteration, y: kept, color: ink, name: 'cost'},
    dots((i) => accepted[i], {name: 'accepted', color: ink, size: 2.4}),
    dots((i) => !accepted[i], {
      name: 'not accepted',
      color: REJECTED,
      shape: 'cross',
      size: 3.4,
      fit: false,
      keep: true,
    }),
  ];
  const plot = new Plot({
    label: 'cost',
    name: 'cost over the iterations',
    height: 380,
    x: {label: 'iteration'},
    y: {unit: '', log: true, range: () => extentOf([{y: kept}], 'y', true)},
    layers,
  });
  const hint =
    'Half the sum of the squared residuals, in standard deviations, after the loss. It should ' +
    'become flat. Crosses are steps that increased the cost and were undone.';
  figure(box, {title: 'Cost at each iteration', hint, plots: [plot]});
}

/** Content of a residual, such as `0.31, −0.02`. */
const residualText = (values) => values.map((value) => numberText(value)).join(', ');

function worstTable() {
  const names = BUNDLE.residuals.elements.join(', ');
  const columns = [
    {name: 'camera', get: (row) => row.camera, show: (row) => count(row.camera)},
    {name: 'point', get: (row) => row.point, show: (row) => count(row.point)},
    {name: 'size', sub: 'after [px]', get: (row) => row.size},
    {
      name: 'after',
      sub: `${names} [px]`,
      get: (row) => row.size,
      show: (row) => residualText(row.after),
    },
    {
      name: 'before',
      sub: `${names} [px]`,
      get: (row) => Math.hypot(...row.before),
      show: (row) => residualText(row.before),
    },
  ];
  return dataTable(columns, BUNDLE.worst, {tall: true});
}

function bundleSection(main) {
  const box = section('bundle', 'Adjustment', '', main);
  residualFigures(box);
  const grid = element('div', {class: 'cols'});
  box.append(grid);
  bundleCostFigure(grid);
  const worst = [
    element('header', {}, element('h3', {}, `The ${BUNDLE.worst.length} largest residuals`)),
    element('p', {class: 'hint'}, 'Measured minus predicted. observations.csv contains all.'),
    worstTable(),
  ];
  if (BUNDLE.worst.length) grid.append(element('figure', {class: 'panel'}, worst));
  fold(box, 'All numbers', 'of bundle.json', (parent) =>
    parent.append(element('div', {class: 'panel'}, resultTable())),
  );
}
