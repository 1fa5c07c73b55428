// SPDX-License-Identifier: Apache-2.0
// Comparison of estimators on the same data.

function compareStory() {
  const out = [];
  const d = COMPARISON.decomposition;
  const v = (s, k) => s.values[k];
  const many = COMPARISON.runs > 1;
  const interval = (q) =>
    q[1] !== null && q[1] !== undefined ? ` [${numberText(q[1])}, ${numberText(q[2])}]` : '';
  for (const s of d ? d.steps : []) {
    const keys = Object.keys(s.values).filter((k) => k.startsWith('ratio.rmse:'));
    const main = keys[0];
    if (s.kind === 'rejected_measurements') {
      const r = v(s, 'rejected');
      const n = v(s, 'measurements');
      if (r)
        out.push({
          cls: r[0] ? 'warn' : 'good',
          mark: r[0] ? '⊘' : '✓',
          text: [
            r[0]
              ? `What it rejected (${numberText(r[0])} of ${numberText(n[0], 4)} measurements${many ? ', mean of the runs' : ''}) would have changed its error by ${main ? percent(Math.abs(v(s, main)[0] - 1)) : '?'}.`
              : `The gate cost nothing: all ${many ? numberText(n[0], 4) : n[0]} measurements${many ? ' (mean of the runs)' : ''} were used.`,
          ],
        });
      continue;
    }
    if (!main) continue;
    const q = v(s, main);
    const change = q[0] - 1;
    const block = main.slice(11);
    const others = keys
      .slice(1)
      .map((k) => `${k.slice(11)} ${numberText(v(s, k)[0])}${interval(v(s, k))}`)
      .join(', ');
    if (s.kind === 'linearisation')
      out.push({
        cls: Math.abs(change) < 0.02 ? 'good' : 'warn',
        mark: Math.abs(change) < 0.02 ? '✓' : '▲',
        text: [
          nameOf(s.from),
          q[3] || Math.abs(change) < 0.0005
            ? ' is as good as'
            : change < 0.02
              ? ` is within ${percent(Math.abs(change))} of`
              : ` has ${percent(change)} more error than`,
          ' full information in ' +
            block +
            ': linearising once costs ' +
            (Math.abs(change) < 0.02 ? 'nothing that matters.' : 'that much.'),
        ],
        more: `ratio ${numberText(q[0], 4)}${interval(q)}; ${others}`,
      });
    else if (s.kind === 'smoothing')
      out.push({
        cls: 'calm',
        mark: '⇆',
        text: [
          `Later data would divide its error in ${block} by ${numberText(q[0])}: `,
          nameOf(s.to),
          ' is what a smoother reaches.',
        ],
        more: [interval(q).trim(), others].filter(Boolean).join('; '),
      });
    else
      out.push({
        cls: 'calm',
        mark: '·',
        text: [
          `${s.kind.replace(/_/g, ' ')}, `,
          nameOf(s.from),
          ' against ',
          nameOf(s.to),
          `: error ratio ${numberText(q[0])} in ${block}.`,
        ],
        more: others,
      });
  }
  const online = COMPARISON.estimators
    .filter((e) => !e.smoothed && e.values['rmse:' + compareBlocks()[0]] && !e.diverged)
    .sort(
      (a, b) =>
        a.values['rmse:' + compareBlocks()[0]][0] - b.values['rmse:' + compareBlocks()[0]][0],
    );
  const cheap = online
    .filter((e) => e.values.cpu_us)
    .sort((a, b) => a.values.cpu_us[0] - b.values.cpu_us[0])[0];
  if (online.length > 1 && cheap && cheap !== online[0]) {
    const b = 'rmse:' + compareBlocks()[0];
    const r = cheap.values[b][0] / online[0].values[b][0];
    out.push({
      cls: 'calm',
      mark: '★',
      text: [
        'Least error online: ',
        nameOf(online[0].name),
        `, ${withUnit(online[0].values[b][0], COMPARISON.estimators[0].units[compareBlocks()[0]])}; least time: `,
        nameOf(cheap.name),
        `, ${numberText(cheap.values.cpu_us[0])} µs a frame, with ${r < 1.005 ? 'the same error' : percent(r - 1) + ' more error'}.`,
      ],
    });
  }
  return out;
}

