// SPDX-License-Identifier: Apache-2.0
// Files of a figure: SVG, PNG and CSV.

/** The menu that saves a figure. */
function saveMenu(title, plots) {
  const name = fileName(title);
  const item = (text, onclick) => element('button', {onclick}, text);
  const items = [
    item('SVG (vector)', () => save(name + '.svg', 'image/svg+xml', svgText(title, plots))),
    item('PNG (2×)', () => savePng(title, plots)),
    item('CSV of the values', () => save(name + '.csv', 'text/csv', csvText(plots))),
  ];
  const summary = element('summary', {'aria-label': 'save this figure'}, 'save ▾');
  const menu = element('details', {class: 'menu'}, summary, element('div', {}, items));
  menu.addEventListener('click', (event) => {
    if (event.target.tagName === 'BUTTON') menu.open = false;
  });
  return menu;
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
function svgText(title, plots) {
  const width = 900;
  let y = 44;
  let body = '';
  for (const plot of plots) {
    const height = plot.el.clientHeight || plot.spec.height || 130;
    const surface = new SvgSurface();
    const before = [plot.f, plot.X, plot.Y];
    plot.paint(surface, width, height);
    [plot.f, plot.X, plot.Y] = before;
    plot.dirty = true;
    body += `<g transform="translate(0 ${y})">${surface.out.join('')}</g>`;
    y += height + 4;
  }
  redraw();
  const ground = `<rect width="${width}" height="${y}" fill="${colours.panel}"/>`;
  const font = `font-size="14" font-weight="600" fill="${colours.ink}"`;
  const head = `<text x="14" y="18" ${font}>${esc(title)}</text>${svgLegend()}`;
  const size = `width="${width}" height="${y}" viewBox="0 0 ${width} ${y}"`;
  return `<svg xmlns="${SVGNS}" ${size} ${SVG_FONT}>${ground}${head}${body}</svg>\n`;
}

/** Saves the figure as a picture of twice its size in px. */
function savePng(title, plots) {
  const svg = svgText(title, plots);
  const [, width, height] = /width="(\d+)" height="([\d.]+)"/.exec(svg);
  const image = new Image();
  image.onload = () => {
    const canvas = element('canvas', {width: 2 * width, height: 2 * height});
    canvas.getContext('2d').drawImage(image, 0, 0, 2 * width, 2 * height);
    canvas.toBlob((blob) => save(fileName(title) + '.png', 'image/png', blob));
  };
  image.src = 'data:image/svg+xml;charset=utf-8,' + encodeURIComponent(svg);
}

/** The visible values of the plots as CSV. */
function csvText(plots) {
  const rows = plots.flatMap((plot) => {
    if (!plot.layers) plot.draw();
    return plot.csv ? plot.csv() : [];
  });
  return ['panel,series,x,y,sigma,x_unit,y_unit', ...rows].join('\n') + '\n';
}
