// SPDX-License-Identifier: Apache-2.0
// Painters of a map: grid, landmarks, trajectories, scale bar and legend.

/** A grid in the fitted plane. */
function paintFloor(surface, {basis, centre, scale, width, height, mode}, project) {
  const step = niceStep(Math.max(width, height) / scale / 9);
  const count = mode === 'top' ? 12 : 7;
  const [right, up, normal] = basis;
  const [a, b, c] = basis.map((axis) => dot3(axis, centre));
  const [a0, b0] = [Math.round(a / step) * step, Math.round(b / step) * step];
  const at = (i, j) => {
    const [u, v] = [a0 + i * step, b0 + j * step];
    return project([0, 1, 2].map((k) => u * right[k] + v * up[k] + c * normal[k]));
  };
  const lines = [];
  for (let i = -count; i <= count; i++) {
    lines.push(...at(i, -count), ...at(i, count), NaN, NaN);
    lines.push(...at(-count, i), ...at(count, i), NaN, NaN);
  }
  surface.path(lines, {stroke: colours.grid});
}

/** Draws the landmarks of an estimator at a time. Adds {place, map, i} of each to `spots`. */
function paintLandmarks(surface, view, map, time, options, spots) {
  const color = colorOf(map.name);
  const alpha = dim(map.name);
  const [present, removed, truths, errors] = [[], [], [], []];
  for (let i = 0; i < map.x.length; i++) {
    if (map.first_s[i] > time + 1e-9) continue;
    const place = view.project(landmarkAt(map, i));
    const isNear = (v, size) => v > -200 && v < size + 200;
    if (!isNear(place[0], view.width) || !isNear(place[1], view.height)) continue;
    const isRemoved = map.removed_s[i] <= time;
    (isRemoved ? removed : present).push(...place);
    spots.push({place, map, i});
    if (!isRemoved && options.ellipses) {
      const outline = view.ellipse(place, landmarkCovariance(map, i));
      surface.path(outline, {fill: color, alpha: 0.16 * alpha});
    }
    const truth = trueLandmarkAt(map, i);
    if (!isKnownPlace(truth)) continue;
    const truePlace = view.project(truth);
    truths.push(...truePlace);
    if (!isRemoved) errors.push(...place, ...truePlace, NaN, NaN);
  }
  surface.path(errors, {stroke: color, width: 1, alpha: 0.6 * alpha});
  surface.marks(truths, 'plus', 3.5, {stroke: colours.muted, width: 1.2, alpha: 0.9});
  surface.marks(removed, 'dot', 1.6, {fill: colours.faint, alpha: 0.5});
  surface.marks(present, 'dot', map.x.length > 500 ? 1.4 : 2.3, {fill: color, alpha});
}

/** The projected points of a trajectory from row `begin` to row `end`. */
function pathBetween(view, track, begin, end) {
  const step = Math.max(1, Math.floor((end - begin) / 3000));
  const points = [];
  const add = (i) => {
    const [x, y] = view.project(positionAt(track, i));
    points.push(x, Number.isFinite(x) ? y : NaN);
  };
  for (let i = begin; i < end; i += step) add(i);
  add(end);
  return points;
}

/** Draws the positions of a trajectory without times as triangles. */
function paintPlaces(surface, view, track) {
  const places = Array.from(track.t, (_, i) => view.project(positionAt(track, i))).flat();
  const style = {stroke: colorOf(track.name), width: 1.4, alpha: dim(track.name)};
  surface.marks(places, 'tri', 4, style);
}

/** Draws a trajectory up to row `end` in the colours of a quantity with the range `range`. */
function paintColouredPath(surface, view, track, end, valueAtRow, range) {
  const step = Math.max(1, Math.floor(end / 700));
  for (let i = 0; i < end; i += step) {
    const next = Math.min(i + step, end);
    const ends = [i, next].flatMap((row) => view.project(positionAt(track, row)));
    const share = (valueAtRow(track, next) - range[0]) / (range[1] - range[0]);
    surface.path(ends, {stroke: ramp(share), width: 3, alpha: dim(track.name)});
  }
}

