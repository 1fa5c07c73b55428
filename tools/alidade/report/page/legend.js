// SPDX-License-Identifier: Apache-2.0
// Legend: a button for each estimator, which hides it.

function legend() {
  const keys = NAMES.map(legendKey);
  page.listeners.push(() =>
    keys.forEach((key, i) => {
      key.setAttribute('aria-pressed', String(!page.hidden.has(NAMES[i])));
      key.querySelector('path').setAttribute('stroke', colorOf(NAMES[i]));
    }),
  );
  return element('div', {class: 'legend', role: 'group', 'aria-label': 'estimators'}, keys);
}

function legendKey(name, i) {
  const estimator = RUN && RUN.estimators[i];
  const verdict = estimator && estimator.verdict && verdictOf(estimator);
  const label = verdict && {class: 'mark ' + verdict.cls, 'aria-label': verdict.state};
  const help = `click: hide or show (${i + 1}); double-click: this one alone`;
  const focus = (focused) => () => {
    page.focus = focused;
    redraw();
  };
  return element(
    'button',
    {
      class: 'key',
      'aria-pressed': 'true',
      title: verdict ? `${verdict.state}: ${verdict.because}\n${help}` : help,
      onclick: (event) => {
        page.focus = null;
        toggle(name, event.altKey);
      },
      ondblclick: () => setHidden(NAMES.filter((other) => other !== name)),
      onmouseenter: focus(name),
      onmouseleave: focus(null),
    },
    lineSample(name),
    element('span', {class: 'name'}, name),
    verdict && element('span', label, verdict.mark),
  );
}

/** A short line with the dashes of an estimator. */
function lineSample(name) {
  const dashes = dashOf(name).join(' ');
  const line = {d: 'M0 5h20', 'stroke-width': 3, fill: 'none', 'stroke-dasharray': dashes};
  return element('svg', {width: 20, height: 10, 'aria-hidden': 'true'}, element('path', line));
}
