// SPDX-License-Identifier: Apache-2.0
// Axes of a plot: ticks, labels, shaded segments and events.

function paintSegments(surface, {spec, f, X}) {
  if (!spec.time || !RUN) return;
  for (const segment of shaded())
    for (const [from, to] of segment.spans) {
      if (to <= page.x[0] || from >= page.x[1]) continue;
      const left = Math.max(f.l, X.to(from));
      const right = Math.min(f.r, X.to(to));
      surface.rect(left, f.t, right - left, f.b - f.t, {fill: colours.shade});
      const style = {size: 10, color: colours.faint};
      const hasRoom = right - left > 8 + 6 * segment.name.length;
      if (spec.first && hasRoom) surface.text(segment.name, left + 4, f.b - 7, style);
    }
}

/** Names of the categories of the y axis. */
function paintRows(surface, {spec, f, Y}) {
  const characterWidth = 6.3;
  spec.y.rows.forEach((name, i) => {
    const isEstimator = NAMES.includes(name);
    const room = Math.floor((f.l - 14) / characterWidth);
    const text = name.length * characterWidth > f.l - 8 ? name.slice(0, room) + '…' : name;
    surface.text(text, f.l - 8, Y.to(i), {
      align: 'right',
      color: isEstimator ? colorOf(name) : colours.muted,
      weight: isEstimator ? 600 : 400,
    });
    surface.path([f.l, Y.to(i + 0.5), f.r, Y.to(i + 0.5)], {stroke: colours.grid});
  });
}

function paintYTicks(surface, {spec, f, Y, factor}) {
  for (const [value, label] of ticks(Y, factor, Math.max(3, (f.b - f.t) / 32))) {
    const y = Math.round(Y.to(value)) + 0.5;
    if (y < f.t - 1 || y > f.b + 1) continue;
    const stroke = value === 0 && !spec.y.log ? colours.line : colours.grid;
    surface.path([f.l, y, f.r, y], {stroke});
    surface.text(label, f.l - 7, y, {align: 'right'});
  }
}

/** Labels of given ticks. A label that would touch the previous one is omitted. */
function paintGivenTicks(surface, {f, X}, given) {
  let end = -Infinity;
  for (const [value, label] of given) {
    const x = X.to(value);
    const half = 3.4 * label.length;
    if (x - half < end + 6) continue;
    end = x + half;
    surface.text(label, x, f.b + 11, {align: 'center'});
  }
}

/** Grid lines and labels of the x axis. Times are those of the files. */
function paintXTicks(surface, {spec, f, X}, factor) {
  const offset = spec.time ? T0 : 0;
  const axis = {...X, lo: X.lo + offset, hi: X.hi + offset};
  for (const [value, label] of ticks(axis, factor, (f.r - f.l) / 80)) {
    const x = X.to(value - offset);
    if (x < f.l - 1 || x > f.r + 1) continue;
    surface.path([Math.round(x) + 0.5, f.t, Math.round(x) + 0.5, f.b], {stroke: colours.grid});
    if (spec.last !== false) surface.text(label, x, f.b + 11, {align: 'center'});
  }
}

function paintXAxis(surface, plot) {
  const {spec, f, X} = plot;
  const x = spec.x || {};
  const [factor, unit] = spec.time
    ? [1, 's']
    : unitFor(x.unit, Math.max(Math.abs(X.lo), Math.abs(X.hi)));
  if (x.ticks) paintGivenTicks(surface, plot, x.ticks);
  else if (spec.time || spec.last !== false) paintXTicks(surface, plot, factor);
  if (spec.last === false) return;
  const label = spec.time ? 'time [s]' : x.label && x.label + (unit ? ` [${unit}]` : '');
  if (label) surface.text(label, f.r, f.b + 26, {align: 'right', size: 11});
}

function paintEvents(surface, {spec, f, X}) {
  if (!spec.time || !RUN) return;
  for (const [name, [time]] of eventsNear()) {
    if (time === null || time < page.x[0] || time > page.x[1]) continue;
    surface.rect(X.to(time) - 1, f.t, 2, 6, {fill: colorOf(name), alpha: dim(name)});
  }
}
