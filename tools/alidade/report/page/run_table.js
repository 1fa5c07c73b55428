// SPDX-License-Identifier: Apache-2.0
// Table of the estimators of a run, and all metrics.

/** Sum of the counts whose key has this name. */
const countOf = (e, name) =>
  sum(Object.entries(e.counts).map(([key, n]) => (key.startsWith(name + ':') ? n : 0)));

const usedColumn = () => {
  const usedOf = (e) => sum(e.sensors.map((sensor) => usedCount(e, sensor)));
  const totalOf = (e) => sum(e.sensors.map((sensor) => givenCount(e, sensor)));
  return {
    name: 'used / given',
    sub: 'measurements',
    get: usedOf,
    show: (e) => {
      const used = usedOf(e);
      const total = totalOf(e);
      const cls = used < 0.9 * total ? 'warn' : '';
      return element('span', {class: cls}, `${count(used)} / ${count(total)}`);
    },
  };
};

const verdictColumn = () => ({
  name: 'verdict',
  text: true,
  get: (e) => verdictOf(e).state,
  show: (e) => {
    const {cls, mark, state, because} = verdictOf(e);
    return element('span', {class: cls, title: because}, `${mark} ${state}`);
  },
});

/** A column for the RMSE of each block. */
function errorColumns() {
  const units = new Map();
  for (const {blocks, metrics} of RUN.estimators)
    for (const {name, error_unit: unit} of blocks)
      if (metrics['rmse:' + name] !== undefined && !units.has(name)) units.set(name, unit);
  return [...units].map(([block, unit]) => {
    const errorOf = (e) => e.metrics['rmse:' + block] ?? NaN;
    const positive = RUN.estimators.map(errorOf).filter((v) => v > 0);
    const [factor, label] = unitFor(unit, positive.length ? Math.min(...positive) : 1);
    return {
      name: shortName(block),
      sub: `RMSE${label ? ` [${label}]` : ''}`,
      title: block,
      best: 'min',
      get: (e) => errorOf(e) * factor,
    };
  });
}

const RATIO_TITLES = {
  nees: 'mean squared error, divided by its covariance',
  nis: 'mean squared innovation, divided by its covariance',
};

/** A column for the mean NEES of each owner, or the mean NIS of each sensor. */
function ratioColumns(kind) {
  const prefix = `${kind}.mean:`;
  const keys = unique(RUN.estimators.flatMap((e) => Object.keys(e.metrics)));
  const subjects = keys
    .filter((key) => key.startsWith(prefix) && !key.includes('@'))
    .map((key) => key.slice(prefix.length));
  return subjects.map((subject) => ({
    name: `${kind.toUpperCase()} ${subject}`,
    sub: '1 is ideal',
    title: RATIO_TITLES[kind],
    get: (e) => e.metrics[prefix + subject],
    show: (e) => {
      const bounds = ['low', 'high'].map((end) => e.metrics[`${kind}.${end}:${subject}`]);
      const marks = RATIO_MARKS[verdictOf(e).state] ?? '▲▼';
      return boundedNumber(e.metrics[prefix + subject], marks, ...bounds);
    },
  }));
}

/** The marks that agree with a verdict; those of all other verdicts are both. */
const RATIO_MARKS = {overconfident: '▲', underconfident: '▼', consistent: '', 'not tested': ''};

/** A number with ▲ or ▼ if it is above or below its 95 % bounds and `marks` contains the mark. An
 * exact zero is not marked. */
function boundedNumber(value, marks, low = null, high = null) {
  if (value === undefined || value === null) return element('span', {class: 'calm'}, '–');
  if (low === null || high === null) return element('span', {}, numberText(value));
  const outside = value > high ? '▲' : value < low && value !== 0 ? '▼' : '';
  const mark = marks.includes(outside) ? outside : '';
  const title = `95 % bounds ${numberText(low)} to ${numberText(high)}`;
  const tag = mark && element('span', {class: 'tag'}, mark);
  return element('span', {class: mark ? 'warn' : '', title}, numberText(value), tag);
}

function runTable() {
  const columns = [
    {name: 'estimator', text: true, get: (e) => e.name, show: (e) => nameOf(e.name)},
    verdictColumn(),
    usedColumn(),
    ...errorColumns(),
    ...ratioColumns('nees'),
    ...ratioColumns('nis'),
  ];
  const table = new Table(columns, RUN.estimators, {off: (e) => page.hidden.has(e.name)});
  page.listeners.push(() => table.fill());
  return table;
}

/** The text of a metric or a count of run.json. */
function metricText(value) {
  if (typeof value === 'boolean') return value ? 'yes' : 'no';
  if (value === undefined) return '–';
  return value === null ? '∞' : numberText(value, 4);
}

/** All metrics and counts whose key contains `filter`. */
function metricTable(filter) {
  const keysOf = (get) => unique(RUN.estimators.flatMap((e) => Object.keys(get(e))));
  const rowsOf = (get) => keysOf(get).map((key) => ({key, valueOf: (e) => get(e)[key]}));
  const rows = [...rowsOf((e) => e.metrics), ...rowsOf((e) => e.counts)];
  const columns = RUN.estimators.map((e) => ({
    name: e.name,
    get: (row) => Number(row.valueOf(e) ?? NaN),
    show: (row) => metricText(row.valueOf(e)),
  }));
  return dataTable(
    [{name: 'metric', text: true, get: (row) => row.key}, ...columns],
    rows.filter(({key}) => key.includes(filter)),
    {tall: true},
  );
}

function metricFold(parent) {
  fold(parent, 'All metrics', 'every number of run.json', (box) => {
    const holder = element('div');
    const show = (filter) => setContent(holder, metricTable(filter));
    const input = element('input', {
      class: 'search',
      placeholder: 'filter, e.g. nees or @blind',
      'aria-label': 'filter metrics',
      oninput: (event) => show(event.target.value),
    });
    const text = element('p', {class: 'quiet'}, 'SI units, as in run.json.');
    box.append(element('div', {class: 'panel'}, input, text, holder));
    show('');
  });
}

/** The table with its legend and buttons. */
function runTablePanel() {
  const table = runTable();
  const legend = 'Bold: best of its column. ▲ above, ▼ below its 95 % bounds, as the verdict says.';
  const buttons = [
    copyButton(() => markdownText(table), 'copy as Markdown'),
    copyButton(() => latexText(table), 'copy as LaTeX'),
  ];
  const foot = element('p', {class: 'side'}, element('span', {class: 'quiet'}, legend), buttons);
  return element('div', {class: 'panel'}, table.el, foot);
}
