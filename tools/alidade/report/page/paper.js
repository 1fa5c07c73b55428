// SPDX-License-Identifier: Apache-2.0
// Print: on paper, each plot is SVG and light.

/** On paper every plot is SVG, 720 px wide before it is fitted to the page, and light. */
let wasDark = null;

function toPaper() {
  if (wasDark !== null) return;
  wasDark = page.dark;
  setTheme(false);
  for (const p of plots)
    if (p.el.clientWidth && p.spec.label !== 'timeline') {
      const svg = new SvgSurface();
      const w = Math.min(720, Math.max(340, p.el.clientWidth * 0.62));
      const hh = p.el.clientHeight;
      p.paint(svg, w, hh);
      p.dirty = true;
      const box = element('div', {class: 'printed'});
      const size = `viewBox="0 0 ${w} ${hh}" width="100%" height="${hh}"`;
      box.innerHTML = `<svg xmlns="${SVGNS}" ${size} ${SVG_FONT}>${svg.out.join('')}</svg>`;
      p.el.append(box);
    }
}

function toScreen() {
  document.querySelectorAll('.printed').forEach((e) => e.remove());
  if (wasDark !== null) setTheme(wasDark);
  wasDark = null;
}
