// SPDX-License-Identifier: Apache-2.0
// Histogram and autocorrelation of the innovations of a sensor.

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
