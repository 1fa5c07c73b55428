// SPDX-License-Identifier: Apache-2.0
// Lanes of ticks: the measurements of a sensor that an estimator used or rejected.

const LANE_HEIGHT = 26;

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
  const top = isMap ? Math.max(1, maxOf(framesOf(I).used), maxOf(framesOf(I).rejected)) : 1;
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
  const used = usedCount(e, I.sensor);
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
