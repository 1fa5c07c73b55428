// SPDX-License-Identifier: Apache-2.0
// Section "Errors" of trajectories that were compared with a reference.

/** Names of the relations, which have the names of evo in files. */
const RELATION_NAMES = {
  trans_part: 'translation',
  rot_part: 'rotation matrix',
  angle_deg: 'rotation angle',
  angle_rad: 'rotation angle',
  full: 'pose matrix',
  point_distance: 'distance of points',
};
const relationName = ({relation}) => RELATION_NAMES[relation] || relation;

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
    {
      name: 'relation',
      text: true,
      get: relationName,
      show: (r) => element('span', {title: r.relation}, relationName(r)),
    },
    ...statistics,
  ];
  return dataTable(columns, errors, {off: (row) => page.hidden.has(row.estimator)});
}

function errorOverTimeFigure(group) {
  const {kind, unit} = group[0];
  const relation = relationName(group[0]);
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
  const {kind, unit} = group[0];
  const relation = relationName(group[0]);
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

/** Quantiles 5, 25, 50, 75 and 95 % of the errors of a trajectory. */
const boxOf = once(({v}) => quantiles(columnOf(v), [0.05, 0.25, 0.5, 0.75, 0.95]));

/** The boxes of a group: a row for each trajectory. */
const boxPainter = (group, rowOf) => (surface, X, Y) => {
  for (const errors of group.filter(({estimator}) => shown(estimator))) {
    const [low, first, middle, third, high] = boxOf(errors).map((value) => X.to(value));
    const y = Y.to(rowOf(errors));
    const color = colorOf(errors.estimator);
    surface.path([low, y, first, y, NaN, NaN, third, y, high, y], {stroke: color, width: 1.5});
    for (const end of [low, high])
      surface.path([end, y - 6, end, y + 6], {stroke: color, width: 1.5});
    surface.rect(first, y - 11, third - first, 22, {fill: color, alpha: 0.25});
    surface.rect(first, y - 11, third - first, 22, {stroke: color});
    surface.path([middle, y - 11, middle, y + 11], {stroke: color, width: 2.5});
  }
};

/** Box plots of the errors of a group. */
function errorBoxFigure(group) {
  const {kind, unit} = group[0];
  const relation = relationName(group[0]);
  const rows = group.map(({estimator}) => estimator).reverse();
  const rowOf = ({estimator}) => rows.indexOf(estimator);
  const boxes = (errors) => ({
    kind: 'dots',
    x: boxOf(errors),
    y: [0, 0, 0, 0, 0].map(() => rowOf(errors)),
    est: errors.estimator,
    name: '5, 25, 50, 75, 95 %',
    size: 1,
    tip: (i) => [
      element('b', {}, nameOf(errors.estimator)),
      `${[5, 25, 50, 75, 95][i]} %: ${withUnit(boxOf(errors)[i], unit)}`,
    ],
  });
  const plot = new Plot({
    label: '',
    name: `boxes of ${kind} ${relation}`,
    height: rows.length * 40 + 56,
    left: innerWidth < 520 ? 104 : 150,
    x: {label: relation, unit},
    y: {unit: '', rows, range: () => [-0.6, rows.length - 0.4]},
    layers: () => [
      {kind: 'custom', x: null, paint: boxPainter(group, rowOf)},
      ...group.map(boxes),
    ],
  });
  const hint = 'Box: middle 50 % of the poses; line: median; whiskers: 5 and 95 %.';
  return {title: `${kind} ${relation}: spread`, hint, plots: [plot]};
}

/** Relative errors over path lengths: medians with the middle 50 %. */
function lengthFigure(key, {label, unit, factor}) {
  const layersOf = ({estimator, rows}) => {
    const x = rows.map(({length}) => length);
    const column = (i) => rows.map((row) => row[key][i] * factor);
    const tip = (i) => [
      element('b', {}, nameOf(estimator)),
      `${withUnit(x[i], 'm')}: median ${numberText(rows[i][key][2] * factor)} ${unit}, ` +
        `95 % below ${numberText(rows[i][key][4] * factor)} ${unit}, ` +
        plural(rows[i].pairs, 'pair'),
    ];
    const style = {x, est: estimator, name: estimator};
    return [
      {kind: 'band', x, lo: column(1), hi: column(3), est: estimator},
      {kind: 'line', y: column(2), ...style, width: 1.8},
      {kind: 'dots', y: column(2), ...style, size: 3, tip},
    ];
  };
  return new Plot({
    label,
    name: `${label} over path lengths`,
    height: 240,
    x: {label: 'path length', unit: 'm', log: true},
    y: {unit, log: false, range: (layers) => [0, extentOf(layers, 'y')[1]]},
    layers: () => DATA.evaluation.lengths.flatMap(layersOf),
  });
}

function lengthFigures(grid) {
  if (!DATA.evaluation.lengths.some(({rows}) => rows.length > 1)) return;
  const hint =
    'Error of the motion over a path length, as in the KITTI benchmark: median and middle 50 % ' +
    'of all pairs of poses.';
  const translation = {label: 'translation error', unit: '%', factor: 100};
  const angle = {label: 'rotation error', unit: 'deg', factor: 1};
  figure(grid, {
    title: 'Translation error over path length',
    hint,
    plots: [lengthFigure('translation', translation)],
  });
  figure(grid, {
    title: 'Rotation error over path length',
    hint,
    plots: [lengthFigure('angle', angle)],
  });
}

function evaluationSection(main) {
  const box = section('errors', 'Errors', `against ${DATA.reference}`, main);
  box.append(element('div', {class: 'panel'}, statisticsTable()));
  const groups = errorGroups();
  for (const group of groups) figure(box, errorOverTimeFigure(group));
  const grid = element('div', {class: 'cols'});
  box.append(grid);
  for (const group of groups) figure(grid, errorShareFigure(group));
  for (const group of groups) figure(grid, errorBoxFigure(group));
  lengthFigures(grid);
}
