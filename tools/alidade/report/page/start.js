// SPDX-License-Identifier: Apache-2.0
// Start: builds the page.

/**
 * Sets the time range of the page. A visible time that is a part of the range stays. Returns false
 * if the page has no time.
 */
function setTimeRange() {
  const over_time = COMPARISON && COMPARISON.over_time;
  const ref = HAS_TIMES ? RUN.t : over_time ? over_time.t : null;
  if (ref === null) return false;
  const times = columnOf(ref);
  const last = times[times.length - 1];
  const showsAll = page.x[0] <= page.full[0] && page.x[1] >= page.full[1];
  page.full = [times[0], last > times[0] ? last : times[0] + 1];
  if (showsAll || page.x[1] <= page.full[0]) page.x = page.full.slice();
  return true;
}

function followTheme() {
  const dark = matchMedia('(prefers-color-scheme: dark)');
  setTheme(dark.matches);
  dark.addEventListener('change', (event) => setTheme(event.matches));
}

/** The bar that stays in view: legend, zoom buttons and timeline. */
function legendBar(hasTime) {
  const row = element('div', {class: 'row'}, legend());
  const box = element('div', {}, row);
  if (hasTime) {
    const span = element('span', {class: 'span'});
    const small = (label, title, onclick) =>
      element('button', {class: 'btn small', title, 'aria-label': title, onclick}, label);
    page.listeners.push(() => {
      span.textContent = `${clock(page.x[0])} to ${clock(page.x[1])} s`;
    });
    const zoom = [
      small('+', 'zoom in', () => zoomBy(0.5, page.time)),
      small('−', 'zoom out', () => zoomBy(2, page.time)),
      small('all', 'show all times', () => zoomTo(...page.full)),
    ];
    row.append(element('div', {class: 'zoom'}, span, zoom));
    box.append(new Timeline().el);
  }
  return element('div', {class: 'bar'}, box);
}

function verdictChips() {
  const chips = JUDGED.map((e) => {
    const {cls, mark, state, because} = verdictOf(e);
    const name = element('b', {}, nameOf(e.name));
    return element('div', {class: 'chip ' + cls, title: because}, name, ` ${mark} ${state}`);
  });
  return element('div', {class: 'chips'}, chips);
}

function summarySection(main) {
  const results = COMPARISON || SWEEP || DATA.evaluation || DATA.bundle || {};
  const conclusions = conclusionItems(results.conclusions || []);
  const items = JUDGED.length
    ? [...conclusions, ...story(), ...conclusionItems(RUN.conclusions)]
    : conclusions;
  if (!items.length && !JUDGED.length) return null;
  const box = section('summary', 'What happened', '', main);
  if (JUDGED.length) box.append(verdictChips());
  if (items.length) box.append(element('div', {class: 'panel'}, storyList(items)));
  return box;
}

function runSections(main, summary) {
  if (JUDGED.length) {
    summary.append(runTablePanel());
    metricFold(summary);
  }
  mapSection(main);
  if (HAS_TIMES) stateSection(main);
  consistencySection(main);
  measurementSection(main);
  if (!JUDGED.length) return;
  insideSection(main);
  eventSection(main);
}

function footer() {
  const program = DATA.program ? ' ' + DATA.program : '';
  const text = `Written by alidade${program}. This page is one file and needs no network.`;
  return element('footer', {}, text);
}

function listen() {
  document.addEventListener('keydown', (event) => {
    const isTyping = event.target.closest('input, select, textarea');
    if (isTyping || event.ctrlKey || event.metaKey) return;
    const i = '123456789'.indexOf(event.key);
    if (i >= 0 && i < NAMES.length) toggle(NAMES[i], event.shiftKey);
  });
  document.addEventListener('click', (event) => {
    for (const menu of document.querySelectorAll('details.menu[open]'))
      if (!menu.contains(event.target)) menu.open = false;
  });
  addEventListener('beforeprint', toPaper);
  addEventListener('afterprint', toScreen);
}

/** Builds the page from the data. */
function build() {
  dispose([...plots]);
  nav.length = page.listeners.length = 0;
  const main = element('main');
  const hasTime = setTimeRange();
  const head = headerOf();
  const bar = DATA.explain ? '' : legendBar(hasTime);
  document.getElementById('app').replaceChildren(head, bar, main, footer(), tip);
  if (DATA.status !== 'ok' && !DATA.bundle && !isRunning()) failureSection(main);
  const summary = summarySection(main);
  if (DATA.evaluation) evaluationSection(main);
  if (DATA.bundle) bundleSection(main);
  if (COMPARISON) compareSection(main);
  if (DATA.explain) explainSection(main);
  if (SWEEP && SWEEP.vary) varySection(main);
  if (SWEEP) sweepSection(main);
  if (RUN) runSections(main, summary);
  tailSections(main);
  const links = nav.map(([id, title]) => element('a', {href: '#' + id}, title));
  head.append(element('nav', {class: 'jump', 'aria-label': 'sections'}, links));
  setTheme(page.dark);
}

/** For tests of the page. */
window.alidadeReport = {
  page,
  plots,
  columnOf,
  setTheme,
  get run() {
    return RUN;
  },
  get bundle() {
    return DATA.bundle;
  },
};

followTheme();
setTimeRange();
readHash();
build();
listen();
followRun();
