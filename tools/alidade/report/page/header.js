// SPDX-License-Identifier: Apache-2.0
// Header with facts and legend.

function legend() {
  const keys = NAMES.map((name, i) => {
    const e = RUN && RUN.estimators[i];
    const v = e && e.verdict && verdictOf(e);
    return element(
      'button',
      {
        class: 'key',
        'aria-pressed': 'true',
        title:
          (v ? `${v.state}: ${v.because}\n` : '') +
          `click: hide or show (${i + 1}); double-click: this one alone`,
        onclick: (e) => {
          if (e.altKey) toggle(name, true);
          else toggle(name);
        },
        ondblclick: () => setHidden(NAMES.filter((n) => n !== name)),
        onmouseenter: () => {
          page.focus = name;
          redraw();
        },
        onmouseleave: () => {
          page.focus = null;
          redraw();
        },
      },
      element(
        'svg',
        {width: 20, height: 10, 'aria-hidden': 'true'},
        element('path', {
          d: 'M0 5h20',
          'stroke-width': 3,
          fill: 'none',
          'stroke-dasharray': dashOf(name).join(' '),
        }),
      ),
      element('span', {class: 'name'}, name),
      v && element('span', {class: 'mark ' + v.cls, 'aria-label': v.state}, v.mark),
    );
  });
  page.listeners.push(() =>
    keys.forEach((b, i) => {
      b.setAttribute('aria-pressed', String(!page.hidden.has(NAMES[i])));
      b.querySelector('path').setAttribute('stroke', colorOf(NAMES[i]));
    }),
  );
  return element('div', {class: 'legend', role: 'group', 'aria-label': 'estimators'}, keys);
}

function headerOf() {
  const facts = [];
  const fact = (n, v) =>
    v !== null &&
    v !== undefined &&
    v !== '' &&
    facts.push(element('li', {}, element('b', {}, v), ' ' + n));
  fact(NAMES.length === 1 ? 'estimator' : 'estimators', NAMES.length);
  if (RUN) {
    const t = columnOf(RUN.t);
    const dt = quantiles(
      Array.from(t)
        .slice(1, 2001)
        .map((v, i) => v - t[i]),
      [0.5],
    )[0];
    fact('frames', count(t.length));
    fact('s of data', numberText(page.full[1] - page.full[0]));
    if (dt > 0) fact('Hz', numberText(1 / dt));
  }
  if (SWEEP) fact('runs' + (SWEEP.vary ? ' of each value' : ''), SWEEP.runs);
  if (DATA.seed !== null && DATA.seed !== undefined)
    facts.push(element('li', {}, 'seed ', element('b', {}, DATA.seed)));
  if (DATA.reference)
    facts.push(element('li', {}, 'errors against ', element('b', {}, DATA.reference)));
  if (DATA.hash) facts.push(element('li', {}, 'data ', element('code', {}, DATA.hash)));
  if (DATA.program) facts.push(element('li', {}, 'alidade ' + DATA.program));
  const theme = element(
    'button',
    {
      class: 'btn',
      'aria-label': 'light or dark',
      title: 'light or dark',
      onclick: () => setTheme(!page.dark),
    },
    '◐',
  );
  return element(
    'header',
    {},
    element(
      'div',
      {class: 'headline'},
      element('h1', {}, DATA.title),
      element(
        'div',
        {class: 'tools'},
        theme,
        element('button', {class: 'btn', onclick: () => print()}, 'print'),
      ),
    ),
    element('ul', {class: 'facts'}, facts),
    DATA.command &&
      element(
        'span',
        {class: 'cmd'},
        DATA.command,
        copyButton(() => DATA.command),
      ),
  );
}
