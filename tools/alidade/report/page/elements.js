// SPDX-License-Identifier: Apache-2.0
// Elements of the document, and what a button does with their text.

const SVGNS = 'http://www.w3.org/2000/svg';
const SVG_FONT = 'font-family="system-ui, Liberation Sans, Arial, sans-serif"';

function element(tag, props, ...kids) {
  const svg = /^(svg|path|rect|line|text)$/.test(tag);
  const el = svg ? document.createElementNS(SVGNS, tag) : document.createElement(tag);
  for (const [k, v] of Object.entries(props || {})) {
    if (v === undefined || v === null || v === false) continue;
    if (k.startsWith('on')) el.addEventListener(k.slice(2), v);
    else if (k === 'style') el.style.cssText = v;
    else el.setAttribute(k, v === true ? '' : v);
  }
  el.append(...kids.flat(9).filter((x) => x !== null && x !== undefined && x !== false));
  return el;
}

const setContent = (el, ...kids) => {
  el.replaceChildren(...kids.flat(9).filter(Boolean));
  return el;
};

function save(name, type, content) {
  const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], {type}));
  element('a', {href: url, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(url), 2000);
}

function copyButton(text, label = 'copy') {
  return element(
    'button',
    {
      class: 'btn small',
      onclick: (e) => {
        const done = () => {
          e.target.textContent = 'copied';
          setTimeout(() => {
            e.target.textContent = label;
          }, 1200);
        };
        const old = () => {
          const a = element('textarea', {}, text());
          document.body.append(a);
          a.select();
          document.execCommand('copy');
          a.remove();
          done();
        };
        if (navigator.clipboard) navigator.clipboard.writeText(text()).then(done, old);
        else old();
      },
    },
    label,
  );
}

/** A row of buttons of which one is on. */
function choice(label, items, value, change) {
  const bs = items.map(([v, text]) =>
    element(
      'button',
      {
        class: 'btn small',
        'aria-pressed': String(v === value),
        onclick: () => {
          bs.forEach((b, i) => b.setAttribute('aria-pressed', String(items[i][0] === v)));
          change(v);
        },
      },
      text,
    ),
  );
  return element(
    'span',
    {class: 'group', role: 'group', 'aria-label': label},
    label && element('span', {class: 'label'}, label),
    bs,
  );
}

const nameOf = (text, name = text) => element('span', {class: 'est', 'data-est': name}, text);

/** The last component of the name of a block. */
const shortName = (block) => block.split('.').pop().replace(/_/g, ' ');