/** Draws lines to the landmarks that an estimator measures at a time. */
function paintRays(surface, view, track, map, time, place) {
  const rows = new Map(Array.from(map.id, (id, i) => [id, i]));
  const [used, rejected] = [[], []];
  for (const I of track.e.innovations.filter((entry) => entry.landmark !== undefined)) {
    const [times, ids, outcomes] = [I.t, I.landmark, I.outcome].map(columnOf);
    for (let i = lower(times, time - 1e-9); i < times.length && times[i] <= time + 1e-9; i++) {
      const row = rows.get(ids[i]);
      if (row === undefined) continue;
      const end = view.project(landmarkAt(map, row));
      (isUsed(outcomes[i]) ? used : rejected).push(...place, ...end, NaN, NaN);
    }
  }
  const alpha = dim(track.name);
  surface.path(used, {stroke: colorOf(track.name), width: 0.8, alpha: 0.35 * alpha});
  surface.path(rejected, {stroke: REJECTED(), width: 1.4, alpha: 0.9 * alpha});
}

/** Draws the axes of the body. */
function paintTriad(surface, view, track, i, place) {
  if (!track.orientation) return;
  const [w, x, y, z] = track.orientation.map((column) => column[i]);
  const length = (0.07 * Math.min(view.width, view.height)) / view.scale;
  const axes = [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
  const origin = positionAt(track, i);
  axes.forEach((axis, k) => {
    const end = view.project(origin.map((v, j) => v + length * axis[j]));
    surface.path([...place, ...end], {stroke: colours.ink, width: 1.4, alpha: dim(track.name)});
    if (Math.hypot(end[0] - place[0], end[1] - place[1]) <= 12) return;
    surface.text('xyz'[k], end[0] + 4, end[1], {size: 10, color: colours.ink, halo: true});
  });
}

function paintScaleBar(surface, {scale, width, height}) {
  const metres = niceStep(Math.min(110, 0.16 * width) / scale);
  const end = 16 + metres * scale;
  const y = height - 16;
  const [factor, unit] = unitFor('m', metres);
  surface.path([16, y - 4, 16, y, end, y, end, y - 4], {stroke: colours.ink, width: 1.5});
  const text = `${+(metres * factor).toPrecision(3)} ${unit}`;
  const style = {align: 'center', color: colours.ink, halo: true};
  surface.text(text, (16 + end) / 2, y - 9, style);
}

/** Draws the axes of the world. */
function paintWorldAxes(surface, {axes, height}) {
  const [x, y] = [34, height - 70];
  const [right, up] = axes;
  for (const k of [0, 1, 2]) {
    const at = (length) => [x + length * right[k], y - length * up[k]];
    const end = at(22);
    surface.path([x, y, ...end], {stroke: colours.muted, width: 1.2});
    if (Math.hypot(end[0] - x, end[1] - y) <= 5) continue;
    const style = {align: 'center', size: 10.5, color: colours.muted};
    surface.text('xyz'[k], ...at(29), style);
  }
}

const RAMP_NAMES = {error: 'position error', sigma: 'position σ', time: 'time'};

/** Draws the legend of the colours of trajectories. */
function paintRamp(surface, {width, height}, paintBy, range) {
  const left = width - 196;
  const [factor, unit] = unitFor(paintBy === 'time' ? 's' : 'm', range[1]);
  for (let i = 0; i < 60; i++)
    surface.rect(left + i * 3, height - 24, 3.2, 8, {fill: ramp(i / 59)});
  const title = `${RAMP_NAMES[paintBy]} [${unit}]`;
  surface.text(title, left, height - 33, {color: colours.ink, halo: true});
  surface.text(numberText(range[0] * factor), left, height - 8, {size: 10.5});
  const style = {size: 10.5, align: 'right'};
  surface.text(numberText(range[1] * factor), left + 180, height - 8, style);
}
