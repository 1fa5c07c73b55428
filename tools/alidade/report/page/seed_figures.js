// SPDX-License-Identifier: Apache-2.0
// Figures of the runs of a sweep: each seed, the distribution, and two metrics.

/** What a dot of a run shows. */
const runTip = (group, metric) => (i) => {
  const seed = columnOf(group.seed)[i];
  return [
    element('b', {}, `seed ${seed}`),
    nameOf(group.estimator),
    ` ${metric} ${withUnit(valuesOf(group, metric)[i], metricUnit(metric))}`,
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
  const paintBounds = (surface, X, Y) => {
    for (const group of visibleGroups(groups)) {
      const bounds = group.bounds[metric];
      if (!bounds) continue;
      const [left, right] = bounds.map((v) => X.to(v));
      const style = {fill: GOOD_ZONE.color(), alpha: 0.16};
      surface.rect(left, Y.to(rowOf(group)) - 20, right - left, 40, style);
    }
  };
  const dots = (group) => ({
    kind: 'dots',
    x: valuesOf(group, metric),
    y: Array.from(columnOf(group.seed), (seed) => rowOf(group) + jitterOf(seed)),
    est: group.estimator,
    name: group.estimator,
    size: 2.8,
    alpha: 0.6,
    tip: runTip(group, metric),
  });
  const paintMarks = (surface, X, Y) => {
    for (const group of visibleGroups(groups)) {
      const values = valuesOf(group, metric);
      const seeds = columnOf(group.seed);
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
  const hasBounds = groups.some((g) => g.bounds[metric]);
  return {
    title: 'Every seed',
    hint:
      'A dot is a run. The five worst runs of each estimator are ringed; the tip of a dot ' +
      'contains the command that repeats its run. The diamond is the mean' +
      (hasBounds ? ', the green zone its 95 % bounds.' : '.'),
    plots: [
      new Plot({
        label: metric,
        name: 'seeds',
        height: rows.length * 54 + 56,
        left: innerWidth < 520 ? 104 : 168,
        x: {
          label: metric,
          unit: metricUnit(metric),
          log: isLogMetric(metric, groups.flatMap((g) => finiteValues(g, metric))),
        },
        y: {unit: '', rows, range: () => [-0.6, rows.length - 0.4]},
        layers: () => [
          {kind: 'custom', x: null, paint: paintBounds},
          ...visibleGroups(groups).map(dots),
          {kind: 'custom', x: null, paint: paintMarks},
        ],
      }),
    ],
  };
}

/** The share of runs below a value. */
function shareLine(group, metric, end) {
  const sorted = finiteValues(group, metric).sort((a, b) => a - b);
  return {
    kind: 'line',
    step: true,
    x: sorted,
    x2: sorted.slice(1).concat(end),
    y: sorted.map((_, i) => (i + 1) / sorted.length),
    est: group.estimator,
    name: group.estimator,
    width: 1.8,
  };
}

/** Numbers of runs in bins between `low` and `high`. */
function histogramLine(group, metric, [low, high], log) {
  const size = 30;
  const at = (u) => (log ? low * (high / low) ** u : low + (high - low) * u);
  const placeOf = (v) =>
    log ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low);
  const counts = new Array(size).fill(0);
  for (const v of finiteValues(group, metric))
    counts[clamp(Math.floor(size * placeOf(v)) || 0, 0, size - 1)]++;
  return {
    kind: 'line',
    step: true,
    x: counts.map((_, i) => at(i / size)),
    x2: counts.map((_, i) => at((i + 1) / size)),
    y: counts,
    est: group.estimator,
    name: group.estimator,
    width: 1.8,
  };
}

/** Histogram or ECDF of a metric. */
function distributionFigure(groups, metric, shape, controls) {
  const isShare = shape === 'ecdf';
  const values = () => visibleGroups(groups).flatMap((g) => finiteValues(g, metric));
  const log = isLogMetric(metric, groups.flatMap((g) => finiteValues(g, metric)));
  const range = () => {
    const [low, high] = quantiles(values(), [0, 1]);
    const margin = 0.03 * (high - low);
    return log ? [low / 1.05, high * 1.05] : [low - margin, high + margin];
  };
  const top = (layers) => Math.max(1, ...layers.flatMap(({y}) => Array.from(y))) * 1.08;
  const layers = () => {
    const ends = quantiles(values(), [0, 1]);
    return visibleGroups(groups).map((group) =>
      isShare ? shareLine(group, metric, ends[1]) : histogramLine(group, metric, ends, log),
    );
  };
  return {
    title: isShare ? 'Share of runs below' : 'Histogram',
    controls,
    plots: [
      new Plot({
        label: isShare ? 'share of runs' : 'runs',
        name: 'distribution',
        height: 260,
        x: {label: metric, unit: metricUnit(metric), log, range},
        y: {unit: '', range: (visible) => [0, isShare ? 1.02 : top(visible)]},
        layers,
      }),
    ],
  };
}

/** A metric against another one. */
function twoMetricFigure(groups, metric, second, controls) {
  const all = (name) => groups.flatMap((g) => finiteValues(g, name));
  const dots = (group) => ({
    kind: 'dots',
    x: valuesOf(group, metric),
    y: valuesOf(group, second),
    est: group.estimator,
    name: group.estimator,
    size: 2.8,
    alpha: 0.6,
    tip: runTip(group, metric),
  });
  return {
    title: 'Two metrics',
    controls,
    plots: [
      new Plot({
        label: second,
        name: 'two metrics',
        height: 260,
        x: {label: metric, unit: metricUnit(metric), log: isLogMetric(metric, all(metric))},
        y: {unit: metricUnit(second), log: isLogMetric(second, all(second))},
        layers: () =>
          visibleGroups(groups)
            .filter((group) => valuesOf(group, second).length)
            .map(dots),
      }),
    ],
  };
}

function worstRunTable(groups, metric) {
  const rows = groups.flatMap((group) =>
    worstRuns(group, metric).map((i, k) => {
      const seed = columnOf(group.seed)[i];
      return {group, seed, rank: k + 1, value: valuesOf(group, metric)[i]};
    }),
  );
  if (!rows.length) return null;
  const commandCell = ({group, seed}) => {
    const command = seedCommand(group, seed);
    return element('span', {class: 'cmd'}, command, copyButton(() => command));
  };
  const columns = [
    {
      name: 'estimator',
      text: true,
      get: (r) => r.group.estimator,
      show: (r) => nameOf(r.group.estimator),
    },
    {name: 'rank', get: (r) => r.rank, show: (r) => String(r.rank)},
    {name: 'seed', get: (r) => r.seed, show: (r) => String(r.seed)},
    {name: metric, get: (r) => r.value, show: (r) => withUnit(r.value, metricUnit(metric))},
    {name: 'command', text: true, get: (r) => r.seed, show: commandCell},
  ];
  return element(
    'figure',
    {class: 'panel'},
    element('header', {}, element('h3', {}, 'Worst runs, and how to repeat them')),
    dataTable(columns, rows, {tall: true, off: (r) => page.hidden.has(r.group.estimator)}),
  );
}
