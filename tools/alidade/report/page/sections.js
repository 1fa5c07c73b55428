// SPDX-License-Identifier: Apache-2.0
// Sections of the page, and parts that are drawn when they are opened.

const nav = [];

function section(id, title, sub, parent) {
  const s = element('section', {id}, element('h2', {}, title, sub && element('small', {}, sub)));
  parent.append(s);
  nav.push([id, title]);
  return s;
}

function fold(parent, title, sub, build) {
  // drawn when first opened
  const box = element('div');
  const d = element(
    'details',
    {class: 'more'},
    element('summary', {}, title, sub && element('span', {}, sub)),
    box,
  );
  d.addEventListener('toggle', () => {
    if (d.open && !box.childElementCount) build(box);
  });
  d.build = () => {
    if (!box.childElementCount) build(box);
  };
  parent.append(d);
  return d;
}

/** A text whose names of estimators have their colours. */
function withNames(text) {
  const names = NAMES.slice().sort((a, b) => b.length - a.length);
  const escaped = names.map((name) => name.replace(/[.*+?^${}()|[\]\\]/g, '\\$&'));
  if (!escaped.length) return [text];
  const pattern = new RegExp(`(?<![\\w-])(${escaped.join('|')})(?![\\w-]|[.]\\w)`);
  return text.split(pattern).map((part, i) => (i % 2 ? nameOf(part) : part));
}

/** A text whose times, such as `t = 1.5 s`, are links, and whose names have their colours. */
const withLinks = (text) =>
  text
    .split(/\bt = (-?[\d.]+(?:e[+-]?\d+)?) s\b/)
    .map((part, i) => (i % 2 && RUN ? timeLink(Number(part) - RUN.t0) : withNames(part)));

const TONES = {
  good: ['good', '✓'],
  neutral: ['calm', '·'],
  warning: ['warn', '▲'],
  bad: ['bad', '✕'],
};

/** Items of the list "What happened": conclusions of the program. */
const conclusionItems = (conclusions) =>
  conclusions.map(({tone, text, details}) => {
    const [cls, mark] = TONES[tone];
    return {cls, mark, text: withLinks(text), more: details && withNames(details)};
  });

function storyList(items) {
  return element(
    'ul',
    {class: 'story'},
    items.map((q) =>
      element(
        'li',
        {},
        element('span', {class: 'i ' + q.cls, 'aria-hidden': 'true'}, q.mark),
        element('p', {}, q.text, q.more ? element('span', {class: 'more'}, ' ', q.more) : null),
      ),
    ),
  );
}
