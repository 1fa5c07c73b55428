// SPDX-License-Identifier: Apache-2.0
// Figure: a title, a hint, plots, and the menu that saves them.

/** A figure: title, what a good one looks like, plots, and the menu that saves them. */
function figure(parent, {title, hint, plots: ps, controls, wide, className}) {
  const note = element('p', {class: 'note', hidden: true});
  const fullBtn =
    ps.some((p) => p.spec.time && !p.spec.y.range && !p.spec.noFit) &&
    element(
      'button',
      {
        class: 'btn small',
        'aria-pressed': 'false',
        title: 'scale the axes to all values, or to those that matter',
        onclick: (e) => {
          const on = !ps[0].full;
          ps.forEach((p) => {
            p.full = on;
          });
          e.target.setAttribute('aria-pressed', on);
          redraw();
        },
      },
      'fit all',
    );
  const menu = element(
    'details',
    {class: 'menu'},
    element('summary', {'aria-label': 'save this figure'}, 'save ▾'),
    element(
      'div',
      {},
      element(
        'button',
        {onclick: () => save(fileName(title) + '.svg', 'image/svg+xml', exportSvg(title, ps))},
        'SVG (vector)',
      ),
      element('button', {onclick: () => exportPng(title, ps)}, 'PNG (2×)'),
      element(
        'button',
        {
          onclick: () =>
            save(
              fileName(title) + '.csv',
              'text/csv',
              'panel,series,x,y,sigma\n' +
                ps
                  .flatMap((p) => {
                    if (!p.layers) p.draw();
                    return p.csv ? p.csv() : [];
                  })
                  .join('\n') +
                '\n',
            ),
        },
        'CSV of the values',
      ),
    ),
  );
  menu.addEventListener('click', (e) => {
    if (e.target.tagName === 'BUTTON') menu.open = false;
  });
  for (const p of ps)
    p.onPainted = () => {
      const lost = unique(ps.flatMap((q) => [...(q.lost || [])]));
      note.hidden = !lost.length || ps[0].full;
      const verb = lost.length > 1 ? 'leave' : 'leaves';
      note.textContent = `${list(lost)} ${verb} the axis: "fit all" shows everything.`;
    };
  const el = element(
    'figure',
    {class: 'panel ' + (className || '')},
    element(
      'header',
      {},
      element('h3', {}, title),
      element('div', {class: 'side'}, controls, fullBtn, menu),
    ),
    hint && element('p', {class: 'hint'}, hint),
    className === 'maps'
      ? element(
          'div',
          {class: 'pair'},
          ps.map((p) => p.el),
        )
      : ps.map((p) => p.el),
    ps.flatMap((p) => p.extra || []),
    note,
  );
  parent.append(el);
  return el;
}

const fileName = (title) => (DATA.title + '-' + title).toLowerCase().replace(/[^a-z0-9]+/g, '-');

/** The legend of a saved figure: a line and a name for each visible estimator. */
function svgLegend() {
  let x = 14;
  return NAMES.filter(shown)
    .map((name) => {
      const dash = dashOf(name).length ? ` stroke-dasharray="${dashOf(name)}"` : '';
      const line = `<path d="M${x} 33h18" stroke="${colorOf(name)}" stroke-width="2.5"${dash}/>`;
      const place = `x="${x + 23}" y="37" font-size="11" fill="${colours.ink}"`;
      x += 40 + 6.6 * name.length;
      return `${line}<text ${place}>${esc(name)}</text>`;
    })
    .join('');
}

/** The text of an SVG file with a title, the legend and the plots, one below another. */
function exportSvg(title, ps) {
  const w = 900;
  let y = 44;
  let body = '';
  for (const p of ps) {
    const hh = p.el.clientHeight || p.spec.height || 130;
    const s = new SvgSurface();
    const before = [p.f, p.X, p.Y];
    p.paint(s, w, hh);
    [p.f, p.X, p.Y] = before;
    p.dirty = true;
    body += `<g transform="translate(0 ${y})">${s.out.join('')}</g>`;
    y += hh + 4;
  }
  redraw();
  const ground = `<rect width="${w}" height="${y}" fill="${colours.panel}"/>`;
  const font = `font-size="14" font-weight="600" fill="${colours.ink}"`;
  const head = `<text x="14" y="18" ${font}>${esc(title)}</text>${svgLegend()}`;
  const size = `width="${w}" height="${y}" viewBox="0 0 ${w} ${y}"`;
  return `<svg xmlns="${SVGNS}" ${size} ${SVG_FONT}>${ground}${head}${body}</svg>\n`;
}

function exportPng(title, ps) {
  const svg = exportSvg(title, ps);
  const img = new Image();
  const [, w, hh] = /width="(\d+)" height="([\d.]+)"/.exec(svg);
  img.onload = () => {
    const c = element('canvas', {width: 2 * w, height: 2 * hh});
    c.getContext('2d').drawImage(img, 0, 0, 2 * w, 2 * hh);
    c.toBlob((b) => save(fileName(title) + '.png', 'image/png', b));
  };
  img.src = 'data:image/svg+xml;charset=utf-8,' + encodeURIComponent(svg);
}
