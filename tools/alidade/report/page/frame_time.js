// SPDX-License-Identifier: Apache-2.0
// Figure of the wall-clock time of each frame, from a timing.csv that the reader selects.

/** Parses timing.csv to {times, estimators: [{name, seconds}]}. */
function parseTiming(text) {
  const [header, ...rows] = text
    .trim()
    .split('\n')
    .map((line) => line.split(','));
  const column = (k) => Float64Array.from(rows, (row) => (row[k] ? Number(row[k]) : NaN));
  return {
    times: column(0).map((t) => t - RUN.t0),
    estimators: header.slice(1).map((name, k) => ({name, seconds: column(k + 1)})),
  };
}

function frameTimeFigure({times, estimators}) {
  const period = times.length > 1 ? medianStep(times) : 0;
  const loads = estimators.map(({name, seconds}) => {
    const total = sum(seconds.filter(Number.isFinite));
    return `${name} ${percent(total / (period * times.length))}`;
  });
  const lines = estimators.map(({name, seconds}) => ({
    kind: 'line',
    x: times,
    y: seconds,
    est: name,
    name,
    width: 1,
  }));
  return {
    title: 'Wall-clock time of each frame',
    hint: period
      ? `The dashed line is the frame period, ${withUnit(period, 's')}. Share of real time: ` +
        `${loads.join(', ')}.`
      : '',
    plots: [
      new Plot({
        label: 'wall-clock time',
        time: true,
        height: 190,
        y: {unit: 's', log: true},
        layers: () => [period && {kind: 'h', v: period, color: () => colours.muted}, ...lines],
      }),
    ],
  };
}

function frameTimePanel(box) {
  const onchange = async (event) => {
    const text = await event.target.files[0].text();
    setContent(box);
    figure(box, frameTimeFigure(parseTiming(text)));
  };
  const input = element('input', {type: 'file', accept: '.csv', onchange});
  box.append(element('label', {class: 'panel'}, 'Select timing.csv of this folder: ', input));
}
