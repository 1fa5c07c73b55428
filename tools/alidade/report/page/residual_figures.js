// SPDX-License-Identifier: Apache-2.0
// Figures of the residuals of a bundle adjustment: in the image plane, and of each camera.

/** The rms of each camera, before and after. A click selects the camera. */
function cameraFigure(select) {
  const {cameras} = BUNDLE;
  const [ids, observations] = [cameras.id, cameras.observations].map(columnOf);
  const x = Float64Array.from(ids, (_, i) => i);
  const tip = (y) => (i) => [
    element('b', {}, `camera ${ids[i]}`),
    `rms ${numberText(y[i])} px, ${plural(observations[i], 'observation')}`,
  ];
  const dotsOf = (name) => {
    const y = columnOf(cameras[name]);
    return {kind: 'dots', x, y, est: name, name, size: 2.6, alpha: 0.85, tip: tip(y)};
  };
  const labels = Array.from(ids, (id, i) => [i, String(id)]);
  const plot = new Plot({
    label: 'rms of a camera',
    name: 'rms of each camera',
    height: 330,
    x: {label: 'camera', ticks: labels, range: () => [-0.8, ids.length - 0.2]},
    y: {unit: 'px', log: true},
    layers: () => NAMES.map(dotsOf),
  });
  plot.over.addEventListener('click', () => {
    if (plot.hit) select(plot.hit.index);
  });
  const hint =
    'A camera far above the others has a wrong pose, wrong intrinsics or false matches. ' +
    'A click shows its residuals.';
  return {title: 'Rms of each camera', hint, plots: [plot]};
}

/** The residuals of all cameras, or of one. */
function residualScatter(selected, controls) {
  const {residuals} = BUNDLE;
  const camera = columnOf(residuals.camera);
  const only = (i) => selected() < 0 || camera[i] === selected();
  const dotsOf = (name) => {
    const [x, y] = residuals[name].map(columnOf);
    const alpha = name === 'after' ? 0.75 : 0.4;
    return {kind: 'dots', x, y, est: name, name, size: 1.5, alpha, only};
  };
  const [first, second] = residuals.elements;
  const range = (axis) => (layers) => {
    const after = layers.find(({est}) => est === 'after');
    const shownLayers = (after ? [after] : layers).map((layer) => ({
      [axis]: layer[axis].filter((_, i) => only(i)),
    }));
    return shownLayers.length ? symmetricRange(shownLayers, axis) : [-1, 1];
  };
  const plot = new Plot({
    label: second,
    name: 'residuals in the image plane',
    height: 330,
    equal: true,
    x: {label: first, unit: 'px', range: range('x')},
    y: {unit: 'px', range: range('y')},
    layers: () => NAMES.map(dotsOf),
  });
  const all = residuals.total > camera.length;
  const hint =
    'Measured minus predicted: a round cloud about 0. The axes fit 99 % of the residuals after ' +
    'the adjustment.' +
    (all
      ? ` Of ${count(residuals.total)} residuals, ${count(camera.length)} are drawn: the 1000 ` +
        'largest, and a part of the others at equal intervals.'
      : '');
  return {title: 'Residuals in the image plane', hint, plots: [plot], controls};
}

function residualFigures(box) {
  const ids = columnOf(BUNDLE.cameras.id);
  if (!ids.length || BUNDLE.residuals.elements.length < 2) return;
  const options = [[-1, 'all cameras'], ...Array.from(ids, (id, i) => [i, `camera ${id}`])];
  const select = element(
    'select',
    {class: 'btn small', 'aria-label': 'camera', onchange: redraw},
    options.map(([value, text]) => element('option', {value}, text)),
  );
  const grid = element('div', {class: 'cols'});
  box.append(grid);
  figure(grid, residualScatter(() => Number(select.value), select));
  const selectCamera = (index) => {
    select.value = index;
    redraw();
  };
  figure(grid, cameraFigure(selectCamera));
}
