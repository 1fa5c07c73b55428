// SPDX-License-Identifier: Apache-2.0
// Figure "NEES over time".

function neesFigure(box) {
  const all = RUN.estimators.flatMap((e) => e.nees);
  const owners = unique(all.map((nees) => nees.owner));
  if (!owners.length) return;
  const plotOf = (owner, i) => {
    const {dof} = all.find((nees) => nees.owner === owner);
    const lines = () =>
      RUN.estimators.map((e) => {
        const nees = e.nees.find((q) => q.owner === owner);
        if (!nees || isZero(nees.v)) return null;
        const points = knownPart(columnOf(e.t), columnOf(nees.v));
        return {kind: 'line', ...points, est: e.name, name: e.name, width: 1.3};
      });
    const label = `NEES of ${owner}, ${plural(dof, 'degree')} of freedom`;
    const one = {kind: 'h', v: 1, color: () => colours.muted, dash: [2, 3]};
    const layers = () => [chiSquareZone(dof), one, ...lines()];
    return logPlot({label, name: 'NEES of ' + owner, layers}, i, owners.length);
  };
  figure(box, {
    title: 'NEES over time',
    hint:
      'Squared error by the covariance P that the estimator reports, per degree of freedom. ' +
      'Consistent: 95 % of the timestamps are in the green zone. Above: overconfident. ' +
      'Below: underconfident.',
    plots: owners.map(plotOf),
  });
}
