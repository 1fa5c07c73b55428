// SPDX-License-Identifier: Apache-2.0
// Section "Consistency": NEES, NIS and whiteness of the innovations.

/** Zone that contains 95 % of chi-square / dof. */
const chiSquareZone = (dof) => ({
  kind: 'hband',
  lo: chi2inv(0.025, dof) / dof,
  hi: chi2inv(0.975, dof) / dof,
  ...GOOD_ZONE,
});

/** A plot over time on a logarithmic axis; the last of several has the time labels. */
const logPlot = (spec, i, count) =>
  new Plot({
    time: true,
    first: !i,
    last: i === count - 1,
    height: i === count - 1 ? 160 : 132,
    y: {log: true, unit: ''},
    ...spec,
  });

function consistencySection(main) {
  const sensors = unique(RUN.estimators.flatMap((e) => e.innovations.map((I) => I.sensor)));
  const hasNis = (e, sensor) => {
    const I = innovationsOf(e, sensor);
    return I && columnOf(I.nis).some(Number.isFinite);
  };
  const tested = sensors.filter((sensor) => RUN.estimators.some((e) => hasNis(e, sensor)));
  const hasNees = RUN.estimators.some((e) => e.nees.length);
  if (!tested.length && !hasNees) return;
  const box = section('consistency', 'Consistency', 'are the errors as large as σ?', main);
  neesFigure(box);
  if (!tested.length) return;
  nisFigure(box, tested);
  const isWhole = (sensor) =>
    RUN.estimators.every((e) => {
      const I = innovationsOf(e, sensor);
      return !I || !isThinned(e, I);
    });
  const whole = tested.filter(isWhole);
  if (!whole.length) return;
  fold(
    box,
    'Whiteness of the innovations',
    'histogram and autocorrelation, sensor by sensor',
    (parent) => whole.forEach((sensor) => whitenessFigures(parent, sensor)),
  );
}
