// SPDX-License-Identifier: Apache-2.0
// Section "Map", with the buttons and the slider of the views.

/** A button that plays the run in ten seconds. */
function playButton() {
  let timer = 0;
  const button = element('button', {class: 'btn small'}, '▶ play');
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    button.textContent = '▶ play';
  };
  const advance = () => {
    page.time = Math.min(page.time + (page.full[1] - page.full[0]) / 300, page.full[1]);
    if (page.time === page.full[1]) stop();
    cursorMoved();
  };
  button.addEventListener('click', () => {
    if (timer) {
      stop();
      return;
    }
    button.textContent = '❚❚ stop';
    page.cursor = null;
    if (page.time === null || page.time >= page.full[1]) page.time = page.full[0];
    timer = setInterval(advance, 33);
  });
  return button;
}

/** The slider of the time. `map` moves it when it is drawn. */
function timeSlider(map) {
  const oninput = (event) => {
    const share = event.target.value / 1000;
    page.cursor = null;
    page.time = page.full[0] + share * (page.full[1] - page.full[0]);
    redraw();
  };
  const props = {type: 'range', min: 0, max: 1000, value: 1000, 'aria-label': 'time', oninput};
  const input = element('input', props);
  const label = element('span', {}, '');
  map.onTime = (time) => {
    const share = (time - page.full[0]) / (page.full[1] - page.full[0]);
    input.value = Math.round(1000 * share);
    label.textContent = clock(time) + ' s';
  };
  return element('div', {class: 'slider'}, playButton(), input, label);
}

function colourChoice(map) {
  const {options} = map;
  const hasSigma = map.tracks.some(({sigma}) => sigma.length);
  const items = [
    ['estimator', 'estimator'],
    map.truth && ['error', 'error'],
    hasSigma && ['sigma', 'σ'],
    HAS_TIMES && ['time', 'time'],
  ];
  const known = items.filter(Boolean);
  if (known.length < 2) return null;
  return choice('colour', known, options.paintBy, (value) => {
    options.paintBy = value;
    redraw();
  });
}

/** Buttons of all views. */
function mapButtons(maps) {
  const [map] = maps;
  const scaleBy = (factor) => () => {
    for (const {view} of maps) view.scale *= factor;
    redraw();
  };
  const small = (label, title, onclick) =>
    element('button', {class: 'btn small', title, 'aria-label': title, onclick}, label);
  const modes = [
    ['top', 'top'],
    ['side', 'side'],
  ];
  const modeChoice = choice('view', modes, 'top', (mode) => {
    map.view.look(mode);
    redraw();
  });
  const toggleEllipses = (event) => {
    map.options.ellipses = !map.options.ellipses;
    event.target.setAttribute('aria-pressed', map.options.ellipses);
    redraw();
  };
  const props = {class: 'btn small', 'aria-pressed': 'true', onclick: toggleEllipses};
  const zoom = [
    small('+', 'zoom in', scaleBy(1.3)),
    small('−', 'zoom out', scaleBy(1 / 1.3)),
    small('fit', 'fit all', scaleBy(0)),
    map.tracks.some(({sigma}) => sigma.length) && element('button', props, '3σ ellipses'),
  ];
  return [modeChoice, colourChoice(map), element('span', {class: 'group'}, zoom)];
}

function mapHint(map, hasLandmarks) {
  const hasMeasurements = RUN.estimators.some((e) => e.innovations.length);
  const texts = [
    map.truth && 'Dashed: truth.',
    `Left: ${map.planeName}, seen from above. Right: drag to turn, shift-drag to move; click, ` +
      'then use the wheel, to zoom.',
    HAS_TIMES && 'Both show the time of the slider and follow the cursor of the plots.',
    hasLandmarks && hasMeasurements && 'Rays lead to the landmarks seen then, red if rejected.',
    DATA.bundle && bundleMapHint(map),
  ];
  return texts.filter(Boolean).join(' ');
}

/** The map, if an estimator has a position in a plane or in space. */
function mapSection(main) {
  const hasPosition = (e) =>
    e.position && e.blocks.find((b) => b.name === e.position).value.length > 1;
  if (!RUN.estimators.some(hasPosition)) return;
  const box = section('map', 'Map', '', main);
  const top = new MapView('top');
  const oblique = new MapView('3d', top);
  if (HAS_TIMES) top.extra = [timeSlider(top)];
  const hasLandmarks = top.maps.length > 0;
  const subject = hasLandmarks ? 'Trajectory and landmarks' : 'Trajectory';
  figure(box, {
    title: DATA.bundle ? 'Cameras and points' : subject,
    hint: mapHint(top, hasLandmarks),
    plots: [top, oblique],
    controls: mapButtons([top, oblique]),
    className: 'maps',
  });
  if (hasLandmarks) landmarkFigures(box);
}
