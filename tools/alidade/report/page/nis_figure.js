// SPDX-License-Identifier: Apache-2.0
// Figure "NIS of each sensor".

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
