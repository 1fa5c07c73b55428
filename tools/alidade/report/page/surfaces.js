// SPDX-License-Identifier: Apache-2.0
// Surfaces: one set of drawing calls, on a canvas or as SVG.

/** A picture of one colour that covers the cells, which are columns of H pixels. */
function cellPicture(cells, W, H, colour) {
  const canvas = element('canvas', {width: W, height: H});
  const context = canvas.getContext('2d');
  const image = context.createImageData(W, H);
  for (let x = 0; x < W; x++)
    for (let y = 0; y < H; y++) image.data[4 * (y * W + x) + 3] = 255 * cells[x * H + y];
  context.putImageData(image, 0, 0);
  context.globalCompositeOperation = 'source-in';
  context.fillStyle = colour;
  context.fillRect(0, 0, W, H);
  return canvas;
}

// pts are flat: x, y, x, y, ...; a NaN lifts the pen. style: {stroke, width, dash, fill, alpha}
class CanvasSurface {
  constructor(ctx) {
    this.c = ctx;
  }
  style(o) {
    const c = this.c;
    c.globalAlpha = o.alpha === undefined ? 1 : o.alpha;
    c.lineWidth = o.width || 1;
    c.setLineDash(o.dash || []);
    c.strokeStyle = o.stroke || '#000';
    c.fillStyle = o.fill || '#000';
    c.lineJoin = 'bevel';
  }
  path(pts, o) {
    const c = this.c;
    let up = true;
    this.style(o);
    c.beginPath();
    for (let i = 0; i < pts.length; i += 2) {
      if (Number.isNaN(pts[i + 1])) up = true;
      else if (up) {
        c.moveTo(pts[i], pts[i + 1]);
        up = false;
      } else c.lineTo(pts[i], pts[i + 1]);
    }
    if (o.fill) c.fill();
    if (o.stroke) c.stroke();
  }
  rect(x, y, w, hh, o) {
    this.style(o);
    if (o.fill) this.c.fillRect(x, y, w, hh);
    if (o.stroke) this.c.strokeRect(x, y, w, hh);
  }
  marks(pts, shape, r, o) {
    const c = this.c;
    this.style({...o, width: o.width || 1.5});
    if (shape === 'square') {
      for (let i = 0; i < pts.length; i += 2) {
        const corner = [pts[i] - r, pts[i + 1] - r, 2 * r, 2 * r];
        c.fillRect(...corner);
        if (o.stroke) c.strokeRect(...corner);
      }
      return;
    }
    c.beginPath();
    for (let i = 0; i < pts.length; i += 2) markPath(c, shape, pts[i], pts[i + 1], r);
    if (o.fill) c.fill();
    if (o.stroke) c.stroke();
  }
  runs(cells, W, H, x0, y0, o) {
    this.style(o);
    this.c.imageSmoothingEnabled = false;
    this.c.drawImage(cellPicture(cells, W, H, o.fill), Math.round(x0), Math.round(y0));
  }
  text(s, x, y, o = {}) {
    const c = this.c;
    this.style({fill: o.color || colours.muted});
    c.font = `${o.weight || 400} ${o.size || 11}px system-ui, "Liberation Sans", sans-serif`;
    c.textAlign = o.align || 'left';
    c.textBaseline = 'middle';
    c.save();
    c.translate(x, y);
    if (o.turn) c.rotate(-Math.PI / 2);
    if (o.halo) {
      c.lineWidth = 3.5;
      c.strokeStyle = colours.panel;
      c.lineJoin = 'round';
      c.strokeText(s, 0, 0);
    }
    c.fillText(s, 0, 0);
    c.restore();
  }
  clip(x, y, w, hh) {
    this.c.save();
    this.c.beginPath();
    this.c.rect(x, y, w, hh);
    this.c.clip();
  }
  unclip() {
    this.c.restore();
  }
}

function markPath(c, shape, x, y, r) {
  if (shape === 'cross') {
    c.moveTo(x - r, y - r);
    c.lineTo(x + r, y + r);
    c.moveTo(x - r, y + r);
    c.lineTo(x + r, y - r);
  } else if (shape === 'plus') {
    c.moveTo(x - r, y);
    c.lineTo(x + r, y);
    c.moveTo(x, y - r);
    c.lineTo(x, y + r);
  } else if (shape === 'diamond') {
    c.moveTo(x, y - r);
    c.lineTo(x + r, y);
    c.lineTo(x, y + r);
    c.lineTo(x - r, y);
    c.closePath();
  } else if (shape === 'tri') {
    c.moveTo(x, y - r);
    c.lineTo(x + r, y + r);
    c.lineTo(x - r, y + r);
    c.closePath();
  } else {
    c.moveTo(x + r, y);
    c.arc(x, y, r, 0, 7);
  }
}

