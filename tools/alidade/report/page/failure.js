// SPDX-License-Identifier: Apache-2.0
// Section "Failure": the error with its line of the file, likely causes, and the last frames.

/** Likely causes: a pattern of the reason, and a hint. */
const CAUSES = [
  [
    /is not a number/,
    'A typing error, a decimal comma, or a text in a column of numbers. ' +
      'An empty cell means "no value" and is allowed.',
  ],
  [/column/, 'The number of columns differs, or the header and the config name other columns.'],
  [
    /timestamp|older|order/i,
    'Times that decrease, or times in another unit: see out_of_sequence in the config.',
  ],
  [/not_finite|\bnan\b|\binf/i, 'A value was not finite: see the last innovations below, or list the text of such cells ' +
      'in source.missing.'],
  [
    /diverg/i,
    'The estimate left the domain of its models: check the units, the prior and the gate, ' +
      'and see the last innovations below.',
  ],
];

/** The quoted lines of the file, with a caret below the column of the error. */
function quotedLines({line, column, lines}) {
  const numbered = ([number, text]) => `${String(number).padStart(5)}  ${text}\n`;
  return element(
    'pre',
    {},
    lines.map((entry) => {
      if (entry[0] !== line) return numbered(entry);
      const caret = ' '.repeat(6 + column) + '^\n';
      const mark = column ? element('span', {class: 'caret'}, caret) : null;
      return element('span', {class: 'hit'}, numbered(entry), mark);
    }),
  );
}

function commandLine(label, command) {
  const button = copyButton(() => command);
  return element(
    'p',
    {class: 'side'},
    element('span', {class: 'quiet'}, label),
    element('span', {class: 'cmd'}, command, button),
  );
}

function failureSection(main) {
  const failure = DATA.failure;
  const subject = SWEEP ? 'The sweep' : 'The run';
  const title = DATA.status === 'stopped' ? `${subject} was stopped` : `${subject} failed`;
  const box = element('section', {class: 'panel failure', id: 'failure'});
  box.append(element('h2', {}, title));
  if (failure) {
    const column = failure.column ? `, column ${failure.column}` : '';
    const place = element('b', {}, `${failure.file}, line ${failure.line}${column}: `);
    box.append(element('p', {}, place, failure.text));
    if (failure.lines.length) box.append(quotedLines(failure));
  } else {
    const text = 'A signal stopped the command. The page shows the results so far.';
    box.append(element('p', {}, DATA.reason || text));
  }
  const hints = CAUSES.filter(([pattern]) => pattern.test(DATA.reason)).map((cause) => cause[1]);
  if (hints.length) box.append(element('p', {}, element('b', {}, 'Likely: '), hints.join(' ')));
  if (SWEEP && !COMPARISON && DATA.command)
    box.append(commandLine('Continue:', `${DATA.command} -o FOLDER --resume`));
  else if (DATA.command) box.append(commandLine('Repeat:', DATA.command));
  main.append(box);
  nav.push(['failure', 'Failure']);
  if (RUN) lastFramesSection(main);
}

/** The elements at the end of an estimator: {e, name, value, sigma, unit}. */
const finalElements = (e) =>
  e.blocks.flatMap((block) =>
    elementsOf(e, block).values.map(({label, unit, y, sigma}) => ({
      e,
      name: `${block.name} ${label}`.trim(),
      unit,
      value: y[y.length - 1],
      sigma: sigma ? sigma[sigma.length - 1] : NaN,
    })),
  );

/** The state at the end of each estimator. */
function finalStateTable() {
  const columns = [
    {name: 'estimator', text: true, get: (row) => row.e.name, show: (row) => nameOf(row.e.name)},
    {name: 'state at the end', text: true, get: (row) => row.name},
    {name: 'value', get: (row) => row.value, show: (row) => withUnit(row.value, row.unit, 4)},
    {name: '3σ', get: (row) => row.sigma, show: (row) => withUnit(3 * row.sigma, row.unit, 2)},
  ];
  const options = {tall: true, off: (row) => page.hidden.has(row.e.name)};
  return dataTable(columns, RUN.estimators.flatMap(finalElements), options);
}

/** Measurements of all estimators from time `from` on, newest first. */
function measurementsAfter(from) {
  const rows = [];
  for (const e of RUN.estimators)
    for (const I of e.innovations) {
      const times = columnOf(I.t);
      const outcomes = columnOf(I.outcome);
      for (let i = lower(times, from); i < times.length; i++)
        rows.push({e, I, i, t: times[i], outcome: outcomes[i], nis: nisOf(I)[i]});
    }
  return rows.sort((a, b) => b.t - a.t);
}

/** Column of a table that shows the elements `refs(row)` of a measurement. */
const elementsColumn = (name, refs) => ({
  name,
  get: (row) => (refs(row) ? columnOf(refs(row)[0])[row.i] : NaN),
  show: (row) =>
    refs(row)
      ? refs(row)
          .map((ref) => numberText(columnOf(ref)[row.i], 5))
          .join(', ')
      : '–',
});

function lastFramesSection(main) {
  const times = columnOf(RUN.t);
  const from = times[Math.max(0, times.length - 21)];
  const sigmas = ({I, i}) =>
    I.s ? I.r.map((ref, k) => columnOf(ref)[i] / columnOf(I.s[k])[i]) : [NaN];
  const columns = [
    {name: 'time', get: (row) => row.t, show: (row) => timeLink(row.t)},
    {name: 'estimator', text: true, get: (row) => row.e.name, show: (row) => nameOf(row.e.name)},
    {name: 'sensor', text: true, get: (row) => row.I.sensor},
    elementsColumn('measured', (row) => row.I.z),
    elementsColumn('predicted', (row) => row.I.h),
    {
      name: 'innovation',
      sub: 'in σ',
      get: (row) => Math.abs(sigmas(row)[0]),
      show: (row) =>
        sigmas(row)
          .map((v) => numberText(v, 2))
          .join(', '),
    },
    {name: 'NIS', get: (row) => row.nis},
    {
      name: 'outcome',
      text: true,
      get: (row) => RUN.outcomes[row.outcome].name,
      show: (row) => {
        const {name} = RUN.outcomes[row.outcome];
        return element('span', {class: isRejected(row.outcome) ? 'bad' : ''}, name);
      },
    },
  ];
  const box = section('last', 'The last frames', 'newest first', main);
  const options = {tall: true, off: (row) => page.hidden.has(row.e.name)};
  const table = dataTable(columns, measurementsAfter(from), options);
  for (const content of [finalStateTable(), table])
    box.append(element('div', {class: 'panel'}, content));
}
