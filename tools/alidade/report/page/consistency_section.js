// SPDX-License-Identifier: Apache-2.0
// Section "Consistency": NEES, NIS and whiteness of the innovations.

/** Zone that contains 95 % of chi-square / dof. */
const chiSquareZone = (dof) => ({
  kind: 'hband',
  lo: chi2inv(0.025, dof) / dof,
  hi: chi2inv(0.975, dof) / dof,
  ...GOOD_ZONE,
});

/** A plot over time on a logarithmic axis; the last of several has the time labels. */
const logPlot = (spec, i, count) =>
  new Plot({
    time: true,
    first: !i,
    last: i === count - 1,
    height: i === count - 1 ? 160 : 132,
    y: {log: true, unit: ''},
    ...spec,
  });

function consistencySection(main) {
  const sensors = unique(RUN.estimators.flatMap((e) => e.innovations.map((I) => I.sensor)));
  const hasNis = (e, sensor) => {
    const I = innovationsOf(e, sensor);
    return I && columnOf(I.nis).some(Number.isFinite);
  };
  const tested = sensors.filter((sensor) => RUN.estimators.some((e) => hasNis(e, sensor)));
  const hasNees = RUN.estimators.some((e) => e.nees.length);
  if (!tested.length && !hasNees) return;
  const box = section('consistency', 'Consistency', 'are the errors as large as σ?', main);
  neesFigure(box);
  if (!tested.length) return;
  nisFigure(box, tested);
  fold(
    box,
    'Whiteness of the innovations',
    'histogram and autocorrelation, sensor by sensor',
    (parent) => tested.forEach((sensor) => whitenessFigures(parent, sensor)),
  );
}

function neesFigure(box) {
  const all = RUN.estimators.flatMap((e) => e.nees);
  const owners = unique(all.map((nees) => nees.owner));
  if (!owners.length) return;
  const plotOf = (owner, i) => {
    const {dof} = all.find((nees) => nees.owner === owner);
    const lines = () =>
      RUN.estimators.map((e) => {
        const nees = e.nees.find((q) => q.owner === owner);
        if (!nees || isZero(nees.v)) return null;
        const y = columnOf(nees.v);
        return {kind: 'line', x: columnOf(e.t), y, est: e.name, name: e.name, width: 1.3};
      });
    const label = `NEES of ${owner}, ${plural(dof, 'degree')} of freedom`;
    const one = {kind: 'h', v: 1, color: () => colours.muted, dash: [2, 3]};
    const layers = () => [chiSquareZone(dof), one, ...lines()];
    return logPlot({label, name: 'NEES of ' + owner, layers}, i, owners.length);
  };
  figure(box, {
    title: 'NEES over time',
    hint:
      'Squared error by the covariance P that the estimator reports, per degree of freedom. ' +
      'Consistent: 95 % of the timestamps are in the green zone. Above: overconfident. ' +
      'Below: underconfident.',
    plots: owners.map(plotOf),
  });
}

/** Layers of the NIS of an estimator: used and rejected measurements. */
function nisLayers(e, I) {
  const x = columnOf(I.t);
  const outcomes = columnOf(I.outcome);
  const isDense = x.length > 3000;
  const used = {
    kind: 'dots',
    x,
    y: nisOf(I),
    est: e.name,
    name: e.name,
    size: isDense ? 1.1 : 1.7,
    alpha: isDense ? 0.5 : 0.85,
    shape: isDense ? 'square' : 'dot',
    only: (i) => isUsed(outcomes[i]),
  };
  return [used, rejectedLayer(e, x, nisWithRejected(I), (i) => isRejected(outcomes[i]))];
}

function nisFigure(box, sensors) {
  const plotOf = (sensor, i) => {
    const users = RUN.estimators.filter((e) => innovationsOf(e, sensor));
    const dof = innovationsOf(users[0], sensor).dof || 1;
    const gates = unique(users.map((e) => e.gate).filter(Boolean)).map((gate) => ({
      kind: 'h',
      v: chi2inv(gate, dof) / dof,
      color: REJECTED,
      text: `gate ${+(gate * 100).toFixed(4)} %`,
    }));
    const layers = () => [
      chiSquareZone(dof),
      ...gates,
      ...users.flatMap((e) => nisLayers(e, innovationsOf(e, sensor))),
    ];
    return logPlot({label: sensor, name: 'NIS of ' + sensor, layers}, i, sensors.length);
  };
  const counts = sensors.map((sensor) => {
    const rejected = sum(RUN.estimators.map((e) => rejectedCount(e, sensor)));
    return `${sensor} ${count(rejected)}`;
  });
  figure(box, {
    title: 'NIS of each sensor',
    plots: sensors.map(plotOf),
    hint:
      'Squared innovation by its predicted covariance S, per degree of freedom; the green zone ' +
      `contains 95 %. Crosses are rejected measurements, all of them (${counts.join(', ')}); ` +
      'those without NIS are on the upper edge.',
  });
}

