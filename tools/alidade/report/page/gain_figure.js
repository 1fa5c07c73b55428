// SPDX-License-Identifier: Apache-2.0
// Figures of the Kalman gain over time.

const gainSensors = () => unique(RUN.estimators.flatMap((e) => e.gains.map((g) => g.sensor)));

/** The gains of a sensor: a plot for each element of K. */
function gainFigure(sensor) {
  const users = RUN.estimators
    .map((e) => ({e, gain: e.gains.find((g) => g.sensor === sensor)}))
    .filter(({gain}) => gain);
  const names = unique(users.flatMap(({gain}) => gain.columns.map((column) => column.name)));
  const plots = names.map((name, k) => {
    const isLast = k === names.length - 1;
    const lines = () =>
      users.flatMap(({e, gain}) =>
        gain.columns
          .filter((column) => column.name === name)
          .map((column) => {
            const x = columnOf(gain.t);
            const gap = 6 * medianStep(x);
            return {kind: 'line', x, y: columnOf(column.v), est: e.name, name: e.name, gap};
          }),
      );
    return new Plot({
      label: name.replace('<-', ' ← '),
      time: true,
      last: isLast,
      height: isLast ? 130 : 102,
      y: {unit: ''},
      layers: lines,
    });
  });
  return {
    title: sensor,
    hint:
      'The columns of the gain K of this sensor. Zero: the sensor does not correct this element. ' +
      'The gain should settle. A jump is a change of the geometry, a reset, or a gap before it.',
    plots,
  };
}
