// SPDX-License-Identifier: Apache-2.0
// Sweep: runs over seeds, and over values of a parameter.

const metricUnit = (m) => SWEEP.units[m] || '';

const better = (m) =>
  /^(nees|nis)\.mean|scale$/.test(m)
    ? 'one'
    : /^(rmse|final_error|map|trajectory|implied)/.test(m)
      ? 'min'
      : null;

const mainMetric = () =>
  SWEEP.metrics.find((m) => /^rmse:.*(position|depth)$/.test(m)) ||
  SWEEP.metrics.find((m) => m.startsWith('rmse:')) ||
  SWEEP.metrics[0];

function sweepStory() {
  const out = [];
  const add = (cls, mark, text, more) => out.push({cls, mark, text, more});
  const main = mainMetric();
  const unit = metricUnit(main);
  const finite = (g, m) =>
    g.columns[m] === undefined ? [] : Array.from(columnOf(g.columns[m])).filter(Number.isFinite);
  const mean = (g, m) => {
    const v = finite(g, m);
    return v.length ? sum(v) / v.length : NaN;
  };
  const label = (g) => (SWEEP.vary ? `${g.estimator} at ${g.value}` : g.estimator);
  const show = (gs) =>
    gs.map((g, i) => [
      i ? (i === gs.length - 1 ? ' and ' : ', ') : '',
      nameOf(label(g), g.estimator),
    ]);
  const rank = SWEEP.groups
    .filter((g) => Number.isFinite(mean(g, main)) && !sum(columnOf(g.diverged)))
    .sort((a, b) => mean(a, main) - mean(b, main));
  if (rank.length > 1 && SWEEP.vary)
    add('calm', '★', [
      `Best value for ${main}: `,
      element('b', {}, rank[0].value),
      `, ${withUnit(mean(rank[0], main), unit)} in the mean; next is ${rank[1].value} with ${withUnit(mean(rank[1], main), unit)}.`,
    ]);
  else if (rank.length > 1 && !COMPARISON)
    add('calm', '★', [
      `Least ${main}: `,
      nameOf(rank[0].estimator),
      `, ${withUnit(mean(rank[0], main), unit)} in the mean of ${columnOf(rank[0].seed).length} runs; then `,
      nameOf(rank[1].estimator),
      ` with ${withUnit(mean(rank[1], main), unit)}. `,
      pairedSentence(rank[0], rank[1], main),
    ]);
  const state = (g) =>
    SWEEP.metrics
      .filter((q) => /^nees\.mean:[^@]*$/.test(q) && g.bounds[q] && mean(g, q) > 0)
      .map((q) => {
        const v = mean(g, q);
        const [lo, hi] = g.bounds[q];
        return {owner: q.slice(10), v, lo, hi, side: v > hi ? 1 : v < lo ? -1 : 0};
      });
  const all = SWEEP.groups.map((g) => ({
    g,
    st: state(g),
    n: sum(columnOf(g.diverged)),
    of: columnOf(g.seed).length,
  }));
  const say = (q) =>
    `NEES ${q.owner} ${numberText(q.v)} (${numberText(q.lo, 2)} to ${numberText(q.hi, 2)})`;
  const good = all.filter((a) => !a.n && a.st.length && a.st.every((q) => !q.side));
  const low = all.filter(
    (a) => !a.n && !good.includes(a) && a.st.length && a.st.every((q) => q.side <= 0),
  );
  if (good.length)
    add(
      'good',
      '✓',
      [show(good.map((a) => a.g)), good.length > 1 ? ' are' : ' is', ' consistent over the seeds.'],
      good.length < 4
        ? good.map((a) => `${label(a.g)}: ${a.st.map(say).join(', ')}`).join('; ')
        : '',
    );
  if (low.length)
    add(
      'warn',
      '▼',
      [
        show(low.map((a) => a.g)),
        low.length > 1 ? ' are' : ' is',
        ' underconfident: errors are smaller than σ says.',
      ],
      low
        .map(
          (a) =>
            `${label(a.g)}: ${a.st
              .filter((q) => q.side)
              .map(say)
              .join(', ')}`,
        )
        .join('; '),
    );
  for (const a of all) {
    const over = a.st.filter((q) => q.side > 0);
    const [p, q] = wilson(a.n, a.of);
    const worst = over.length ? Math.sqrt(Math.max(...over.map((o) => o.v))) : 0;
    if (a.n || over.length)
      add(
        a.n ? 'bad' : 'warn',
        a.n ? '✕' : '▲',
        [
          show([a.g]),
          a.n
            ? ` diverged in ${a.n} of ${a.of} runs (95 % interval ${percent(p)} to ${percent(q)}).`
            : '',
          over.length
            ? `${a.n ? ' It' : ''} is overconfident: errors are ${worst > 100 ? 'hundreds of times or more' : `about ${numberText(worst, 2)} times`} what σ says.`
            : '',
        ],
        over.map(say).join(', '),
      );
  }
  return out;
}

