// SPDX-License-Identifier: Apache-2.0
// Figure of CPU time against error.

/** The points that no other point beats in both cost and error, by cost. */
function paretoFront(points) {
  let best = Infinity;
  return points
    .slice()
    .sort((a, b) => a.cost - b.cost)
    .filter(({error}) => {
      const isBetter = error < best;
      if (isBetter) best = error;
      return isBetter;
    });
}

/** Writes the names beside the points, so that they do not overlap. */
function paintNames(surface, X, Y, plot, points) {
  const taken = [];
  for (const {name, cost, error} of points) {
    const width = name.length * 6.4;
    let x = X.to(cost) + 9;
    let y = Y.to(error) - 1;
    if (x + width > plot.f.r) x -= width + 20;
    const overlaps = (q) => Math.abs(q.y - y) < 12 && x < q.x + q.width && q.x < x + width;
    while (taken.some(overlaps)) y += 12;
    taken.push({x, y, width});
    surface.text(name, x, y, {color: colorOf(name), weight: 600, halo: true});
  }
}

function costFigure(block) {
  const unit = unitOfBlock(block);
  const all = COMPARISON.estimators
    .map((e) => ({
      name: e.name,
      smoothed: e.smoothed,
      cost: comparedValue(e, 'cpu_us') * 1e-6,
      error: comparedValue(e, 'rmse:' + block),
    }))
    .filter(({cost, error}) => cost > 0 && error > 0);
  if (all.length < 2) return null;
  const visible = () => all.filter(({name}) => shown(name));
  const frontOf = (smoothed) => {
    const front = paretoFront(visible().filter((p) => p.smoothed === smoothed));
    return {
      kind: 'line',
      x: front.map(({cost}) => cost),
      y: front.map(({error}) => error),
      color: () => colours.faint,
      dash: smoothed ? [2, 3] : [5, 4],
      width: 1.2,
    };
  };
  const dotOf = ({name, smoothed, cost, error}) => ({
    kind: 'dots',
    x: [cost],
    y: [error],
    est: name,
    size: 5,
    shape: smoothed ? 'square' : 'dot',
    tip: () => [
      nameOf(name),
      element('br'),
      `${withUnit(cost, 's')} a frame, RMSE ${withUnit(error, unit)}`,
    ],
  });
  const paint = (surface, X, Y, plot) => paintNames(surface, X, Y, plot, visible());
  const plot = new Plot({
    label: `RMSE of ${block}`,
    name: 'cost against error',
    height: 290,
    x: {label: 'CPU time of a frame', unit: 's', log: true},
    y: {unit, log: true},
    layers: () => [
      frontOf(false),
      frontOf(true),
      ...visible().map(dotOf),
      {kind: 'custom', x: null, paint},
    ],
  });
  return {
    title: 'Cost against error',
    hint:
      'Down and left is better. The lines join the estimators that no other estimator beats in ' +
      'both. Dots: online. Squares: smoothed.',
    plots: [plot],
  };
}
