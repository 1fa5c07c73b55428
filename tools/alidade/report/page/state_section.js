// SPDX-License-Identifier: Apache-2.0
// Section "Estimates and errors".

const elementMemo = newCache();

/**
 * Elements of a block of an estimator: {values, errors}, lists of {label, unit, y, sigma, truth}.
 * The values of a quaternion are roll, pitch and yaw; they have no band.
 */
function elementsOf(e, block) {
  const key = e.name + '/' + block.name;
  if (!elementMemo.has(key)) elementMemo.set(key, computeElements(block));
  return elementMemo.get(key);
}

function computeElements(block) {
  const isQuaternion = block.geometry === 'unit_quaternion';
  const sigma = block.sigma.map(columnOf);
  const truth = block.elements.map((name) => truthOf(block, name));
  const value = block.value.map(columnOf);
  const errors = block.error.map((ref, k) => ({
    label: block.tangent[k] || '',
    unit: block.error_unit,
    y: columnOf(ref),
    sigma: sigma[k],
  }));
  if (!isQuaternion) {
    const valueOf = (y, k) => {
      const label = block.elements[k];
      return {label, unit: block.unit, y, sigma: sigma[k], truth: truth[k]};
    };
    return {values: value.map(valueOf), errors};
  }
  const trueAngles = truth[0] ? rollPitchYaw(truth) : [];
  const angles = rollPitchYaw(value, truth[0] && trueAngles);
  const angleOf = (label, k) => ({label, unit: 'rad', y: angles[k], truth: trueAngles[k]});
  return {values: ['roll', 'pitch', 'yaw'].map(angleOf), errors};
}

/** The estimators that have a block: [{e, block, elements}]. */
const usersOf = (name) =>
  RUN.estimators
    .map((e) => ({e, block: e.blocks.find((b) => b.name === name)}))
    .filter(({block}) => block)
    .map(({e, block}) => ({
      e,
      block,
      get elements() {
        return elementsOf(e, block);
      },
    }));

/** Layers of element k: estimates with their bands, implied states and truth. */
function valueLayers(users, k) {
  const name = users[0].block.name;
  const series = users.map(({e, elements}) => ({e, ...elements.values[k]}));
  const bands = series
    .filter(({sigma}) => sigma)
    .map(({e, y, sigma}) => {
      const x = columnOf(e.t);
      return {kind: 'band', x, c: y, s: sigma, m: 3, est: e.name, fill: 0.09};
    });
  const implied = RUN.implied
    .filter(({block}) => block === name)
    .map(({sensor, t, v}) => ({
      kind: 'dots',
      x: columnOf(t),
      y: columnOf(v),
      color: () => colours.faint,
      size: 1.2,
      alpha: 0.75,
      fit: false,
      name: sensor,
    }));
  const lines = series.map(({e, y, sigma}) => {
    const x = columnOf(e.t);
    return {kind: 'line', x, y, s: sigma, est: e.name, name: e.name};
  });
  const {truth} = users[0].elements.values[k];
  const style = {ref: true, color: ink, dash: [6, 4], width: 1.4, name: 'truth'};
  const trueLine = truth && {kind: 'line', ...knownPart(columnOf(RUN.t), truth), ...style};
  return [...bands, ...implied, ...lines, trueLine];
}

/** Layers of the error of element k, with their bands. */
function errorLayers(users, k) {
  return users
    .filter(({elements}) => elements.errors[k])
    .flatMap(({e, elements}) => {
      const {y, sigma} = elements.errors[k];
      const x = columnOf(e.t);
      const band = {kind: 'band', x, s: sigma, m: 3, est: e.name, fill: 0.05, edge: true};
      return [sigma && band, {kind: 'line', ...knownPart(x, y, sigma), est: e.name, name: e.name}];
    });
}

/** Plots of a block. `what` is value, error or both. */
function statePlots(name, what) {
  const users = usersOf(name);
  const judged = users.find(({elements}) => elements.errors.length);
  const isScalar = users[0].block.value.length === 1;
  const specs = [];
  const add = (label, unit, isError, layers) =>
    specs.push({
      label,
      name: label + ' over time',
      time: true,
      last: false,
      first: !specs.length,
      height: isScalar ? (isError ? 190 : 240) : 128,
      zero: isError,
      y: {unit},
      layers,
    });
  if (what !== 'error' || !judged)
    users[0].elements.values.forEach(({label, unit}, k) =>
      add(`${shortName(name)} ${label}`.trim(), unit, false, () => valueLayers(users, k)),
    );
  if (what !== 'value' && judged)
    judged.elements.errors.forEach(({label, unit}, k) => {
      const title = `error of ${shortName(name)} ${label}`.trim();
      add(title, unit, true, () => errorLayers(users, k));
    });
  const last = specs[specs.length - 1];
  last.last = true;
  last.height += 28;
  return specs.map((spec) => new Plot(spec));
}

function stateHint({name, error, sigma}, what) {
  const isError = what !== 'value' && error.length;
  const isImplied = RUN.implied.some(({block}) => block === name);
  const dots = isImplied ? ', grey dots are the states that single measurements imply' : '';
  const values = `Lines are estimates, bands ±3σ, the dashed line is truth${dots}. `;
  const band = sigma.length ? ', inside their 3σ band in all but 0.3 % of the frames' : '';
  const errors = `Errors are estimate minus truth and should look like noise${band}.`;
  return (what !== 'error' || !isError ? values : '') + (isError ? errors : '');
}

/** The blocks with errors or standard deviations. Of the same blocks, one with errors. */
function shownBlocks() {
  const blocks = new Map();
  for (const block of RUN.estimators.flatMap((e) => e.blocks)) {
    const known = blocks.get(block.name);
    if (!known || (block.error.length && !known.error.length)) blocks.set(block.name, block);
  }
  return [...blocks.values()].filter((block) => block.error.length || block.sigma.length);
}

function stateSection(main) {
  const blocks = shownBlocks();
  if (!blocks.length) return;
  const subtitle = 'drag to zoom, double-click for all, click to keep the cursor';
  const box = section('state', 'Estimates and errors', subtitle, main);
  const holder = element('div');
  let block = blocks.find((b) => b.error.length) || blocks[0];
  let what = block.value.length === 1 ? 'both' : block.error.length ? 'error' : 'value';
  let plots = [];
  const build = () => {
    dispose(plots);
    plots = statePlots(block.name, what);
    setContent(holder);
    const title = block.name.replace('.', ' · ').replace(/_/g, ' ');
    figure(holder, {title, plots, hint: stateHint(block, what)});
  };
  const names = blocks.map(({name}) => [name, shortName(name)]);
  const blockChoice = choice('', names, block.name, (name) => {
    block = blocks.find((b) => b.name === name);
    build();
  });
  const contents = [
    ['both', 'both'],
    ['error', 'error'],
    ['value', 'estimate'],
  ];
  const contentChoice = choice('show', contents, what, (value) => {
    what = value;
    build();
  });
  box.append(element('div', {class: 'side'}, blockChoice, contentChoice), holder);
  build();
}
