// SPDX-License-Identifier: Apache-2.0
// Table of the estimators, and all metrics.

function runTable() {
  const es = RUN.estimators;
  const blocks = [];
  for (const e of es)
    for (const b of e.blocks)
      if (e.metrics['rmse:' + b.name] !== undefined && !blocks.some((q) => q.name === b.name))
        blocks.push({name: b.name, unit: b.error_unit});
  const cols = [
    {name: 'estimator', text: true, get: (e) => e.name, show: (e) => nameOf(e.name)},
    {
      name: 'verdict',
      text: true,
      get: (e) => verdictOf(e).state,
      show: (e) => {
        const {cls, mark, state, because} = verdictOf(e);
        return element('span', {class: cls, title: because}, `${mark} ${state}`);
      },
    },
  ];
  for (const b of blocks) {
    const v = es.map((e) => e.metrics['rmse:' + b.name]).filter((x) => x > 0);
    const [f, u] = unitFor(b.unit, v.length ? Math.min(...v) : 1);
    cols.push({
      name: b.name.split('.').pop().replace(/_/g, ' '),
      sub: `RMSE${u ? ` [${u}]` : ''}`,
      title: b.name,
      best: 'min',
      get: (e) =>
        ((x) => (x === undefined || x === null ? NaN : x * f))(e.metrics['rmse:' + b.name]),
    });
  }
  for (const kind of ['nees', 'nis'])
    for (const s of unique(
      es.flatMap((e) =>
        Object.keys(e.metrics)
          .filter((k) => k.startsWith(kind + '.mean:') && !k.includes('@'))
          .map((k) => k.slice(kind.length + 6)),
      ),
    ))
      cols.push({
        name: kind.toUpperCase() + ' ' + s,
        sub: '1 is ideal',
        title:
          kind === 'nees'
            ? 'mean squared error by its covariance'
            : 'mean squared innovation by its covariance',
        get: (e) => e.metrics[`${kind}.mean:${s}`],
        show: (e) =>
          note(
            s,
            e.metrics[`${kind}.mean:${s}`],
            e.metrics[`${kind}.low:${s}`],
            e.metrics[`${kind}.high:${s}`],
          ),
      });
  cols.splice(2, 0, {
    name: 'used / given',
    sub: 'measurements',
    get: (e) =>
      sum(
        Object.entries(e.counts)
          .filter(([k]) => /^accepted:/.test(k))
          .map((q) => q[1]),
      ),
    show: (e) => {
      const c = (re) =>
        sum(
          Object.entries(e.counts)
            .filter(([k]) => re.test(k))
            .map((q) => q[1]),
        );
      const a = c(/^accepted:/);
      const n = a + sum(e.sensors.map((sensor) => rejectedCount(e, sensor)));
      return element('span', {class: a < 0.9 * n ? 'warn' : ''}, `${count(a)} / ${count(n)}`);
    },
  });
  const t = dataTable(cols, es, {off: (e) => page.hidden.has(e.name)});
  page.listeners.push(() => t.refill());
  return t;
}

function metricFold(parent) {
  fold(parent, 'All metrics', 'every number of run.json', (box) => {
    const keys = unique(RUN.estimators.flatMap((e) => Object.keys(e.metrics)));
    const cs = unique(RUN.estimators.flatMap((e) => Object.keys(e.counts)));
    const holder = element('div');
    const rows = [
      ...keys.map((k) => ({k, of: (e) => e.metrics[k]})),
      ...cs.map((k) => ({k, of: (e) => e.counts[k]})),
    ];
    const cell = (v) =>
      typeof v === 'boolean'
        ? v
          ? 'yes'
          : 'no'
        : v === undefined
          ? '–'
          : v === null
            ? '∞'
            : numberText(v, 4);
    const show = (q) =>
      setContent(
        holder,
        dataTable(
          [
            {name: 'metric', text: true, get: (r) => r.k},
            ...RUN.estimators.map((e) => ({
              name: e.name,
              get: (r) => (r.of(e) === undefined ? NaN : Number(r.of(e))),
              show: (r) => cell(r.of(e)),
            })),
          ],
          rows.filter((r) => r.k.includes(q)),
          {tall: true},
        ),
      );
    box.append(
      element(
        'div',
        {class: 'panel'},
        element('input', {
          class: 'search',
          placeholder: 'filter, e.g. nees or @blind',
          'aria-label': 'filter metrics',
          oninput: (e) => show(e.target.value),
        }),
        element('p', {class: 'quiet', style: 'margin:4px 0 8px'}, 'SI units, as in run.json.'),
        holder,
      ),
    );
    show('');
  });
}

/** The table with its legend and buttons. */
function runTablePanel() {
  const table = runTable();
  const legend = 'Bold: best of its column. ▲ above, ▼ below its 95 % bounds.';
  return element(
    'div',
    {class: 'panel'},
    table,
    element(
      'p',
      {class: 'side', style: 'margin:8px 0 0'},
      element('span', {class: 'quiet'}, legend),
      copyButton(() => table.copy(false), 'copy as Markdown'),
      copyButton(() => table.copy(true), 'copy as LaTeX'),
    ),
  );
}
