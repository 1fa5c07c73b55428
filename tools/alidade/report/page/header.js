// SPDX-License-Identifier: Apache-2.0
// Header with facts and legend; configuration and files at the end.

function legend() {
  const keys = NAMES.map((name, i) => {
    const e = RUN && RUN.estimators[i];
    const v = e && verdictOf(e);
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
    element(
      'span',
      {class: 'cmd'},
      DATA.command,
      copyButton(() => DATA.command),
    ),
  );
}

function tailSections(main) {
  const s = section('config', 'Configuration and files', '', main);
  if (DATA.config)
    fold(
      s,
      'Resolved configuration',
      `${DATA.config.split('\n').length} lines: runs again as it is`,
      (box) =>
        box.append(
          element(
            'div',
            {class: 'panel'},
            element(
              'p',
              {class: 'side', style: 'margin:0 0 8px'},
              copyButton(() => DATA.config),
              element(
                'button',
                {
                  class: 'btn small',
                  onclick: () => save('config.resolved.yaml', 'text/yaml', DATA.config),
                },
                'save',
              ),
            ),
            element('pre', {}, DATA.config),
          ),
        ),
    );
  if (DATA.files.length)
    fold(s, 'Files of this folder', plural(DATA.files.length, 'entry', 'entries'), (box) =>
      box.append(
        element(
          'p',
          {class: 'panel'},
          DATA.files
            .filter((f) => !f.endsWith('/') && !f.startsWith('figures'))
            .map((f) => [element('a', {href: f}, f), '  ']),
        ),
      ),
    );
  fold(s, 'Words and keys', 'NEES, NIS, gate; the keyboard', (box) =>
    box.append(
      element(
        'div',
        {class: 'panel'},
        element(
          'dl',
          {},
          [
            [
              'NEES',
              "normalised estimation error squared, e' P⁻¹ e / dof: 1 in the mean if the covariance P tells the truth; needs truth.",
            ],
            [
              'NIS',
              "normalised innovation squared, r' S⁻¹ r / dof: the same for measurements; needs no truth.",
            ],
            ['gate', 'measurements beyond this NIS are rejected.'],
            [
              'overconfident',
              'NEES above its 95 % bounds: the errors are larger than σ says. Dangerous where others trust σ.',
            ],
            ['underconfident', 'NEES below its bounds: σ is larger than it need be.'],
            ['lost', 'the error was beyond 10 σ for 20 frames on end.'],
            ['RMSE', 'root of the mean squared error over the frames.'],
            [
              'full information',
              'the best that is possible online: at each frame a batch of all data up to it.',
            ],
            [
              'mouse',
              'drag: zoom in time; shift-drag: move; ctrl-wheel: zoom; double-click: all; click: keep the cursor (the map follows it).',
            ],
            [
              'keys',
              '1 to 9: estimators; on a plot: arrows move the cursor, shift-arrows the window, + and − zoom, 0 shows all.',
            ],
          ].map(([a, b]) => [element('dt', {}, a), element('dd', {}, b)]),
        ),
      ),
    ),
  );
}
