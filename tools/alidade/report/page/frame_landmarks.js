// SPDX-License-Identifier: Apache-2.0
// Figure "Landmarks of each frame".

/** Landmarks of each frame, and the rms of their innovations, for each sensor of landmarks. */
function landmarkCountFigure(box, lanes) {
  const hasFrames = (I) => I.landmark !== undefined && I.dof && framesOf(I).t.length > 1;
  const maps = lanes.filter(({e, I}) => hasFrames(I) && !isThinned(e, I));
  const sensors = unique(maps.map(({I}) => I.sensor));
  if (!sensors.length) return;
  const changes = changePlots(unique(maps.map(({e}) => e)));
  const plots = sensors.flatMap((sensor, i) => {
    const users = maps.filter(({I}) => I.sensor === sensor);
    const isLast = i === sensors.length - 1;
    return [countPlot(sensor, users, !i), rmsPlot(sensor, users, isLast)];
  });
  figure(box, {
    title: 'Landmarks of each frame',
    hint:
      'Numbers of used and rejected landmarks, and the distance from their predictions.' +
      (changes.length ? ' Above: landmarks in the state, and those that are new or removed.' : ''),
    plots: [...changes, ...plots],
  });
}

/** Changes of the map at each time: {t, added, removed, present}, a list each. */
const mapChanges = once((e) => {
  const {first_s: first, removed_s: removed} = mapColumns(e);
  const times = Float64Array.from(
    unique([...first, ...removed].filter(Number.isFinite)).sort((a, b) => a - b),
  );
  const changes = {t: times, added: [], removed: [], present: []};
  const countAt = (column) => {
    const counts = new Map();
    for (const time of column) counts.set(time, (counts.get(time) || 0) + 1);
    return Array.from(times, (time) => counts.get(time) || 0);
  };
  changes.added = countAt(first);
  changes.removed = countAt(removed);
  let present = 0;
  changes.present = changes.added.map((n, i) => (present += n - changes.removed[i]));
  return changes;
});

/** A line that consists of a stick from zero to y at each time. */
const sticks = (x, y) => ({
  x: Float64Array.from({length: 3 * x.length}, (_, i) => x[Math.floor(i / 3)]),
  y: Float64Array.from({length: 3 * x.length}, (_, i) => [y[Math.floor(i / 3)], 0, NaN][i % 3]),
});

/** The numbers of landmarks in the state, and of new and removed ones. */
function changePlots(estimators) {
  const users = estimators.filter((e) => e.landmarks && mapChanges(e).t.length);
  if (!users.length) return [];
  const topOf = (key) => Math.max(1, ...users.flatMap((e) => mapChanges(e)[key]));
  const end = page.full[1];
  const plotOf = (label, range, layers, first) =>
    new Plot({
      label,
      name: label,
      time: true,
      last: false,
      first,
      height: 100,
      noFit: true,
      y: {unit: '', range: () => range},
      layers,
    });
  const inState = users.map((e) => {
    const {t, present} = mapChanges(e);
    const x2 = Array.from(t, (_, i) => (i + 1 < t.length ? t[i + 1] : end));
    return {kind: 'line', step: true, x: t, x2, y: present, est: e.name, name: e.name};
  });
  const changed = users.flatMap((e) => {
    const {t, added, removed} = mapChanges(e);
    const down = removed.map((n) => -n);
    return [
      {kind: 'line', ...sticks(t, added), est: e.name, name: `${e.name} new`},
      {kind: 'line', ...sticks(t, down), est: e.name, name: `${e.name} removed`, color: REJECTED},
    ];
  });
  const most = [-1.15 * topOf('removed'), 1.15 * topOf('added')];
  return [
    plotOf('landmarks in the state', [0, 1.15 * topOf('present')], () => inState, true),
    plotOf('landmarks: new (up), removed (down)', most, () => changed, false),
  ];
}

function countPlot(sensor, users, isFirst) {
  const most = Math.max(1, ...users.map(({I}) => maxOf(framesOf(I).used)));
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
