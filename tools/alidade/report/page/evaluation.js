// SPDX-License-Identifier: Apache-2.0
// Section "Errors" of trajectories that were compared with a reference.

const KIND_NAMES = {ATE: 'Absolute error', RPE: 'Relative error'};

/** Groups of errors with the same kind and relation. */
function errorGroups() {
  const groups = new Map();
  for (const errors of DATA.evaluation.errors) {
    const key = `${errors.kind} ${errors.relation}`;
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(errors);
  }
  return [...groups.values()];
}

function statisticsTable() {
  const {errors} = DATA.evaluation;
  const statistics = ['rmse', 'mean', 'median', 'std', 'min', 'max'].map((name) => ({
    name,
    get: (row) => row.statistics[name],
    show: (row) => withUnit(row.statistics[name], row.unit, 4),
  }));
  const columns = [
    {name: 'estimate', text: true, get: (r) => r.estimator, show: (r) => nameOf(r.estimator)},
    {name: 'error', text: true, get: (r) => r.kind},
    {name: 'relation', text: true, get: (r) => r.relation},
    ...statistics,
  ];
  return dataTable(columns, errors, {off: (row) => page.hidden.has(row.estimator)});
}

function errorOverTimeFigure(group) {
  const {kind, relation, unit} = group[0];
  const lines = group.map(({estimator, t, v}) => ({
    kind: 'line',
    x: columnOf(t),
    y: columnOf(v),
    est: estimator,
    name: estimator,
  }));
  return {
    title: `${KIND_NAMES[kind]}, ${relation}`,
    hint:
      kind === 'ATE'
        ? 'Error of each pose. A slow increase is drift; a jump is a lost track or a loop closure.'
        : 'Error of the motion between the two poses of a pair, at the time of the second pose.',
    plots: [
      new Plot({
        label: relation,
        name: `${kind} ${relation}`,
        time: true,
        first: true,
        height: 200,
        zero: false,
        y: {unit},
        layers: () => lines,
      }),
    ],
  };
}

/** Share of the poses whose error is below a value. */
function errorShareFigure(group) {
  const {kind, relation, unit} = group[0];
  const layers = () =>
    group.map(({estimator, v}) => {
      const sorted = Array.from(columnOf(v)).sort((a, b) => a - b);
      const y = sorted.map((_, i) => (i + 1) / sorted.length);
      return {kind: 'line', x: sorted, y, est: estimator, name: estimator, width: 1.8};
    });
  return {
    title: `Share of ${kind} ${relation} below`,
    plots: [
      new Plot({
        label: 'share',
        name: `distribution of ${kind} ${relation}`,
        height: 220,
        x: {label: relation, unit},
        y: {unit: '', range: () => [0, 1.02]},
        layers,
      }),
    ],
  };
}

function evaluationSection(main) {
  const box = section('errors', 'Errors', `against ${DATA.reference}`, main);
  box.append(element('div', {class: 'panel'}, statisticsTable()));
  const groups = errorGroups();
  for (const group of groups) figure(box, errorOverTimeFigure(group));
  const grid = element('div', {class: 'cols'});
  box.append(grid);
  for (const group of groups) figure(grid, errorShareFigure(group));
}
