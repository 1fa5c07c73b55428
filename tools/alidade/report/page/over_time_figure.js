// SPDX-License-Identifier: Apache-2.0
// Figure of errors and mean NEES over time, across the runs.

/** A column of over_time.csv of an estimator, or null. */
const overTimeColumn = (e, name) => {
  const ref = COMPARISON.over_time.columns[`${e.name}.${name}`];
  return ref === undefined ? null : columnOf(ref);
};

/** A line for each estimator that has the column. */
const overTimeLines = (x, name) =>
  COMPARISON.estimators
    .map((e) => ({e, y: overTimeColumn(e, name)}))
    .filter(({y}) => y)
    .map(({e, y}) => ({kind: 'line', ...knownPart(x, y), est: e.name, name: e.name}));

function errorOverTime(block, x) {
  const bands = COMPARISON.estimators
    .filter((e) => overTimeColumn(e, 'p16:' + block))
    .map((e) => {
      const lo = overTimeColumn(e, 'p16:' + block);
      const hi = overTimeColumn(e, 'p84:' + block);
      return {kind: 'band', x, lo, hi, est: e.name, fill: 0.1};
    });
  const bounds = COMPARISON.estimators.map((e) => overTimeColumn(e, 'bound:' + block));
  const y = bounds.find(Boolean);
  const bound = y && {kind: 'line', ...knownPart(x, y), color: ink, dash: [6, 4], name: 'Cramér-Rao bound'};
  return new Plot({
    label: `RMS error of ${block}`,
    time: true,
    last: false,
    first: true,
    height: 190,
    y: {unit: unitOfBlock(block), log: true},
    layers: () => [...bands, ...overTimeLines(x, 'rms:' + block), bound],
  });
}

/** The mean NEES of the owner of a block; null if no NEES is known. */
function neesOverTime(block, x) {
  const names = Object.keys(COMPARISON.over_time.columns);
  const owners = unique(names.map((name) => (name.match(/\.anees:(.*)$/) || [])[1]));
  const known = owners.filter(Boolean);
  const owner = known.find((name) => block.startsWith(name + '.')) || known[0];
  const tested = COMPARISON.estimators.find((e) => overTimeColumn(e, 'anees.low:' + owner));
  if (!tested) return null;
  const zone = {
    kind: 'band',
    x,
    lo: overTimeColumn(tested, 'anees.low:' + owner),
    hi: overTimeColumn(tested, 'anees.high:' + owner),
    color: GOOD_ZONE.color,
    fill: 0.15,
  };
  return new Plot({
    label: `mean NEES of ${owner}`,
    time: true,
    height: 160,
    y: {unit: '', log: true},
    layers: () => [zone, ...overTimeLines(x, 'anees:' + owner)],
  });
}

function overTimeFigure(block) {
  const data = COMPARISON.over_time;
  const hasErrors = (e) => data.columns[`${e.name}.rms:${block}`] !== undefined;
  if (!data || !COMPARISON.estimators.some(hasErrors)) return null;
  const x = columnOf(data.t);
  return {
    title: 'Over time, across the runs',
    hint:
      'RMS error of each estimator. The band contains the middle 68 % of the runs. Dashed: the ' +
      'Cramér-Rao bound, the least error of an unbiased filter. Below: the mean NEES, which is ' +
      'in the green zone if the filter is consistent.',
    plots: [errorOverTime(block, x), neesOverTime(block, x)].filter(Boolean),
  };
}
