// SPDX-License-Identifier: Apache-2.0
// Figure "Two metrics" of the runs of a sweep.

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
        label: metricName(second),
        name: 'two metrics',
        height: 260,
        x: {
          label: metricName(metric),
          unit: metricUnit(metric),
          log: isLogMetric(metric, all(metric)),
        },
        y: {unit: metricUnit(second), log: isLogMetric(second, all(second))},
        layers: () =>
          visibleGroups(groups)
            .filter((group) => valuesOf(group, second).length)
            .map(dots),
      }),
    ],
  };
}
