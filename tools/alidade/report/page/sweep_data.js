// SPDX-License-Identifier: Apache-2.0
// Access to the runs of a sweep.

/** The name of a metric on the page: `RMSE target.depth`, `NEES target`. */
const METRIC_NAMES = {'rmse:': 'RMSE ', 'nees.mean:': 'NEES ', 'nis.mean:': 'NIS '};
function metricName(metric) {
  const prefix = Object.keys(METRIC_NAMES).find((start) => metric.startsWith(start));
  return prefix ? METRIC_NAMES[prefix] + metric.slice(prefix.length) : metric;
}

const metricUnit = (metric) => SWEEP.units[metric] || '';

/** Distance of a value from the best value of the metric, for the rank of a run; NaN: no rank. */
function lossOf(metric, value) {
  const goal = SWEEP.goals[metric];
  if (goal === 'one') return Math.abs(Math.log(value));
  return goal === 'zero' ? value : NaN;
}

/** The values of a metric in the runs of a group; empty if the metric does not exist. */
const valuesOf = (group, metric) =>
  group.columns[metric] === undefined ? [] : columnOf(group.columns[metric]);
const finiteValues = (group, metric) => Array.from(valuesOf(group, metric)).filter(Number.isFinite);

const meanOf = (values) => sum(values) / values.length;

/** True if a logarithmic axis suits the values. */
function wantsLogAxis(values) {
  const [low, high] = quantiles(values.filter(Number.isFinite), [0.05, 0.95]);
  return !values.some((v) => v <= 0) && high / low > 8;
}

/** True if a logarithmic axis suits the values of a metric. The axis of a share is linear. */
const isLogMetric = (metric, values) => SWEEP.goals[metric] !== '0.95' && wantsLogAxis(values);

/** The values of the varied key: {value, label}. */
const variedValues = () => {
  const labels = new Map(SWEEP.groups.map((g) => [g.value, g.label]));
  return [...labels].map(([value, label]) => ({value, label}));
};

/** The command that repeats the run of a seed in a group. */
const seedCommand = (group, seed) => `${group.command} --seed ${seed}`;

/** The indices of the five worst runs of a group, the worst first. */
function worstRuns(group, metric) {
  const losses = Array.from(valuesOf(group, metric), (v, i) => [lossOf(metric, v), i]);
  return losses
    .filter(([loss]) => Number.isFinite(loss))
    .sort((a, b) => b[0] - a[0])
    .slice(0, 5)
    .map(([, i]) => i);
}
