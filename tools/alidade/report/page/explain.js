// SPDX-License-Identifier: Apache-2.0
// Explanation of a config: drawing, tables and keys.

const panelOf = (title, content) =>
  element('div', {class: 'panel'}, element('h3', {}, title), content);

/** The table of rows of texts, of which the first contains the names of the columns. */
const textTable = ([names, ...rows]) =>
  dataTable(
    names.map((name, i) => ({
      name,
      text: true,
      wrap: i === names.length - 1,
      get: (row) => row[i] ?? '',
    })),
    rows,
  );

function explainedTable({title, rows, notes}) {
  const header = title === 'landmarks' ? [['key', 'value']] : [];
  const lines = notes.map((note) => element('p', {class: 'quiet'}, note));
  return panelOf(title, [textTable([...header, ...rows]), lines]);
}

/** Options of the estimators, with a column for each. */
function optionTable(estimators) {
  const keys = unique(estimators.flatMap(({options}) => options.map(([key]) => key)));
  const valueOf = ({options}, key) => (options.find(([name]) => name === key) || ['', '–'])[1];
  const names = estimators.map(({name, type}) => `${name} (${type})`);
  const rows = keys.map((key) => [key, ...estimators.map((e) => valueOf(e, key))]);
  return panelOf('options', textTable([['option', ...names], ...rows]));
}

function drawingPanel(problem) {
  const hint =
    'Sensors: measurement noise. Motion models: process noise of a step of ' +
    `${numberText(DATA.explain.step_s)} s. Dashed: considered; dotted: known.`;
  const drawing = element('div', {class: 'scroll'}, modelDrawing(problem, DATA.explain.streams));
  return panelOf('streams, sensors, blocks and motion models', [
    element('p', {class: 'hint'}, hint),
    drawing,
  ]);
}

function observabilityPanel({observability}) {
  const items = observability.map((text) => {
    const isWarning = text.startsWith('unobservable');
    return {cls: isWarning ? 'warn' : 'calm', mark: isWarning ? '▲' : '·', text};
  });
  return panelOf('observability', storyList(items));
}

function problemSection(problem, i, main) {
  const names = problem.estimators.map(({name}) => name);
  const box = section(`model${i}`, `Model of ${list(names)}`, '', main);
  box.append(drawingPanel(problem), observabilityPanel(problem));
  const build = (parent) =>
    parent.append(...problem.tables.map(explainedTable), optionTable(problem.estimators));
  if (i === 0) build(box);
  else fold(box, 'Tables', 'state, motion, sensors, effects, options', build);
}

function explainSection(main) {
  DATA.explain.problems.forEach((problem, i) => problemSection(problem, i, main));
  const box = section('keys', 'Source and keys', '', main);
  const keys = textTable([['key', 'value', 'unit', 'meaning'], ...DATA.explain.keys]);
  box.append(panelOf('source', element('pre', {}, DATA.explain.source)), panelOf('keys', keys));
}
