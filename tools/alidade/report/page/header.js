// SPDX-License-Identifier: Apache-2.0
// Header: title, facts and command.

function headerOf() {
  const tools = element('div', {class: 'tools'}, themeButton(), printButton());
  const title = element('div', {class: 'headline'}, element('h1', {}, DATA.title), tools);
  const factList = element('ul', {class: 'facts'}, facts());
  if (DATA.live) page.listeners.push(() => setContent(factList, facts()));
  const command =
    DATA.command &&
    element('span', {class: 'cmd'}, DATA.command, copyButton(() => DATA.command));
  return element('header', {}, title, factList, liveStatus(), command);
}

const printButton = () => element('button', {class: 'btn', onclick: () => print()}, 'print');

const themeButton = () =>
  element(
    'button',
    {
      class: 'btn',
      'aria-label': 'light or dark',
      title: 'light or dark',
      onclick: () => setTheme(!page.dark),
    },
    '◐',
  );

/** The items of the list of facts. Unknown facts are omitted. */
function facts() {
  const names = [strong(NAMES.length), NAMES.length === 1 ? ' estimator' : ' estimators'];
  const items = DATA.bundle ? bundleFacts() : [names];
  if (HAS_TIMES) items.push(...timeFacts(columnOf(RUN.t)));
  if (SWEEP) items.push([strong(SWEEP.runs), ' runs', SWEEP.vary ? ' of each value' : '']);
  if (DATA.seed !== null && DATA.seed !== undefined) items.push(['seed ', strong(DATA.seed)]);
  const hasTruth = !RUN || Object.keys(RUN.truth).length > 0 || DATA.reference !== 'truth';
  if (DATA.reference && hasTruth) items.push(['errors against ', strong(DATA.reference)]);
  if (DATA.hash) items.push(['data ', element('code', {}, DATA.hash)]);
  if (DATA.program) items.push(['alidade ' + DATA.program]);
  return items.map((item) => element('li', {}, item));
}

/** Number of frames, duration, and the rate by the median time between the first frames. */
function timeFacts(times) {
  const steps = Array.from(times.slice(1, 2001)).map((time, i) => time - times[i]);
  const [step] = quantiles(steps, [0.5]);
  const items = [
    [strong(count(times.length)), ' frames'],
    [strong(numberText(page.full[1] - page.full[0])), ' s of data'],
  ];
  if (step > 0) items.push([strong(numberText(1 / step)), ' Hz']);
  return items;
}

const strong = (text) => element('b', {}, text);
