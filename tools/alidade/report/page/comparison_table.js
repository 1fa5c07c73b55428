// SPDX-License-Identifier: Apache-2.0
// Table of the compared estimators.

/** A value with its interval, times `factor`. */
function intervalCell(e, key, factor = 1, digits = 3) {
  const entry = e.values[key];
  if (!entry) return '–';
  const [value, low, high, isUndecided] = entry;
  const text = (v) => numberText(v * factor, digits);
  const interval =
    low === null ? null : element('span', {class: 'quiet'}, ` [${text(low)}, ${text(high)}]`);
  const title = 'the interval includes 1';
  const mark = isUndecided ? element('span', {class: 'quiet', title}, ' ~') : null;
  return element('span', {}, text(value), interval, mark);
}

/** A column of values with intervals. */
const intervalColumn = (key, column, factor = 1, digits = 3) => ({
  get: (e) => comparedValue(e, key) * factor,
  show: (e) => intervalCell(e, key, factor, digits),
  ...column,
});

function comparisonTable(block) {
  const rows = COMPARISON.estimators;
  const errors = rows.map((e) => comparedValue(e, 'rmse:' + block)).filter((v) => v > 0);
  const [factor, unit] = unitFor(unitOfBlock(block), Math.min(...errors));
  const neesKeys = unique(
    rows.flatMap((e) => Object.keys(e.values)).filter((key) => /^nees\.mean:[^@]*$/.test(key)),
  );
  const columns = [
    {name: 'estimator', text: true, get: (e) => e.name, show: (e) => nameOf(e.name)},
    {name: 'kind', text: true, get: (e) => (e.smoothed ? 'smoothed' : 'online')},
    intervalColumn('rmse:' + block, {name: 'RMSE', sub: `[${unit || '1'}]`, best: 'min'}, factor),
    intervalColumn('ratio.rmse:' + block, {name: 'ratio', sub: 'to its reference'}, 1, 4),
    intervalColumn('ratio.mse_by_bound:' + block, {name: 'MSE / bound', sub: 'Cramér-Rao'}),
    ...neesKeys.map((key) =>
      intervalColumn(key, {name: 'NEES ' + key.slice(10), sub: '1 is ideal'}),
    ),
    intervalColumn('cpu_us', {name: 'CPU', sub: 'µs a frame', best: 'min'}),
  ];
  const hasContent = (column) =>
    rows.some((e) => typeof column.get(e) === 'string' || Number.isFinite(column.get(e)));
  return dataTable(columns.filter(hasContent), rows);
}
