// SPDX-License-Identifier: Apache-2.0
// Table of the worst runs of a sweep.

function worstRunTable(groups, metric) {
  const rows = groups.flatMap((group) =>
    worstRuns(group, metric).map((i, k) => {
      const seed = group.seeds[i];
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
    {name: 'seed', get: (r) => Number(r.seed), show: (r) => r.seed},
    {
      name: metricName(metric),
      get: (r) => r.value,
      show: (r) => withUnit(r.value, metricUnit(metric)),
    },
    {name: 'command', text: true, get: (r) => Number(r.seed), show: commandCell},
  ];
  return element(
    'figure',
    {class: 'panel'},
    element('header', {}, element('h3', {}, 'Worst runs, and how to repeat them')),
    dataTable(columns, rows, {tall: true, off: (r) => page.hidden.has(r.group.estimator)}),
  );
}
