// SPDX-License-Identifier: Apache-2.0
// Live page: follows a run that goes on. Its server sends the data again after some frames.

const isRunning = () => Boolean(DATA.live && !DATA.live.report);

let isConnected = true;

/** The text about the run, above the figures; null on the page of a folder. */
function liveStatus() {
  if (!DATA.live) return null;
  const status = element('p', {class: 'live', role: 'status'});
  page.listeners.push(() => setContent(status, liveText()));
  return status;
}

function liveText() {
  const {dropped, report, rows} = DATA.live;
  const lost = dropped ? ` ${plural(dropped, 'update')} dropped, because a browser was slow.` : '';
  if (report) return `The run has ended. This is its report, ${report}.${lost}`;
  if (!isConnected) return 'The program has ended. This is the last update of the page.';
  if (!RUN) return 'Live: the run waits for its first frame.';
  return `Live: the figures show the last ${count(rows)} rows of each file.${lost}`;
}

/** Names and sizes of everything in a run that the figures of a page depend on. */
function structureOf(run) {
  const partsOf = (e) => [
    e.name,
    e.position,
    e.blocks.map((b) => [b.name, b.value.length, b.sigma.length, b.error.length]),
    e.innovations.map((I) => [I.sensor, ...Object.keys(I)]),
    e.nees.map(({owner}) => owner),
  ];
  const implied = run.implied.map(({sensor, block}) => [sensor, block]);
  return JSON.stringify([run.estimators.map(partsOf), implied, Object.keys(run.truth)]);
}

/** Sets the content of `target` to that of `source`. Retains its objects: figures refer to them. */
function assign(target, source) {
  for (const key of Object.keys(target)) if (!(key in source)) delete target[key];
  for (const [key, value] of Object.entries(source)) {
    const old = target[key];
    const areSimilar = old instanceof Object && value instanceof Object;
    if (areSimilar && Array.isArray(old) === Array.isArray(value)) assign(old, value);
    else target[key] = value;
  }
  if (Array.isArray(target)) target.length = source.length;
}

/** Shows new data. The page is built again only if the data need other figures. */
function showUpdate(data) {
  if (!RUN || !data.run || structureOf(RUN) !== structureOf(data.run)) {
    setData(data);
    build();
    return;
  }
  assign(RUN, data.run);
  setData(data, RUN);
  setTimeRange();
  for (const plot of plots) if (plot.load) plot.load();
  redraw();
}

/** Receives the updates of the server, until the run ends. */
function followRun() {
  if (!isRunning() || location.protocol === 'file:') return;
  const source = new EventSource('events');
  source.addEventListener('message', (event) => showUpdate(JSON.parse(event.data)));
  source.addEventListener('end', (event) => {
    source.close();
    setData(JSON.parse(event.data));
    build();
  });
  source.addEventListener('error', () => {
    source.close();
    isConnected = false;
    redraw();
  });
}
