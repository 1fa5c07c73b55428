// SPDX-License-Identifier: Apache-2.0
// Section "Measurements": which estimator used which measurement.

/** The use of each measurement of a lane: 1 used, -1 rejected, 0 not valid. */
function useValues({e, I}) {
  const use = (code) => (isUsed(code) ? 1 : isRejected(code) ? -1 : 0);
  const y = Array.from(columnOf(I.outcome), use);
  return {x: columnOf(I.t), y, est: e.name, name: `${I.sensor} (1 used, -1 rejected)`};
}

function measurementSection(main) {
  const lanes = RUN.estimators.flatMap((e) => e.innovations.map((I) => ({e, I})));
  if (!lanes.length) return;
  const box = section('measurements', 'Measurements', 'used and rejected', main);
  const paint = (surface, X, Y, plot) => {
    let top = plot.f.t + 3;
    for (const lane of lanes.filter(({e}) => shown(e.name))) {
      paintLane(surface, X, plot, lane, top);
      top += LANE_HEIGHT;
    }
  };
  const plot = new Plot({
    label: '',
    name: 'use of measurements over time',
    time: true,
    noFit: true,
    height: lanes.length * LANE_HEIGHT + 46,
    y: {unit: '', rows: [], range: () => [0, lanes.length]},
    values: () => lanes.map(useValues),
    layers: () => [{kind: 'custom', x: null, paint}],
  });
  figure(box, {
    title: 'Used and rejected',
    hint:
      'A tick for each measurement; red: rejected; grey: not valid. The filter only predicts ' +
      'during a gap.',
    plots: [plot],
  });
  landmarkCountFigure(box, lanes);
}
