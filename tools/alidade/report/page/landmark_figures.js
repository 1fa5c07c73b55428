// SPDX-License-Identifier: Apache-2.0
// Figures of landmarks: errors, and innovations in the image plane.

function landmarkFigures(parent) {
  const grid = element('div', {class: 'cols'});
  parent.append(grid);
  landmarkErrorFigure(grid);
  const views = RUN.estimators.flatMap((e) =>
    e.innovations
      .filter((I) => I.landmark !== undefined && I.dof >= 2 && I.dof <= 3)
      .filter((I) => I.r.length >= 2 && columnOf(I.r[0]).some(Number.isFinite))
      .map((I) => ({e, I})),
  );
  const sensors = unique(views.map(({I}) => I.sensor)).slice(0, 2);
  for (const sensor of sensors)
    scatterFigure(
      grid,
      sensor,
      views.filter(({I}) => I.sensor === sensor),
    );
}

/** Lines error = sigma and error = 3 sigma. */
function paintSigmaLines(surface, X, Y, plot) {
  for (const [factor, label] of [
    [1, 'σ'],
    [3, '3σ'],
  ]) {
    const color = factor > 1 ? REJECTED() : colours.muted;
    const line = [X.to(X.lo), Y.to(factor * X.lo), X.to(X.hi), Y.to(factor * X.hi)];
    surface.path(line, {stroke: color, dash: [5, 4]});
    const x = Math.min(X.hi, Y.hi / factor);
    const y = Math.max(plot.f.t + 8, Y.to(factor * x) + 10);
    surface.text(label, X.to(x) - 16, y, {color, halo: true});
  }
}

function landmarkErrorFigure(box) {
  const estimators = RUN.estimators.filter(
    (e) => e.landmarks && columnOf(e.landmarks.tx).some(Number.isFinite),
  );
  if (!estimators.length) return;
  const layers = estimators.map((e) => {
    const map = {name: e.name, ...mapColumns(e)};
    const indices = Array.from(map.x.keys());
    return {
      kind: 'dots',
      x: indices.map((i) => Math.hypot(map.sx[i], map.sy[i], map.sz[i]) || NaN),
      y: indices.map(
        (i) => Math.hypot(map.x[i] - map.tx[i], map.y[i] - map.ty[i], map.z[i] - map.tz[i]) || NaN,
      ),
      est: e.name,
      name: e.name,
      size: 3.2,
      alpha: 0.75,
      tip: (i) => landmarkTip({map, i}),
    };
  });
  figure(box, {
    title: 'Landmarks: error against σ',
    hint: 'Most landmarks should be below the line 3σ; above it, σ is too small.',
    plots: [
      new Plot({
        height: 300,
        label: 'error',
        name: 'landmark error against sigma',
        x: {label: 'σ of the position', unit: 'm', log: true},
        y: {unit: 'm', log: true},
        layers: () => [{kind: 'custom', x: null, paint: paintSigmaLines}, ...layers],
      }),
    ],
  });
}

/** Symmetric range that contains 99 % of the values of an axis. */
function symmetricRange(layers, axis) {
  const values = [];
  for (const layer of layers) {
    const step = Math.max(1, Math.floor(layer[axis].length / 2000));
    for (let i = 0; i < layer[axis].length; i += step) values.push(Math.abs(layer[axis][i]));
  }
  const top = 1.3 * quantiles(values, [0.99])[0] || 1;
  return [-top, top];
}

function scatterFigure(box, sensor, views) {
  const layers = () =>
    views.flatMap(({e, I}) => {
      const outcomes = columnOf(I.outcome);
      const [x, y] = I.r.map(columnOf);
      const accepted = {
        kind: 'dots',
        x,
        y,
        est: e.name,
        name: e.name,
        size: 1.3,
        alpha: 0.6,
        only: (i) => isAccepted(outcomes[i]),
      };
      return [accepted, rejectedLayer(e, x, y, (i) => isRejected(outcomes[i]))];
    });
  const unit = views[0].I.unit;
  figure(box, {
    title: `${sensor}: innovations in the plane of the measurement`,
    hint:
      'A round cloud about 0. An offset: bias or calibration. An ellipse or arms: motion that ' +
      'the model lacks. Crosses are rejected measurements.',
    plots: [
      new Plot({
        height: 300,
        label: 'second element',
        name: 'innovation scatter',
        equal: true,
        x: {label: 'first element', unit, range: (visible) => symmetricRange(visible, 'x')},
        y: {unit, range: (visible) => symmetricRange(visible, 'y')},
        layers,
      }),
    ],
  });
}