function eachRun(cells, W, H, f) {
  for (let x = 0; x < W; x++)
    for (let y = 0, k = x * H; y < H; y++)
      if (cells[k + y]) {
        const from = y;
        while (y < H && cells[k + y]) y++;
        f(x, from, y - from);
      }
}

const esc = (s) =>
  String(s).replace(/[&<>"]/g, (c) => ({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;'})[c]);

const fixed = (v) => v.toFixed(1);

class SvgSurface {
  constructor() {
    this.out = [];
    this.clips = 0;
  }
  attrs(o) {
    return (
      ` fill="${o.fill || 'none'}"` +
      (o.stroke
        ? ` stroke="${o.stroke}" stroke-width="${o.width || 1}" stroke-linejoin="round"`
        : '') +
      (o.dash && o.dash.length ? ` stroke-dasharray="${o.dash}"` : '') +
      (o.alpha !== undefined && o.alpha < 1 ? ` opacity="${+o.alpha.toFixed(3)}"` : '')
    );
  }
  path(pts, o) {
    let d = '';
    let up = true;
    for (let i = 0; i < pts.length; i += 2) {
      if (Number.isNaN(pts[i + 1])) {
        up = true;
        continue;
      }
      d += (up ? 'M' : 'L') + pts[i].toFixed(1) + ' ' + clamp(pts[i + 1], -1e4, 1e4).toFixed(1);
      up = false;
    }
    if (d) this.out.push(`<path d="${d}"${this.attrs(o)}/>`);
  }
  rect(x, y, w, hh, o) {
    const [left, top, width, height] = [x, y, Math.max(0, w), Math.max(0, hh)].map(fixed);
    const box = `x="${left}" y="${top}" width="${width}" height="${height}"`;
    this.out.push(`<rect ${box}${this.attrs(o)}/>`);
  }
  marks(pts, shape, r, o) {
    let d = '';
    const p = (a, b) => a.toFixed(1) + ' ' + b.toFixed(1);
    const c = {
      moveTo: (x, y) => {
        d += 'M' + p(x, y);
      },
      lineTo: (x, y) => {
        d += 'L' + p(x, y);
      },
      closePath: () => {
        d += 'Z';
      },
      arc: (x, y, q) => {
        d += `A${q} ${q} 0 1 1 ${p(x - q, y)}A${q} ${q} 0 1 1 ${p(x + q, y)}`;
      },
    };
    for (let i = 0; i < pts.length; i += 2) {
      if (shape === 'square') d += `M${p(pts[i] - r, pts[i + 1] - r)}h${2 * r}v${2 * r}h${-2 * r}Z`;
      else markPath(c, shape, pts[i], pts[i + 1], r);
    }
    if (d) this.out.push(`<path d="${d}"${this.attrs({...o, width: o.width || 1.5})}/>`);
  }
  runs(cells, W, H, x0, y0, o) {
    let d = '';
    eachRun(cells, W, H, (x, y, n) => {
      d += `M${(x0 + x + 0.7).toFixed(1)} ${y0 + y}v${n}`;
    });
    if (d)
      this.out.push(`<path d="${d}"${this.attrs({stroke: o.fill, width: 1.4, alpha: o.alpha})}/>`);
  }
  text(s, x, y, o = {}) {
    const anchor = {center: 'middle', right: 'end'}[o.align] || 'start';
    const place = `x="${fixed(x)}" y="${fixed(y)}" dy=".35em" text-anchor="${anchor}"`;
    const font = `font-size="${o.size || 11}" font-weight="${o.weight || 400}"`;
    const halo = o.halo ? ` stroke="${colours.panel}" stroke-width="3" paint-order="stroke"` : '';
    const turn = o.turn ? ` transform="rotate(-90 ${fixed(x)} ${fixed(y)})"` : '';
    const fill = o.color || colours.muted;
    this.out.push(`<text ${place} ${font} fill="${fill}"${halo}${turn}>${esc(s)}</text>`);
  }
  clip(x, y, w, hh) {
    const id = 'c' + (SvgSurface.ids = (SvgSurface.ids || 0) + 1);
    const box = `x="${x}" y="${y}" width="${w}" height="${hh}"`;
    this.out.push(`<clipPath id="${id}"><rect ${box}/></clipPath><g clip-path="url(#${id})">`);
  }
  unclip() {
    this.out.push('</g>');
  }
}
