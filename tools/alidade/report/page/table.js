// SPDX-License-Identifier: Apache-2.0
// Table whose rows are sorted by a click on a column.

/**
 * A table. columns: {name, sub, title, text, wrap, best, get(row), show(row)}.
 *
 *   get(row)   number or text that sorts the rows
 *   show(row)  content of the cell; default: the formatted number
 *   text       true: the column contains texts
 *   best       `min` or `one`: the best value of the column is bold
 */
function dataTable(columns, rows, {off, tall} = {}) {
  const body = element('tbody');
  let by = null;
  let up = true;
  const bestOf = (c) => {
    if (!c.best) return null;
    const v = rows.map(c.get).filter((x) => Number.isFinite(x) && x !== 0);
    return v.length > 1
      ? Math.min(...v.map((x) => (c.best === 'one' ? Math.abs(Math.log(x)) : x)))
      : null;
  };
  const bests = columns.map(bestOf);
  const heads = columns.map((c, i) =>
    element(
      'th',
      {
        class: c.text ? 'text' : '',
        'aria-sort': 'none',
        title: c.title,
        tabindex: 0,
        onclick: () => sort(i),
        onkeydown: (e) => {
          if (e.key === 'Enter') sort(i);
        },
      },
      c.name,
      c.sub ? element('small', {}, c.sub) : null,
    ),
  );
  function fill() {
    const sorted =
      by === null
        ? rows
        : rows.slice().sort((a, b) => {
            const x = columns[by].get(a);
            const y = columns[by].get(b);
            const d =
              typeof x === 'string'
                ? String(x).localeCompare(y)
                : (Number.isFinite(x) ? x : Infinity) - (Number.isFinite(y) ? y : Infinity);
            return up ? d : -d;
          });
    setContent(
      body,
      sorted.map((r) =>
        element(
          'tr',
          {class: off && off(r) ? 'off' : ''},
          columns.map((c, i) => {
            const v = c.get(r);
            const best =
              bests[i] !== null &&
              Number.isFinite(v) &&
              v !== 0 &&
              (c.best === 'one' ? Math.abs(Math.log(v)) : v) === bests[i];
            return element(
              'td',
              {
                class: [c.text && 'text', c.wrap && 'wrap', best && 'best']
                  .filter(Boolean)
                  .join(' '),
              },
              c.show ? c.show(r) : typeof v === 'number' ? numberText(v) : v,
            );
          }),
        ),
      ),
    );
  }
  function sort(i) {
    up = by === i ? !up : true;
    by = i;
    heads.forEach((t, k) =>
      t.setAttribute('aria-sort', k === i ? (up ? 'ascending' : 'descending') : 'none'),
    );
    fill();
  }
  fill();
  const el = element(
    'div',
    {class: 'scroll' + (tall ? ' tall' : '')},
    element('table', {}, element('thead', {}, element('tr', {}, heads)), body),
  );
  el.refill = fill;
  el.copy = (latex) => {
    const cell = (x) =>
      x instanceof Node
        ? x.textContent
        : String(x === null || x === undefined ? '' : typeof x === 'number' ? numberText(x) : x);
    const line = (r) => columns.map((c) => cell(c.show ? c.show(r) : c.get(r)));
    const head = columns.map((c) => c.name + (c.sub ? ' ' + c.sub : ''));
    const all = rows.map(line);
    return latex
      ? `\\begin{tabular}{l${'r'.repeat(head.length - 1)}}\n${[head, ...all]
          .map(
            (r) =>
              r
                .map((x) =>
                  x
                    .replace(/[_%&#]/g, '\\$&')
                    .replace(/−/g, '$-$')
                    .replace(/[▲▼✓✕]/g, ''),
                )
                .join(' & ') + ' \\\\',
          )
          .join('\n')}\n\\end{tabular}\n`
      : [head, head.map(() => '---'), ...all].map((row) => `| ${row.join(' | ')} |\n`).join('');
  };
  return el;
}

const note = (owner, value, low, high, title) =>
  value === undefined || value === null
    ? element('span', {class: 'calm'}, '–')
    : element(
        'span',
        {
          class:
            value === 0 || low === undefined || low === null
              ? ''
              : value > high || value < low
                ? 'warn'
                : '',
          title:
            low === undefined || low === null
              ? title
              : `95 % bounds ${numberText(low)} to ${numberText(high)}`,
        },
        numberText(value),
        low !== null && low !== undefined && value > high
          ? element('span', {class: 'tag'}, '▲')
          : low !== null && low !== undefined && value < low && value !== 0
            ? element('span', {class: 'tag'}, '▼')
            : null,
      );
