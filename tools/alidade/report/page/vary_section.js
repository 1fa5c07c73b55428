// SPDX-License-Identifier: Apache-2.0
// Section of a varied sweep: each metric against the value.

/** Positions of the values on the axis: the numbers, or else 0, 1, 2. */
function valueAxis() {
  const values = variedValues();
  const numbers = values.map(({value}) => Number(value));
  const isNumeric = numbers.every(Number.isFinite);
  const labelOf = ({value, label}) => (isNumeric ? String(+Number(value).toPrecision(3)) : label);
  const positions = isNumeric ? numbers : values.map((_, i) => i);
  return {
    positions,
    log: isNumeric && Math.min(...numbers) > 0 && Math.max(...numbers) / Math.min(...numbers) > 4,
    ticks: values.map((value, i) => [positions[i], labelOf(value)]),
  };
}

/** Mean, 5 % and 95 % quantile of a metric at each value, and the index of the best value. */
function spreadOf(estimator, metric) {
  const spreads = variedValues().map(({value}) => {
    const group = SWEEP.groups.find((g) => g.estimator === estimator && g.value === value);
    const values = group ? finiteValues(group, metric) : [];
    const [low, high] = quantiles(values, [0.05, 0.95]);
    return {mean: values.length ? meanOf(values) : NaN, low, high};
  });
  const losses = spreads.map(({mean}) => lossOf(metric, mean));
  const least = Math.min(...losses.filter(Number.isFinite));
  return {estimator, spreads, best: losses.indexOf(least)};
}

/** Band, line and dots of an estimator. */
function spreadLayers({estimator, spreads}, metric, axis) {
  const x = axis.positions;
  const y = spreads.map(({mean}) => mean);
  const unit = metricUnit(metric);
  const tip = (i) => {
    const {mean, low, high} = spreads[i];
    const interval = `90 % in ${withUnit(low, unit)} to ${withUnit(high, unit)}`;
    const title = element('b', {}, `${SWEEP.vary} = ${axis.ticks[i][1]}`);
    return [title, `${estimator}: mean ${withUnit(mean, unit)}, ${interval}`];
  };
  const lo = spreads.map(({low}) => low);
  const hi = spreads.map(({high}) => high);
  return [
    {kind: 'band', x, lo, hi, est: estimator, fill: 0.13},
    {kind: 'line', x, y, est: estimator, name: estimator, width: 2},
    {kind: 'dots', x, y, est: estimator, size: 3.2, tip},
  ];
}

function variedFigure(metric, axis) {
  const lines = NAMES.map((name) => spreadOf(name, metric));
  const values = lines.flatMap(({spreads}) => spreads.flatMap(Object.values));
  const paintBest = (surface, X, Y) => {
    for (const {estimator, spreads, best} of lines) {
      if (!shown(estimator) || best < 0) continue;
      const style = {size: 16, align: 'center', color: colorOf(estimator), halo: true};
      surface.text('★', X.to(axis.positions[best]), Y.to(spreads[best].mean) - 13, style);
    }
  };
  const one = {kind: 'h', v: 1, color: () => colours.muted, dash: [2, 3]};
  return {
    title: metricName(metric),
    plots: [
      new Plot({
        label: 'mean',
        name: metric,
        height: 210,
        x: {label: SWEEP.vary, unit: '', log: axis.log, ticks: axis.ticks},
        y: {unit: metricUnit(metric), log: isLogMetric(metric, values)},
        layers: () => [
          SWEEP.goals[metric] === 'one' && one,
          ...lines.flatMap((line) => spreadLayers(line, metric, axis)),
          {kind: 'custom', x: null, paint: paintBest},
        ],
      }),
    ],
  };
}

/** Reprojection errors over the frames: a figure for each estimator and sensor. */
function reprojectionFigure({estimator, sensor, unit, series}) {
  const labels = new Map(variedValues().map(({value, label}) => [value, label]));
  const lines = series.map(({value, frame, rms}, i) => ({
    kind: 'line',
    x: columnOf(frame),
    y: columnOf(rms),
    color: () => seriesColour(i),
    dash: seriesDash(i),
    name: labels.get(value),
  }));
  const legend = lines.map(({name}, i) =>
    element('span', {class: 'seriesname', style: `color: ${seriesColour(i)}`}, `${name} `),
  );
  return {
    title: `Reprojection error, ${estimator}, ${sensor}`,
    controls: element('span', {}, `${SWEEP.vary} = `, legend),
    plots: [
      new Plot({
        label: 'RMS of z − h, mean of the runs',
        name: 'reprojection error',
        height: 210,
        x: {label: 'frame', unit: ''},
        y: {unit, log: true},
        layers: () => (shown(estimator) ? lines : []),
      }),
    ],
  };
}

function varySection(main) {
  const subtitle = 'mean of the runs; the band contains 90 % of them; ★ marks the best value';
  const box = section('vary', `Effect of ${SWEEP.vary}`, subtitle, main);
  const grid = element('div', {class: 'cols'});
  const axis = valueAxis();
  box.append(grid);
  for (const metric of SWEEP.varied_metrics) figure(grid, variedFigure(metric, axis));
  for (const errors of SWEEP.reprojection) figure(grid, reprojectionFigure(errors));
}
