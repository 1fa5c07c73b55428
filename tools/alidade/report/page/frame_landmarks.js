// SPDX-License-Identifier: Apache-2.0
// Figure "Landmarks of each frame".

/** Landmarks of each frame, and the rms of their innovations, for each sensor of landmarks. */
function landmarkCountFigure(box, lanes) {
  const hasFrames = (I) => I.landmark !== undefined && I.dof && framesOf(I).t.length > 1;
  const maps = lanes.filter(({I}) => hasFrames(I));
  const sensors = unique(maps.map(({I}) => I.sensor));
  if (!sensors.length) return;
  const plots = sensors.flatMap((sensor, i) => {
    const users = maps.filter(({I}) => I.sensor === sensor);
    const isLast = i === sensors.length - 1;
    return [countPlot(sensor, users, !i), rmsPlot(sensor, users, isLast)];
  });
  figure(box, {
    title: 'Landmarks of each frame',
    hint: 'Numbers of used and rejected landmarks, and the distance from their predictions.',
    plots,
  });
}

function countPlot(sensor, users, isFirst) {
  const most = Math.max(1, ...users.map(({I}) => Math.max(...framesOf(I).used)));
  return new Plot({
    label: `${sensor}: landmarks of a frame`,
    time: true,
    last: false,
    first: isFirst,
    height: 110,
    noFit: true,
    y: {unit: '', range: () => [0, 1.1 * most]},
    layers: () =>
      users.flatMap(({e, I}) => {
        const frames = framesOf(I);
        return [
          {kind: 'line', x: frames.t, y: frames.used, est: e.name, name: e.name},
          rejectedLayer(e, frames.t, frames.rejected, (k) => frames.rejected[k] > 0),
        ];
      }),
  });
}

const rmsPlot = (sensor, users, isLast) =>
  new Plot({
    label: `${sensor}: rms of the innovations`,
    time: true,
    last: isLast,
    height: isLast ? 140 : 110,
    y: {unit: users[0].I.unit},
    layers: () =>
      users.map(({e, I}) => {
        const frames = framesOf(I);
        return {kind: 'line', x: frames.t, y: frames.rms, est: e.name, name: e.name};
      }),
  });
