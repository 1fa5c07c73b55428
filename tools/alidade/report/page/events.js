// SPDX-License-Identifier: Apache-2.0
// Events and segments near a time.

/** [estimator, event] of what is shown; with t: of those within tolerance of it, nearest first. */
function eventsNear(t, tolerance) {
  const all = RUN
    ? RUN.estimators
        .filter((e) => shown(e.name))
        .flatMap((e) =>
          e.events
            .filter((v) => t === undefined || (v[0] !== null && Math.abs(v[0] - t) < tolerance))
            .map((v) => [e.name, v]),
        )
    : [];
  return t === undefined ? all : all.sort((a, b) => Math.abs(a[1][0] - t) - Math.abs(b[1][0] - t));
}

/** Of segments that complement each other, those "without" a sensor are shaded. */
function shaded() {
  const s = ((RUN && RUN.segments) || []).filter(
    (g) =>
      g.spans.length &&
      g.spans.length < 200 &&
      sum(g.spans.map((q) => q[1] - q[0])) < 0.97 * (page.full[1] - page.full[0]),
  );
  const w = s.filter((g) => g.rule.startsWith('without'));
  return w.length ? w : s;
}