function pairedSentence(a, b, m) {
  const sa = new Map(Array.from(columnOf(a.seed), (s, i) => [s, columnOf(a.columns[m])[i]]));
  let wins = 0;
  let n = 0;
  columnOf(b.seed).forEach((s, i) => {
    const x = sa.get(s);
    const y = columnOf(b.columns[m])[i];
    if (Number.isFinite(x) && Number.isFinite(y)) {
      n++;
      if (x < y) wins++;
    }
  });
  return `It has less in ${wins} of ${n} seeds.`;
}

const command = (seed) => `alidade run ${DATA.config_file} --seed ${seed}`;

function sweepSection(main) {
  const s = section('runs', 'Runs', `${SWEEP.runs} seeds from ${SWEEP.first_seed}`, main);
  const groups = SWEEP.groups;
  const ms = SWEEP.metrics.slice();
  const holder = element('div');
  let metric = mainMetric();
  let second = ms.find((m) => /^nees\.mean/.test(m)) || ms[1] || ms[0];
  let shape = 'histogram';
  let now = [];
  let value = SWEEP.vary ? groups[0].value : null;
  const select = (label, get, set) =>
    element(
      'label',
      {class: 'group'},
      element('span', {class: 'label'}, label),
      element(
        'select',
        {
          class: 'btn',
          onchange: (e) => {
            set(e.target.value);
            build();
          },
        },
        ms.map((m) => element('option', {value: m, selected: m === get()}, m)),
      ),
    );
  const build = () => {
    dispose(now);
    now = [];
    setContent(holder);
    const unit = metricUnit(metric);
    const own = groups.filter(
      (g) => g.columns[metric] !== undefined && (!SWEEP.vary || g.value === value),
    );
    const data = new Map(
      own.map((g) => [
        g.estimator,
        {g, v: Array.from(columnOf(g.columns[metric])), seed: Array.from(columnOf(g.seed))},
      ]),
    );
    const put = (parent, spec) => {
      now.push(...spec.plots);
      figure(parent, spec);
    };
    const all = () => [...data.values()].filter((d) => shown(d.g.estimator));
    const positive = [...data.values()].every((d) => d.v.every((v) => !(v <= 0)));
    const flat = [...data.values()].flatMap((d) => d.v).filter(Number.isFinite);
    const [qa, qb] = quantiles(flat, [0.05, 0.95]);
    const log = positive && qb / qa > 8;
    const est = [...data.keys()];
    const tipOf = (d) => (i) => [
      element('b', {}, `seed ${d.seed[i]}`),
      nameOf(d.g.estimator),
      ` ${metric} ${withUnit(d.v[i], unit)}`,
      element('br'),
      element('code', {}, command(d.seed[i])),
    ];
    const worstOf = (d) =>
      d.v
        .map((v, i) => [better(metric) === 'one' ? Math.abs(Math.log(v)) : v, i])
        .filter((q) => Number.isFinite(q[0]))
        .sort((a, b) => b[0] - a[0])
        .slice(0, 5)
        .map((q) => q[1]);
    const jitter = (seed) => (((seed * 2654435761) % 4294967296) / 4294967296 - 0.5) * 0.55;
    const reversed = est.slice().reverse();
    const grid = element('div', {class: 'cols'});
    put(holder, {
      title: 'Every seed',
      hint:
        'One dot a run; the worst five of each estimator are ringed: hover for the command that repeats them. The diamond is the mean' +
        (own.some((g) => g.bounds[metric]) ? ', the green zone its 95 % bounds' : '') +
        '.',
      plots: [
        new Plot({
          label: metric,
          name: 'seeds',
          height: est.length * 54 + 56,
          left: innerWidth < 520 ? 104 : 168,
          x: {label: metric, unit, log},
          y: {unit: '', rows: reversed, range: () => [-0.6, est.length - 0.4]},
          layers: () => [
            {
              kind: 'custom',
              x: null,
              paint: (srf, X, Y) =>
                all().forEach((d) => {
                  const b = d.g.bounds[metric];
                  const y = Y.to(reversed.indexOf(d.g.estimator));
                  if (b)
                    srf.rect(X.to(b[0]), y - 20, X.to(b[1]) - X.to(b[0]), 40, {
                      fill: '#009E73',
                      alpha: 0.16,
                    });
                }),
            },
            ...all().map((d) => ({
              kind: 'dots',
              x: d.v,
              y: d.seed.map((q) => reversed.indexOf(d.g.estimator) + jitter(q)),
              est: d.g.estimator,
              name: d.g.estimator,
              size: 2.8,
              alpha: 0.6,
              tip: tipOf(d),
            })),
            {
              kind: 'custom',
              x: null,
              paint: (srf, X, Y) =>
                all().forEach((d) => {
                  const r = reversed.indexOf(d.g.estimator);
                  const fin = d.v.filter(Number.isFinite);
                  const pts = worstOf(d).flatMap((i) => [
                    X.to(d.v[i]),
                    Y.to(r + jitter(d.seed[i])),
                  ]);
                  srf.marks(pts, 'dot', 5, {stroke: REJECTED(), width: 1.4});
                  srf.marks([X.to(sum(fin) / fin.length), Y.to(r)], 'diamond', 6.5, {
                    fill: colours.panel,
                    stroke: colours.ink,
                    width: 1.8,
                  });
                }),
            },
          ],
        }),
      ],
    });
    holder.append(grid);
    put(grid, {
      title: shape === 'ecdf' ? 'Share of runs below' : 'Histogram',
      controls: choice(
        '',
        [
          ['histogram', 'histogram'],
          ['ecdf', 'ECDF'],
        ],
        shape,
        (v) => {
          shape = v;
          build();
        },
      ),
      plots: [
        new Plot({
          label: shape === 'ecdf' ? 'share of runs' : 'runs',
          name: 'distribution',
          height: 260,
          x: {
            label: metric,
            unit,
            log,
            range: () => {
              const v = all()
                .flatMap((d) => d.v)
                .filter(Number.isFinite);
              const [a, b] = quantiles(v, [0, 1]);
              return log ? [a / 1.05, b * 1.05] : [a - (b - a) * 0.03, b + (b - a) * 0.03];
            },
          },
          y: {
            unit: '',
            range: (L) => [
              0,
              Math.max(shape === 'ecdf' ? 1.02 : 1, ...L.flatMap((q) => Array.from(q.y))) *
                (shape === 'ecdf' ? 1 : 1.08),
            ],
          },
          layers: () => {
            const v = all()
              .flatMap((d) => d.v)
              .filter(Number.isFinite);
            const [a, b] = quantiles(v, [0, 1]);
            const n = 30;
            const edge = Array.from({length: n + 1}, (_, i) =>
              log ? a * (b / a) ** (i / n) : a + ((b - a) * i) / n,
            );
            return all().map((d) => {
              const w = d.v.filter(Number.isFinite).sort((p, q) => p - q);
              if (shape === 'ecdf')
                return {
                  kind: 'line',
                  step: true,
                  x: w,
                  x2: w.slice(1).concat(b),
                  y: w.map((_, i) => (i + 1) / w.length),
                  est: d.g.estimator,
                  name: d.g.estimator,
                  width: 1.8,
                };
              const c = new Array(n).fill(0);
              for (const q of w)
                c[
                  clamp(
                    Math.floor(n * (log ? Math.log(q / a) / Math.log(b / a) : (q - a) / (b - a))),
                    0,
                    n - 1,
                  )
                ]++;
              return {
                kind: 'line',
                step: true,
                x: edge.slice(0, n),
                x2: edge.slice(1),
                y: c,
                est: d.g.estimator,
                name: d.g.estimator,
                width: 1.8,
              };
            });
          },
        }),
      ],
    });
    put(grid, {
      title: 'Two metrics',
      controls: select(
        'against',
        () => second,
        (v) => {
          second = v;
        },
      ),
      plots: [
        new Plot({
          label: second,
          name: 'two metrics',
          height: 260,
          x: {label: metric, unit, log},
          y: {
            unit: metricUnit(second),
            log: own.every(
              (g) =>
                g.columns[second] === undefined ||
                Array.from(columnOf(g.columns[second])).every((v) => !(v <= 0)),
            ),
          },
          layers: () =>
            all()
              .filter((d) => d.g.columns[second] !== undefined)
              .map((d) => ({
                kind: 'dots',
                x: d.v,
                y: columnOf(d.g.columns[second]),
                est: d.g.estimator,
                name: d.g.estimator,
                size: 2.8,
                alpha: 0.6,
                tip: tipOf(d),
              })),
        }),
      ],
    });
    const worst = [...data.values()].flatMap((d) =>
      worstOf(d).map((i, k) => ({est: d.g.estimator, rank: k + 1, seed: d.seed[i], v: d.v[i]})),
    );
    holder.append(
      element(
        'figure',
        {class: 'panel'},
        element('header', {}, element('h3', {}, 'Worst runs, and how to see them')),
        dataTable(
          [
            {name: 'estimator', text: true, get: (r) => r.est, show: (r) => nameOf(r.est)},
            {name: 'rank', get: (r) => r.rank, show: (r) => String(r.rank)},
            {name: 'seed', get: (r) => r.seed, show: (r) => String(r.seed)},
            {name: metric, get: (r) => r.v, show: (r) => withUnit(r.v, unit)},
            {
              name: 'command',
              text: true,
              get: (r) => r.seed,
              show: (r) =>
                element(
                  'span',
                  {class: 'cmd'},
                  command(r.seed),
                  copyButton(() => command(r.seed)),
                ),
            },
          ],
          worst,
          {tall: true, off: (r) => page.hidden.has(r.est)},
        ),
      ),
    );
  };
  s.append(
    element(
      'div',
      {class: 'side', style: 'margin-bottom:10px'},
      select(
        'metric',
        () => metric,
        (v) => {
          metric = v;
        },
      ),
      SWEEP.vary &&
        choice(
          SWEEP.vary,
          unique(groups.map((g) => g.value)).map((v) => [v, v]),
          value,
          (v) => {
            value = v;
            build();
          },
        ),
    ),
    holder,
  );
  build();
}

