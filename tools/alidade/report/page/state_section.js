// SPDX-License-Identifier: Apache-2.0
// Section "Estimates and errors".

/** Series of each element of a block; those of a quaternion are roll, pitch and yaw. */
const seriesMemo = new Map();

function series(e, b) {
  const key = e.name + '/' + b.name;
  if (seriesMemo.has(key)) return seriesMemo.get(key);
  const quat = b.geometry === 'unit_quaternion';
  const value = quat ? rollPitchYaw(b.value.map(columnOf)) : b.value.map(columnOf);
  const sigma = b.sigma.map(columnOf);
  const error = b.error.map(columnOf);
  const out = [];
  let truth = b.elements.map((k) => truthOf(b, k));
  if (quat && truth[0]) truth = rollPitchYaw(truth);
  value.forEach((v, k) =>
    out.push({
      label: quat ? ['roll', 'pitch', 'yaw'][k] : b.elements[k],
      unit: quat ? 'rad' : b.unit,
      value: v,
      truth: truth[k],
      bandless: quat,
      sigma: sigma[k],
    }),
  );
  const es = error.map((x, k) => ({
    label: b.tangent[k] || '',
    unit: b.error_unit,
    error: x,
    sigma: sigma[k],
  }));
  seriesMemo.set(key, {value: out, error: es});
  return seriesMemo.get(key);
}

function statePlots(block, what) {
  const es = RUN.estimators.filter((e) => e.blocks.some((b) => b.name === block));
  const first = es[0];
  const b0 = first.blocks.find((b) => b.name === block);
  const of = (e) =>
    series(
      e,
      e.blocks.find((b) => b.name === block),
    );
  const short = block.split('.').pop().replace(/_/g, ' ');
  const ps = [];
  const withError = es.find((e) => of(e).error.length);
  const add = (label, unit, zero, layers) =>
    ps.push({
      label,
      name: label + ' over time',
      time: true,
      last: false,
      height: first.blocks.find((b) => b.name === block).value.length > 1 ? 128 : zero ? 190 : 240,
      zero,
      first: !ps.length,
      y: {unit},
      layers,
    });
  if (what !== 'error' || !withError)
    of(first).value.forEach((q, k) =>
      add(`${short} ${q.label}`.trim(), q.unit, false, () => [
        ...es.map((e) => {
          const s = of(e).value[k];
          const t = columnOf(e.t);
          return (
            s.sigma &&
            !s.bandless && {
              kind: 'band',
              x: t,
              c: s.value,
              s: s.sigma,
              m: 3,
              est: e.name,
              fill: 0.09,
            }
          );
        }),
        ...RUN.implied
          .filter((i) => i.block === block && what !== 'value-only')
          .map((i) => ({
            kind: 'dots',
            x: columnOf(i.t),
            y: columnOf(i.v),
            color: () => colours.faint,
            size: 1.2,
            alpha: 0.75,
            fit: false,
            name: i.sensor,
          })),
        ...es.map((e) => ({
          kind: 'line',
          x: columnOf(e.t),
          y: of(e).value[k].value,
          s: of(e).value[k].bandless ? null : of(e).value[k].sigma,
          est: e.name,
          name: e.name,
        })),
        q.truth && {
          kind: 'line',
          x: columnOf(RUN.t),
          y: q.truth,
          ref: true,
          color: ink,
          dash: [6, 4],
          width: 1.4,
          name: 'truth',
        },
      ]),
    );
  if (what !== 'value' && withError)
    of(withError).error.forEach((q, k) =>
      add(`error of ${short} ${q.label}`.trim(), q.unit, true, () =>
        es
          .filter((e) => of(e).error[k])
          .flatMap((e) => {
            const s = of(e).error[k];
            const t = columnOf(e.t);
            return [
              s.sigma && {
                kind: 'band',
                x: t,
                s: s.sigma,
                m: 3,
                est: e.name,
                fill: 0.05,
                edge: true,
              },
              {kind: 'line', x: t, y: s.error, s: s.sigma, est: e.name, name: e.name},
            ];
          }),
      ),
    );
  ps[ps.length - 1].last = true;
  ps[ps.length - 1].height += 28;
  return ps.map((s) => new Plot(s));
}

function stateSection(main) {
  const box = element('div');
  const blocks = [];
  for (const e of RUN.estimators)
    for (const b of e.blocks)
      if (!blocks.some((q) => q.name === b.name)) blocks.push(b);
      else if (b.error.length) {
        const q = blocks.find((x) => x.name === b.name);
        if (!q.error.length) blocks[blocks.indexOf(q)] = b;
      }
  const usable = blocks.filter((b) => b.error.length || b.sigma.length);
  if (!usable.length) return;
  const s = section(
    'state',
    'Estimates and errors',
    'drag to zoom, double-click for all, click to keep the cursor',
    main,
  );
  const start = usable.find((b) => b.error.length) || usable[0];
  let block = start;
  let what =
    start.size > 1 || start.value.length > 1 ? (start.error.length ? 'error' : 'value') : 'both';
  let now = [];
  const build = () => {
    dispose(now);
    now = statePlots(block.name, what);
    const isError = what !== 'value' && block.error.length;
    setContent(box);
    figure(box, {
      title: block.name.replace('.', ' · ').replace(/_/g, ' '),
      plots: now,
      hint:
        (what !== 'error' || !isError
          ? 'Lines are estimates, bands ±3σ, the dashed line is truth' +
            (RUN.implied.some((i) => i.block === block.name)
              ? ', grey dots are what single measurements imply'
              : '') +
            '. '
          : '') +
        (isError
          ? 'Errors are estimate minus truth and should look like noise' +
            (block.sigma.length
              ? ', inside their 3σ band in all but 0.3 % of the frames.'
              : '.')
          : ''),
    });
  };
  s.append(
    element(
      'div',
      {class: 'side'},
      choice(
        '',
        usable.map((b) => [b.name, b.name.split('.').pop().replace(/_/g, ' ')]),
        start.name,
        (v) => {
          block = usable.find((b) => b.name === v);
          build();
        },
      ),
      choice(
        'show',
        [
          ['both', 'both'],
          ['error', 'error'],
          ['value', 'estimate'],
        ],
        what,
        (v) => {
          what = v;
          build();
        },
      ),
    ),
    box,
  );
  build();
}