function whitenessFigures(box, sensor) {
  const users = RUN.estimators.filter((e) => {
    const I = innovationsOf(e, sensor);
    return I && I.dof && normalisedOf(I).landmarks.length > 20;
  });
  if (!users.length) return;
  const grid = element('div', {class: 'cols'});
  box.append(grid);
  histogramFigure(grid, sensor, users);
  autocorrelationFigure(grid, sensor, users);
}

function histogramFigure(box, sensor, users) {
  const width = 0.2;
  const edges = Array.from({length: 41}, (_, i) => -4 + i * width);
  const histogram = (e) => {
    const values = normalisedOf(innovationsOf(e, sensor)).values.flat();
    const bins = new Float64Array(40);
    for (const v of values) bins[clamp(Math.floor((v + 4) / width), 0, 39)]++;
    const y = Array.from(bins, (n) => n / values.length / width);
    const x2 = edges.slice(1);
    const x = edges.slice(0, 40);
    return {kind: 'line', step: true, x, x2, y, est: e.name, name: e.name, width: 1.8};
  };
  const density = {
    kind: 'line',
    color: ink,
    dash: [5, 4],
    x: edges,
    y: edges.map((v) => Math.exp((-v * v) / 2) / Math.sqrt(2 * Math.PI)),
    name: 'N(0, 1)',
  };
  const top = (layers) => Math.max(0.45, ...layers.filter((L) => L.step).flatMap((L) => L.y));
  figure(box, {
    title: `${sensor}: normalised innovations`,
    hint:
      'They should follow the dashed N(0, 1). Narrower: R or Q is too large. Wider, or with ' +
      'heavy tails: R or Q is too small, or there are outliers.',
    plots: [
      new Plot({
        height: 210,
        name: 'histogram',
        x: {label: 'innovation / σ', range: () => [-4, 4]},
        y: {unit: '', range: (layers) => [0, top(layers) * 1.08]},
        layers: () => [...users.map(histogram), density],
      }),
    ],
  });
}

function autocorrelationFigure(box, sensor, users) {
  const of = (e) => normalisedOf(innovationsOf(e, sensor));
  const lags = Math.min(30, Math.floor(Math.min(...users.map((e) => of(e).landmarks.length)) / 4));
  if (lags < 3) return;
  const results = new Map(users.map((e) => [e.name, autocorrelation(of(e), lags)]));
  const x = Array.from({length: lags}, (_, i) => i + 1);
  const layers = () => {
    const visible = users.filter((e) => shown(e.name));
    const bounds = (visible.length ? visible : users).map((e) => results.get(e.name).bound(1));
    const bound = Math.max(...bounds);
    const lines = users.flatMap((e) => {
      const y = x.map((lag) => results.get(e.name).rho[lag]);
      return [
        {kind: 'line', x, y, est: e.name, name: e.name},
        {kind: 'dots', x, y, est: e.name, size: 2.4},
      ];
    });
    return [{kind: 'hband', lo: -bound, hi: bound, ...GOOD_ZONE}, ...lines];
  };
  const range = (visible) => {
    const values = visible.filter((L) => L.kind === 'line').flatMap((L) => L.y.map(Math.abs));
    const top = 1.1 * Math.max(0.3, ...values);
    return [-top, top];
  };
  const isMap = innovationsOf(users[0], sensor).landmark !== undefined;
  const label = isMap ? 'lag, in observations of a landmark' : 'lag, in measurements';
  figure(box, {
    title: `${sensor}: autocorrelation`,
    hint:
      'White innovations stay inside the zone. A slow decrease: the model lags behind, or Q is ' +
      'too small.',
    plots: [
      new Plot({
        height: 210,
        name: 'autocorrelation',
        x: {label, range: () => [0, lags + 1]},
        y: {unit: '', range},
        layers,
      }),
    ],
  });
}