const compareBlocks = () =>
  unique(
    COMPARISON.estimators.flatMap((e) =>
      Object.keys(e.values)
        .filter((k) => /^rmse:[^@]*$/.test(k))
        .map((k) => k.slice(5)),
    ),
  );

const unitOf = (b) =>
  (COMPARISON.estimators.find((e) => e.units && e.units[b] !== undefined) || {units: {}}).units[
    b
  ] || '';

function whisker(rows, {log = true, ref, unit = '', label}) {
  // a forest plot: rows are [name, value, low, high, undecided]
  return new Plot({
    label,
    name: label,
    height: rows.length * 26 + 54,
    left: innerWidth < 520 ? 104 : 168,
    x: {
      label: '',
      unit,
      log,
      range: () => {
        const v = rows
          .flatMap((r) => [r[1], r[2], r[3]])
          .filter(Number.isFinite)
          .concat(ref === undefined ? [] : [ref]);
        const a = Math.min(...v);
        const b = Math.max(...v);
        const p = log ? (b / a) ** 0.08 : (b - a) * 0.08;
        return log ? [(a / p) * 0.995, b * p * 1.005] : [a - p, b + p];
      },
    },
    y: {unit: '', rows: rows.map((r) => r[0]), range: () => [-0.6, rows.length - 0.4]},
    layers: () => [
      ref !== undefined && {kind: 'v', v: ref, color: () => colours.muted},
      {
        kind: 'custom',
        x: null,
        paint: (s, X, Y) =>
          rows.forEach((r, i) => {
            const y = Y.to(i);
            const c = colorOf(r[0]);
            const a = shown(NAMES.includes(r[0]) ? r[0] : undefined)
              ? dim(NAMES.includes(r[0]) ? r[0] : undefined)
              : 0.15;
            if (Number.isFinite(r[2])) {
              s.path([X.to(r[2]), y, X.to(r[3]), y], {stroke: c, width: 2, alpha: a});
              s.path(
                [
                  X.to(r[2]),
                  y - 4,
                  X.to(r[2]),
                  y + 4,
                  NaN,
                  NaN,
                  X.to(r[3]),
                  y - 4,
                  X.to(r[3]),
                  y + 4,
                ],
                {stroke: c, width: 1.5, alpha: a},
              );
            }
            s.marks(
              [X.to(r[1]), y],
              'square',
              4.5,
              r[4] ? {fill: colours.panel, stroke: c, alpha: a, width: 1.6} : {fill: c, alpha: a},
            );
          }),
      },
      {
        kind: 'dots',
        x: rows.map((r) => r[1]),
        y: rows.map((_, i) => i),
        alpha: 0,
        color: ink,
        name: 'value',
        tip: (i) => [
          element('b', {}, rows[i][0]),
          numberText(rows[i][1], 4),
          Number.isFinite(rows[i][2])
            ? ` [${numberText(rows[i][2], 4)}, ${numberText(rows[i][3], 4)}]`
            : '',
        ],
        fit: false,
      },
    ],
  });
}