function varySection(main) {
  const s = section(
    'vary',
    `Effect of ${SWEEP.vary}`,
    'mean of the runs; the band holds 90 % of them; ★ is the best value',
    main,
  );
  const grid = element('div', {class: 'cols'});
  const values = unique(SWEEP.groups.map((g) => g.value));
  const xs = values.map(Number);
  const numeric = xs.every(Number.isFinite);
  const logx = numeric && Math.min(...xs) > 0 && Math.max(...xs) / Math.min(...xs) > 4;
  const at = numeric ? xs : values.map((_, i) => i);
  const metrics = SWEEP.metrics.filter(
    (m) =>
      !m.includes('@') &&
      /^(rmse|nees\.mean|nis\.mean|map\.|reprojection|trajectory|settling|coverage)/.test(m),
  );
  s.append(grid);
  for (const m of metrics) {
    const lines = unique(SWEEP.groups.map((g) => g.estimator)).map((est) => {
      const st = values.map((v) => {
        const g = SWEEP.groups.find((q) => q.estimator === est && q.value === v);
        const a =
          g && g.columns[m] !== undefined
            ? Array.from(columnOf(g.columns[m])).filter(Number.isFinite)
            : [];
        return a.length ? [sum(a) / a.length, ...quantiles(a, [0.05, 0.95])] : [NaN, NaN, NaN];
      });
      const how = better(m);
      const score = st.map((q) => (how === 'one' ? Math.abs(Math.log(q[0])) : q[0]));
      const best = how
        ? score.reduce((b, v, i) => (v < (b < 0 ? Infinity : score[b]) ? i : b), -1)
        : -1;
      return {est, st, best};
    });
    const pos = lines.every((l) => l.st.every((q) => !(q[1] <= 0)));
    const spreadOf = lines.flatMap((l) => l.st.flat()).filter((v) => v > 0);
    const log = pos && spreadOf.length && Math.max(...spreadOf) / Math.min(...spreadOf) > 8;
    figure(grid, {
      title: m,
      plots: [
        new Plot({
          label: 'mean',
          name: m,
          height: 210,
          x: {label: SWEEP.vary, unit: '', log: logx, ticks: values.map((v, i) => [at[i], v])},
          y: {unit: metricUnit(m), log},
          layers: () => [
            better(m) === 'one' && {kind: 'h', v: 1, color: () => colours.muted, dash: [2, 3]},
            ...lines.flatMap((l) => [
              {
                kind: 'band',
                x: at,
                lo: l.st.map((q) => q[1]),
                hi: l.st.map((q) => q[2]),
                est: l.est,
                fill: 0.13,
              },
              {kind: 'line', x: at, y: l.st.map((q) => q[0]), est: l.est, name: l.est, width: 2},
              {
                kind: 'dots',
                x: at,
                y: l.st.map((q) => q[0]),
                est: l.est,
                size: 3.2,
                tip: (i) => [
                  element('b', {}, `${SWEEP.vary} = ${values[i]}`),
                  `${l.est}: mean ${withUnit(l.st[i][0], metricUnit(m))}, 90 % in ${withUnit(l.st[i][1], metricUnit(m))} to ${withUnit(l.st[i][2], metricUnit(m))}`,
                ],
              },
            ]),
            {
              kind: 'custom',
              x: null,
              paint: (srf, X, Y) =>
                lines
                  .filter((l) => shown(l.est) && l.best >= 0)
                  .forEach((l) =>
                    srf.text('★', X.to(at[l.best]), Y.to(l.st[l.best][0]) - 13, {
                      size: 16,
                      align: 'center',
                      color: colorOf(l.est),
                      halo: true,
                    }),
                  ),
            },
          ],
        }),
      ],
    });
  }
}
