// SPDX-License-Identifier: Apache-2.0
// Numbers as text, and their units.

const clamp = (v, a, b) => Math.min(b, Math.max(a, v));
const unique = (a) => [...new Set(a)];

const sum = (a) => {
  let s = 0;
  for (const v of a) s += v;
  return s;
};

function numberText(v, digits = 3) {
  if (v === null || v === undefined || Number.isNaN(v)) return '–';
  if (!Number.isFinite(v)) return v > 0 ? '∞' : '−∞';
  if (v === 0) return '0';
  const a = Math.abs(v);
  const s =
    a >= 1e6 || a < 1e-4
      ? v.toExponential(digits - 1).replace('e+', 'e')
      : a >= 10 ** (digits - 1)
        ? Math.round(v)
            .toString()
            .replace(/\B(?=(\d{3})+$)/g, a >= 1e4 ? '\u202f' : '')
        : v.toPrecision(digits);
  return s.replace('-', '−');
}

/** The largest of many numbers, or -Infinity. */
const maxOf = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);

const count = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, n >= 1e4 ? '\u202f' : '');
const plural = (n, one, many) => `${count(n)} ${n === 1 ? one : many || one + 's'}`;

const percent = (v) =>
  (v * 100 >= 10 || v === 0 ? Math.round(v * 100) : (v * 100).toPrecision(2)) + ' %';

const list = (a) =>
  a.length < 2 ? a.join('') : a.slice(0, -1).join(', ') + ' and ' + a[a.length - 1];

/** Display unit: angles in degrees, lengths and times by size. [factor, label] */
function unitFor(unit, size) {
  if (unit === 'rad') return [180 / Math.PI, '°'];
  if (unit === 'rad/s') return [180 / Math.PI, '°/s'];
  const m = /^(m|s|m\/s)$/.exec(unit || '');
  if (m && size > 0 && Number.isFinite(size)) {
    if (size < 1e-3) return [1e6, 'µ' + unit];
    if (size < 1) return [1e3, 'm' + unit];
  }
  return [1, unit || ''];
}

const withUnit = (v, unit, digits) => {
  if (Number.isNaN(v)) return '–';
  const [f, l] = unitFor(unit, Math.abs(v));
  return numberText(v * f, digits) + (l ? (l === '°' ? '' : '\u202f') + l : '');
};