function compareSection(main) {
  const s = section(
    'comparison',
    'Comparison',
    COMPARISON.runs > 1
      ? `${COMPARISON.runs} runs; intervals are 95 %`
      : 'one run: no intervals, --runs N gives them',
    main,
  );
  const blocks = compareBlocks();
  const d = COMPARISON.decomposition;
  const holder = element('div');
  let block = blocks[0];
  let now = [];
  const build = () => {
    dispose(now);
    now = [];
    setContent(holder);
    const grid = element('div', {class: 'cols'});
    const unit = unitOf(block);
    const put = (parent, spec) => {
      now.push(...spec.plots);
      figure(parent, spec);
    };
    holder.append(grid);
    if (d) {
      const step = (k) => d.steps.find((q) => q.kind === k);
      const g = (st, key) => st && st.values[key + block] && st.values[key + block][0];
      const lin = step('linearisation');
      const smo = step('smoothing');
      const rej = step('rejected_measurements');
      const bars = [];
      const F = g(lin, 'rmse.from:') || g(smo, 'rmse.from:');
      const I = g(lin, 'rmse.to:');
      const B = g(smo, 'rmse.to:');
      if (F) bars.push([d.filter, 0, F, true]);
      if (lin && I !== undefined)
        bars.push(['linearised once', I, F, false], ['full information', 0, I, true]);
      if (smo && B !== undefined)
        bars.push(['no later data', B, I === undefined ? F : I, false], [smo.to, 0, B, true]);
      if (rej && g(rej, 'rmse.from:') !== undefined && bars.length)
        bars.push(['what was rejected', g(rej, 'rmse.to:'), g(rej, 'rmse.from:'), false]);
      const rows = bars.map((b) => b[0]).reverse();
      const [f, u] = unitFor(unit, F);
      if (bars.length)
        put(grid, {
          title: `Where the error of ${d.filter} comes from`,
          hint: 'From the filter down to what all data could give. Orange: what a better method would take away; blue: what would be added.',
          plots: [
            new Plot({
              label: 'RMSE',
              name: 'decomposition',
              height: bars.length * 30 + 54,
              left: innerWidth < 520 ? 104 : 140,
              x: {
                label: 'RMSE',
                unit,
                range: () => [0, Math.max(...bars.map((b) => Math.max(b[1], b[2]))) * 1.34],
              },
              y: {unit: '', rows, range: () => [-0.6, rows.length - 0.4]},
              layers: () => [
                {
                  kind: 'custom',
                  x: null,
                  paint: (srf, X, Y) =>
                    bars.forEach((b, i) => {
                      const y = Y.to(bars.length - 1 - i);
                      const a = X.to(Math.min(b[1], b[2]));
                      const z = X.to(Math.max(b[1], b[2]));
                      const worse = b[2] >= b[1];
                      srf.rect(a, y - 9, Math.max(z - a, 1.5), 18, {
                        fill: b[3]
                          ? NAMES.includes(b[0])
                            ? colorOf(b[0])
                            : colours.faint
                          : worse
                            ? '#E08A00'
                            : '#56B4E9',
                        alpha: b[3] ? 0.85 : 1,
                      });
                      if (i + 1 < bars.length) {
                        const x = X.to(b[3] ? b[2] : b[1]);
                        srf.path([x, y + 9, x, y + 21], {stroke: colours.faint, dash: [2, 2]});
                      }
                      srf.text(
                        b[1] === b[2]
                          ? 'nothing'
                          : (b[3] ? '' : worse ? '−' : '+') +
                              numberText(Math.abs(b[2] - b[1]) * f) +
                              ' ' +
                              u,
                        z + 6,
                        y,
                        {color: colours.ink, size: 11.5},
                      );
                    }),
                },
              ],
            }),
          ],
        });
    }
    const ratios = COMPARISON.estimators
      .filter((e) => e.values['ratio.rmse:' + block] && e.values['ratio.rmse:' + block][0] !== 1)
      .map((e) => [e.name, ...e.values['ratio.rmse:' + block]])
      .reverse();
    if (ratios.length)
      put(grid, {
        title: 'Error against the best of its kind',
        hint: 'Ratio of RMSE to full information (online) or to the batch (smoothed). Left of 1 is better. Hollow: the interval includes 1.',
        plots: [whisker(ratios, {ref: 1, label: `ratio of RMSE, ${block}`})],
      });
    const cost = COMPARISON.estimators.filter(
      (e) => e.values.cpu_us && e.values['rmse:' + block] && e.values['rmse:' + block][0] > 0,
    );
    if (cost.length > 1)
      put(grid, {
        title: 'Cost against error',
        hint: 'Down and left is better; the line joins those that no other beats in both. Dots: online, squares: smoothed.',
        plots: [
          new Plot({
            label: `RMSE of ${block}`,
            name: 'cost against error',
            height: 290,
            x: {label: 'CPU time a frame', unit: 's', log: true},
            y: {unit, log: true},
            layers: () => {
              const vis = cost.filter((e) => shown(e.name));
              const at = (e) => [e.values.cpu_us[0] * 1e-6, e.values['rmse:' + block][0]];
              const front = (kind) => {
                let best = Infinity;
                return vis
                  .filter((e) => e.smoothed === kind)
                  .sort((a, b) => at(a)[0] - at(b)[0])
                  .filter((e) => at(e)[1] < best && (best = at(e)[1]));
              };
              return [
                ...[false, true].map((k) => ({
                  kind: 'line',
                  x: front(k).map((e) => at(e)[0]),
                  y: front(k).map((e) => at(e)[1]),
                  color: () => colours.faint,
                  dash: k ? [2, 3] : [5, 4],
                  width: 1.2,
                })),
                ...vis.map((e) => ({
                  kind: 'dots',
                  x: [at(e)[0]],
                  y: [at(e)[1]],
                  est: e.name,
                  size: 5,
                  shape: e.smoothed ? 'square' : 'dot',
                  tip: () => [
                    nameOf(e.name),
                    element('br'),
                    `${withUnit(at(e)[0], 's')} a frame, RMSE ${withUnit(at(e)[1], unit)}`,
                  ],
                })),
                {
                  kind: 'custom',
                  x: null,
                  paint: (srf, X, Y, p) => {
                    const taken = [];
                    vis.forEach((e) => {
                      let x = X.to(at(e)[0]) + 9;
                      let y = Y.to(at(e)[1]) - 1;
                      const w = e.name.length * 6.4;
                      if (x + w > p.f.r) x -= w + 20;
                      while (
                        taken.some(
                          (q) => Math.abs(q[1] - y) < 12 && x < q[0] + q[2] && q[0] < x + w,
                        )
                      )
                        y += 12;
                      taken.push([x, y, w]);
                      srf.text(e.name, x, y, {color: colorOf(e.name), weight: 600, halo: true});
                    });
                  },
                },
              ];
            },
          }),
        ],
      });
    const o = COMPARISON.over_time;
    if (o && o.columns[`${COMPARISON.estimators[0].name}.rms:${block}`] !== undefined) {
      const c = (e, k) =>
        o.columns[`${e.name}.${k}`] !== undefined ? columnOf(o.columns[`${e.name}.${k}`]) : null;
      const t = columnOf(o.t);
      const bound = COMPARISON.estimators.map((e) => c(e, 'bound:' + block)).find(Boolean);
      const owners = unique(
        Object.keys(o.columns)
          .map((k) => (k.match(/\.anees:(.*)$/) || [])[1])
          .filter(Boolean),
      );
      const owner = owners.find((q) => block.startsWith(q)) || owners[0];
      const any = COMPARISON.estimators.find((e) => c(e, 'anees.low:' + owner));
      put(holder, {
        title: 'Over time, across the runs',
        hint: 'RMS error of each estimator; the band holds the middle 68 % of the runs; dashed black: Cramér-Rao bound, the least that an unbiased filter can have. Below: mean NEES, green where consistent.',
        plots: [
          new Plot({
            label: `RMS error of ${block}`,
            time: true,
            last: false,
            first: true,
            height: 190,
            y: {unit, log: true},
            layers: () => [
              ...COMPARISON.estimators.map(
                (e) =>
                  c(e, 'p16:' + block) && {
                    kind: 'band',
                    x: t,
                    lo: c(e, 'p16:' + block),
                    hi: c(e, 'p84:' + block),
                    est: e.name,
                    fill: 0.1,
                  },
              ),
              ...COMPARISON.estimators.map(
                (e) =>
                  c(e, 'rms:' + block) && {
                    kind: 'line',
                    x: t,
                    y: c(e, 'rms:' + block),
                    est: e.name,
                    name: e.name,
                  },
              ),
              bound && {kind: 'line', x: t, y: bound, color: ink, dash: [6, 4], name: 'Cramér-Rao'},
            ],
          }),
          any &&
            new Plot({
              label: `mean NEES of ${owner}`,
              time: true,
              height: 160,
              y: {unit: '', log: true},
              layers: () => [
                {
                  kind: 'band',
                  x: t,
                  lo: c(any, 'anees.low:' + owner),
                  hi: c(any, 'anees.high:' + owner),
                  color: () => (page.dark ? '#2fbf93' : '#009E73'),
                  fill: 0.15,
                },
                ...COMPARISON.estimators.map(
                  (e) =>
                    c(e, 'anees:' + owner) && {
                      kind: 'line',
                      x: t,
                      y: c(e, 'anees:' + owner),
                      est: e.name,
                      name: e.name,
                    },
                ),
              ],
            }),
        ].filter(Boolean),
      });
    }
    const rows = COMPARISON.estimators;
    const [f, u] = unitFor(
      unit,
      Math.min(...rows.map((e) => (e.values['rmse:' + block] || [NaN])[0]).filter((x) => x > 0)),
    );
    const val = (e, k) => (e.values[k] ? e.values[k][0] : NaN);
    const iv = (e, k, g = 1, dg) => {
      const q = e.values[k];
      return q
        ? element(
            'span',
            {},
            numberText(q[0] * g, dg),
            q[1] !== null
              ? element(
                  'span',
                  {class: 'quiet'},
                  ` [${numberText(q[1] * g, dg)}, ${numberText(q[2] * g, dg)}]`,
                )
              : null,
            q[3] ? element('span', {class: 'quiet', title: 'the interval includes 1'}, ' ~') : null,
          )
        : '–';
    };
    const nees = unique(
      rows.flatMap((e) => Object.keys(e.values).filter((k) => /^nees\.mean:[^@]*$/.test(k))),
    );
    holder.append(
      element(
        'div',
        {class: 'panel'},
        dataTable(
          [
            {name: 'estimator', text: true, get: (e) => e.name, show: (e) => nameOf(e.name)},
            {name: 'kind', text: true, get: (e) => (e.smoothed ? 'smoothed' : 'online')},
            {
              name: 'RMSE',
              sub: `[${u || '1'}]`,
              best: 'min',
              get: (e) => val(e, 'rmse:' + block) * f,
              show: (e) => iv(e, 'rmse:' + block, f),
            },
            {
              name: 'ratio',
              sub: 'to its reference',
              get: (e) => val(e, 'ratio.rmse:' + block),
              show: (e) => iv(e, 'ratio.rmse:' + block, 1, 4),
            },
            {
              name: 'MSE / bound',
              sub: 'Cramér-Rao',
              get: (e) => val(e, 'ratio.mse_by_bound:' + block),
              show: (e) => iv(e, 'ratio.mse_by_bound:' + block),
            },
            ...nees.map((k) => ({
              name: 'NEES ' + k.slice(10),
              sub: '1 is ideal',
              get: (e) => val(e, k),
              show: (e) => iv(e, k),
            })),
            {
              name: 'CPU',
              sub: 'µs a frame',
              best: 'min',
              get: (e) => val(e, 'cpu_us'),
              show: (e) => iv(e, 'cpu_us'),
            },
          ].filter((cn) =>
            rows.some((e) => typeof cn.get(e) === 'string' || Number.isFinite(cn.get(e))),
          ),
          rows,
        ),
      ),
    );
  };
  s.append(
    element(
      'div',
      {class: 'side', style: 'margin-bottom:10px'},
      choice(
        '',
        blocks.map((b) => [b, b.split('.').pop().replace(/_/g, ' ')]),
        block,
        (v) => {
          block = v;
          build();
        },
      ),
    ),
    holder,
  );
  build();
  if (COMPARISON.notes.length)
    fold(s, 'Notes', plural(COMPARISON.notes.length, 'note'), (box) =>
      box.append(
        element(
          'ul',
          {class: 'panel quiet'},
          COMPARISON.notes.map((n) => element('li', {}, n)),
        ),
      ),
    );
}
