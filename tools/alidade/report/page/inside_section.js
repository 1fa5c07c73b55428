// SPDX-License-Identifier: Apache-2.0
// Section "Inside the filter": standard deviations, gains, correlations, frame time.

function insideSection(main) {
  const es = RUN.estimators;
  const s = section('inside', 'Inside the filter', 'drawn when opened', main);
  const sig = unique(es.flatMap((e) => e.blocks.filter((b) => b.sigma.length).map((b) => b.name)));
  if (sig.length)
    fold(s, 'Standard deviations', 'of every block, logarithmic', (box) => {
      for (const name of sig) {
        const own = es.filter((e) => e.blocks.some((b) => b.name === name && b.sigma.length));
        const of = (e) => e.blocks.find((b) => b.name === name);
        const b0 = of(own[0]);
        const ps = b0.sigma.map(
          (_, k) =>
            new Plot({
              label: `σ of ${name.split('.').pop().replace(/_/g, ' ')}${b0.tangent[k] ? ' ' + b0.tangent[k] : ''}`,
              time: true,
              last: k === b0.sigma.length - 1,
              height: k === b0.sigma.length - 1 ? 128 : 100,
              y: {unit: b0.error_unit, log: true},
              layers: () =>
                own.map(
                  (e) =>
                    of(e).sigma[k] !== undefined && {
                      kind: 'line',
                      x: columnOf(e.t),
                      y: columnOf(of(e).sigma[k]),
                      est: e.name,
                      name: e.name,
                    },
                ),
            }),
        );
        figure(box, {title: name.replace('.', ' · '), plots: ps});
      }
    });
  if (es.some((e) => e.gains.length))
    fold(s, 'Gain', 'what one unit of innovation moves', (box) => {
      for (const sensor of unique(es.flatMap((e) => e.gains.map((g) => g.sensor)))) {
        const own = es.filter((e) => e.gains.some((g) => g.sensor === sensor));
        const of = (e) => e.gains.find((g) => g.sensor === sensor);
        const names = unique(own.flatMap((e) => of(e).columns.map((c) => c.name)));
        figure(box, {
          title: sensor,
          hint: 'The columns of the gain K of this sensor. Zero: the sensor does not move this element. It should settle; a jump is a change of geometry, a reset, or a gap before it.',
          plots: names.map(
            (n, k) =>
              new Plot({
                label: n.replace('<-', ' ← '),
                time: true,
                last: k === names.length - 1,
                height: k === names.length - 1 ? 130 : 102,
                y: {unit: ''},
                layers: () =>
                  own.map((e) => {
                    const c = of(e).columns.find((q) => q.name === n);
                    return (
                      c && {
                        kind: 'line',
                        x: columnOf(of(e).t),
                        y: columnOf(c.v),
                        est: e.name,
                        name: e.name,
                        gap:
                          6 *
                          quantiles(
                            columnOf(of(e).t)
                              .slice(1, 2000)
                              .map((v, i) => v - columnOf(of(e).t)[i]),
                            [0.5],
                          )[0],
                      }
                    );
                  }),
              }),
          ),
        });
      }
    });
  const withP = es.filter((e) => e.last_p && e.last_p.labels.length > 1);
  if (withP.length)
    fold(s, 'Correlations at the end', 'of the last P', (box) => {
      const holder = element('div');
      let plot = null;
      const show = (name) => {
        if (plot) dispose([plot]);
        plot = heatmap(withP.find((e) => e.name === name));
        setContent(holder);
        figure(holder, {
          title: `Correlations of ${name}`,
          hint: 'Blue: they err together; orange: they err against each other; a pair near ±1 is one direction that the measurements do not separate.',
          plots: [plot],
        });
      };
      if (withP.length > 1)
        box.append(
          element(
            'div',
            {class: 'side', style: 'margin-bottom:8px'},
            choice(
              'estimator',
              withP.map((e) => [e.name, e.name]),
              withP[0].name,
              show,
            ),
          ),
        );
      box.append(holder);
      show(withP[0].name);
    });
  const timing = fold(
    s,
    'Frame time',
    RUN.timing
      ? 'wall clock, not reproducible'
      : 'not in this file, so that its bytes are reproducible',
    (box) => {
      const draw = (T) => {
        const t = columnOf(T.t);
        const rate =
          t.length > 1
            ? quantiles(
                t.slice(1).map((v, i) => v - t[i]),
                [0.5],
              )[0]
            : 0;
        setContent(box);
        figure(box, {
          title: 'Wall clock of each frame',
          hint: rate
            ? `The dashed line is the frame period, ${withUnit(rate, 's')}. ` +
              Object.entries(T.estimators)
                .map(
                  ([n, c]) =>
                    `${n} ${((100 * sum(Array.from(columnOf(c)).filter((v) => v === v))) / (rate * t.length)).toPrecision(2)} %`,
                )
                .join(', ') +
              ' of real time.'
            : '',
          plots: [
            new Plot({
              label: 'wall clock',
              time: true,
              height: 190,
              y: {unit: 's', log: true},
              layers: () => [
                rate && {kind: 'h', v: rate, color: () => colours.muted},
                ...Object.entries(T.estimators).map(([n, c]) => ({
                  kind: 'line',
                  x: t,
                  y: columnOf(c),
                  est: n,
                  name: n,
                  width: 1,
                })),
              ],
            }),
          ],
        });
      };
      if (RUN.timing) {
        draw(RUN.timing);
        return;
      }
      box.append(
        element(
          'label',
          {class: 'panel', style: 'display:block'},
          'Choose timing.csv of this folder: ',
          element('input', {
            type: 'file',
            accept: '.csv',
            onchange: async (e) => {
              const rows = (await e.target.files[0].text())
                .trim()
                .split('\n')
                .map((l) => l.split(','));
              const put = (a) => {
                DATA.columns.push({d: 'own'});
                decoded.set(DATA.columns.length - 1, a);
                return DATA.columns.length - 1;
              };
              const column = (k) =>
                put(
                  Float64Array.from(rows.slice(1), (r) =>
                    r[k] === '' ? NaN : Number(r[k]) - (k ? 0 : RUN.t0),
                  ),
                );
              draw({
                t: column(0),
                estimators: Object.fromEntries(rows[0].slice(1).map((n, k) => [n, column(k + 1)])),
              });
            },
          }),
        ),
      );
    },
  );
  return timing;
}

