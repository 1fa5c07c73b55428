// SPDX-License-Identifier: Apache-2.0
// Figure "Every seed" of a sweep.

/** What a dot of a run shows. */
const runTip = (group, metric) => (i) => {
  const seed = group.seeds[i];
  return [
    element('b', {}, `seed ${seed}`),
    nameOf(group.estimator),
    ` ${metricName(metric)} ${withUnit(valuesOf(group, metric)[i], metricUnit(metric))}`,
    element('br'),
    element('code', {}, seedCommand(group, seed)),
  ];
};

/** A number from -0.28 to 0.28 that depends on the seed only. */
const jitterOf = (seed) => (((seed * 2654435761) % 4294967296) / 4294967296 - 0.5) * 0.55;

const visibleGroups = (groups) => groups.filter(({estimator}) => shown(estimator));

/** Every run as a dot, with the worst runs, the mean and the bounds of the mean. */
function seedFigure(groups, metric) {
  const rows = groups.map(({estimator}) => estimator).reverse();
  const rowOf = ({estimator}) => rows.indexOf(estimator);
  const figureOf = {groups, metric, rowOf};
  const hasBounds = groups.some(({bounds}) => bounds[metric]);
  const log = isLogMetric(metric, groups.flatMap((group) => finiteValues(group, metric)));
  const plot = new Plot({
    label: metricName(metric),
    name: 'seeds',
    height: rows.length * 54 + 56,
    left: innerWidth < 520 ? 104 : 168,
    x: {label: metricName(metric), unit: metricUnit(metric), log},
    y: {unit: '', rows, range: () => [-0.6, rows.length - 0.4]},
    layers: () => [
      {kind: 'custom', x: null, paint: boundsPainter(figureOf)},
      ...visibleGroups(groups).map((group) => seedDots(group, metric, rowOf(group))),
      {kind: 'custom', x: null, paint: markPainter(figureOf)},
    ],
  });
  const hint =
    'A dot is a run. The five worst runs of each estimator are ringed; the tip of a dot ' +
    'contains the command that repeats its run. The diamond is the mean' +
    (hasBounds ? ', the green zone its 95 % bounds.' : '.');
  return {title: 'Every seed', hint, plots: [plot]};
}

const seedDots = (group, metric, row) => ({
  kind: 'dots',
  x: valuesOf(group, metric),
  y: group.seeds.map((seed) => row + jitterOf(seed)),
  est: group.estimator,
  name: group.estimator,
  size: 2.8,
  alpha: 0.6,
  tip: runTip(group, metric),
});

const boundsPainter =
  ({groups, metric, rowOf}) =>
  (surface, X, Y) => {
    for (const group of visibleGroups(groups)) {
      const bounds = group.bounds[metric];
      if (!bounds) continue;
      const [left, right] = bounds.map((v) => X.to(v));
      const style = {fill: GOOD_ZONE.color(), alpha: 0.16};
      surface.rect(left, Y.to(rowOf(group)) - 20, right - left, 40, style);
    }
  };

/** Paints a ring around each of the worst runs, and the mean as a diamond. */
const markPainter =
  ({groups, metric, rowOf}) =>
  (surface, X, Y) => {
    for (const group of visibleGroups(groups)) {
      const values = valuesOf(group, metric);
      const {seeds} = group;
      const worst = worstRuns(group, metric).flatMap((i) => [
        X.to(values[i]),
        Y.to(rowOf(group) + jitterOf(seeds[i])),
      ]);
      surface.marks(worst, 'dot', 5, {stroke: REJECTED(), width: 1.4});
      const style = {fill: colours.panel, stroke: colours.ink, width: 1.8};
      const mean = X.to(meanOf(finiteValues(group, metric)));
      surface.marks([mean, Y.to(rowOf(group))], 'diamond', 6.5, style);
    }
  };
