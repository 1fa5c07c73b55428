// SPDX-License-Identifier: Apache-2.0
// Forest plot of ratios with their intervals.

/** Draws a ratio with its interval. A hollow mark: the interval includes 1. */
function paintRatio(surface, X, y, {name, value, low, high, isUndecided}) {
  const stroke = colorOf(name);
  const alpha = shown(name) ? dim(name) : 0.15;
  if (Number.isFinite(low)) {
    const [a, b] = [X.to(low), X.to(high)];
    surface.path([a, y, b, y], {stroke, width: 2, alpha});
    const ends = [a, y - 4, a, y + 4, NaN, NaN, b, y - 4, b, y + 4];
    surface.path(ends, {stroke, width: 1.5, alpha});
  }
  const style = isUndecided
    ? {fill: colours.panel, stroke, alpha, width: 1.6}
    : {fill: stroke, alpha};
  surface.marks([X.to(value), y], 'square', 4.5, style);
}

function forestPlot(ratios, label) {
  const values = ratios.flatMap((r) => [r.value, r.low, r.high]).filter(Number.isFinite);
  const least = Math.min(1, ...values);
  const greatest = Math.max(1, ...values);
  const margin = (greatest / least) ** 0.08;
  const tipOf = (i) => {
    const {name, value, low, high} = ratios[i];
    const interval = Number.isFinite(low) ? ` [${numberText(low, 4)}, ${numberText(high, 4)}]` : '';
    return [element('b', {}, name), numberText(value, 4), interval];
  };
  const marks = {
    kind: 'dots',
    x: ratios.map((r) => r.value),
    y: ratios.map((_, i) => i),
    alpha: 0,
    color: ink,
    name: 'value',
    tip: tipOf,
    fit: false,
  };
  const paint = (surface, X, Y) => ratios.forEach((r, i) => paintRatio(surface, X, Y.to(i), r));
  return new Plot({
    label,
    name: label,
    height: ratios.length * 26 + 54,
    left: innerWidth < 520 ? 104 : 168,
    x: {
      label: '',
      unit: '',
      log: true,
      range: () => [(least / margin) * 0.995, greatest * margin * 1.005],
    },
    y: {
      unit: '',
      rows: ratios.map((r) => r.name),
      range: () => [-0.6, ratios.length - 0.4],
    },
    layers: () => [
      {kind: 'v', v: 1, color: () => colours.muted},
      {kind: 'custom', x: null, paint},
      marks,
    ],
  });
}

function ratioFigure(block) {
  const ratios = COMPARISON.estimators
    .filter((e) => Number.isFinite(comparedValue(e, 'ratio.rmse:' + block)))
    .map((e) => {
      const [value, low, high, isUndecided] = e.values['ratio.rmse:' + block];
      return {name: e.name, value, low, high, isUndecided};
    })
    .filter(({value}) => value !== 1)
    .reverse();
  if (!ratios.length) return null;
  return {
    title: 'Error relative to the reference',
    hint:
      'Ratio of the RMSE to that of full information (online) or of the batch (smoothed). ' +
      'Left of 1 is better. Hollow: the interval includes 1.',
    plots: [forestPlot(ratios, `ratio of RMSE, ${block}`)],
  };
}