function heatmap(e) {
  const n = e.last_p.labels.length;
  const low = columnOf(e.last_p.lower);
  const P = (i, j) => low[(Math.max(i, j) * (Math.max(i, j) + 1)) / 2 + Math.min(i, j)];
  const rho = (i, j) => P(i, j) / Math.sqrt(P(i, i) * P(j, j));
  const names = e.last_p.labels.map((s) => s.replace(/^[^.]*\./, ''));
  const xs = [];
  const ys = [];
  for (let i = 0; i < n; i++)
    for (let j = 0; j < n; j++) {
      xs.push(j);
      ys.push(n - 1 - i);
    }
  const tint = (v) => {
    const c = v > 0 ? [0, 114, 178] : [222, 120, 10];
    const base = page.dark ? [22, 28, 35] : [255, 255, 255];
    const f = Math.min(1, Math.abs(v)) ** 0.7;
    return `rgb(${c.map((q, k) => Math.round(base[k] + f * (q - base[k]))).join(',')})`;
  };
  return new Plot({
    height: Math.max(170, Math.min(n, 26) * 24 + 30),
    name: 'correlation matrix',
    left: innerWidth < 520 ? 110 : 170,
    x: {ticks: [], range: () => [-0.5, n - 0.5]},
    y: {unit: '', rows: names.slice().reverse(), range: () => [-0.5, n - 0.5]},
    layers: () => [
      {
        kind: 'custom',
        x: null,
        paint: (s, X, Y) => {
          const w = X.to(1) - X.to(0);
          const hh = Y.to(0) - Y.to(1);
          for (let i = 0; i < n; i++)
            for (let j = 0; j < n; j++) {
              const v = rho(i, j);
              s.rect(X.to(j) - w / 2 + 0.5, Y.to(n - 1 - i) - hh / 2 + 0.5, w - 1, hh - 1, {
                fill: tint(v),
              });
              if (w > 34 && i !== j && Math.abs(v) > 0.095)
                s.text(v.toFixed(1).replace('-', '−'), X.to(j), Y.to(n - 1 - i), {
                  align: 'center',
                  size: 10,
                  color: Math.abs(v) > 0.6 ? '#fff' : colours.ink,
                });
            }
        },
      },
      {
        kind: 'dots',
        x: xs,
        y: ys,
        alpha: 0,
        color: ink,
        size: 1,
        name: 'correlation',
        tip: (k) => [
          element('b', {}, numberText(rho(Math.floor(k / n), k % n))),
          `${e.last_p.labels[Math.floor(k / n)]} and ${e.last_p.labels[k % n]}`,
        ],
      },
    ],
  });
}
