// SPDX-License-Identifier: Apache-2.0
// Figure "Histogram" or "Share of runs below" of a metric of a sweep.

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

/** Numbers of runs in bins between `low` and `high`; n runs have 2 n^(1/3) bins. */
function histogramLine(group, metric, [low, high], log) {
  const runs = finiteValues(group, metric).length;
  const size = clamp(Math.ceil(2 * Math.cbrt(runs)), 4, 40);
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
        x: {label: metricName(metric), unit: metricUnit(metric), log, range},
        y: {unit: '', range: (visible) => [0, isShare ? 1.02 : top(visible)]},
        layers,
      }),
    ],
  };
}
