// SPDX-License-Identifier: Apache-2.0
// Section "Measurements": which estimator used which measurement.

const LANE_HEIGHT = 26;

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

/** Heights of the ticks in each pixel column, from 0 to 1: {used, rejected, unused}. */
function ticksOfLane({I}, X, plot, top) {
  const {l, r} = plot.f;
  const width = Math.ceil(r - l) + 2;
  const ticks = {};
  for (const use of ['used', 'rejected', 'unused']) ticks[use] = new Float32Array(width);
  const raise = (use, time, height) => {
    const x = Math.round(X.to(time) - l);
    if (x >= 0 && x < width) ticks[use][x] = Math.max(ticks[use][x], height);
  };
  if (I.landmark !== undefined) {
    const frames = framesOf(I);
    frames.t.forEach((time, i) => {
      raise('used', time, frames.used[i] / top);
      if (frames.rejected[i]) raise('rejected', time, Math.max(0.3, frames.rejected[i] / top));
    });
    return ticks;
  }
  const times = columnOf(I.t);
  const outcomes = columnOf(I.outcome);
  const end = lower(times, page.x[1] + 1e-9);
  for (let i = lower(times, page.x[0]); i < end; i++) {
    const use = isUsed(outcomes[i]) ? 'used' : isRejected(outcomes[i]) ? 'rejected' : 'unused';
    raise(use, times[i], 1);
  }
  return ticks;
}

/** Paints the measurements of a sensor of an estimator, with their numbers. */
function paintLane(surface, X, plot, lane, y) {
  const {e, I} = lane;
  const {l, r} = plot.f;
  const isMap = I.landmark !== undefined;
  const top = isMap ? Math.max(1, ...framesOf(I).used, ...framesOf(I).rejected) : 1;
  const ticks = ticksOfLane(lane, X, plot, top);
  const alpha = dim(e.name);
  const width = clamp((0.7 * (r - l)) / distinctCount(columnOf(I.t)), 1, 4);
  const wide = Math.max(width, 1.5);
  surface.rect(l, y + 12, r - l, 10, {fill: colours.grid, alpha: 0.6});
  ticks.unused.forEach((height, x) => {
    if (height) surface.rect(l + x, y + 15, width, 4, {fill: colours.faint});
  });
  ticks.used.forEach((height, x) => {
    const style = {fill: colorOf(e.name), alpha: 0.85 * alpha};
    if (height) surface.rect(l + x - width / 2, y + 22 - 10 * height, width, 10 * height, style);
  });
  ticks.rejected.forEach((height, x) => {
    const size = 12 * Math.max(0.5, height);
    if (height) surface.rect(l + x - wide / 2, y + 10, wide, size, {fill: REJECTED(), alpha});
  });
  const rejected = rejectedCount(e, I.sensor);
  const used = e.counts[`accepted:${I.sensor}`] || 0;
  const most = isMap ? `, up to ${top} at a time` : '';
  const label = {size: 10.5, halo: true};
  surface.text(`${e.name} · ${I.sensor}`, l + 2, y + 5, {
    ...label,
    weight: 600,
    color: colorOf(e.name),
  });
  surface.text(`${count(used)} used, ${count(rejected)} rejected${most}`, r - 2, y + 5, {
    ...label,
    align: 'right',
    color: rejected ? REJECTED() : colours.muted,
  });
}

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
