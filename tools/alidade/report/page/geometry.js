// SPDX-License-Identifier: Apache-2.0
// Vectors, rotations and principal axes in three dimensions.

const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

const cross3 = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

function eigen3(A) {
  // Jacobi; eigenvectors as rows, greatest first
  const a = A.map((r) => r.slice());
  const V = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  for (let sweep = 0; sweep < 20; sweep++)
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ]) {
      if (Math.abs(a[p][q]) < 1e-300) continue;
      const th = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const t = Math.sign(th || 1) / (Math.abs(th) + Math.hypot(th, 1));
      const c = 1 / Math.hypot(t, 1);
      const s = t * c;
      for (let k = 0; k < 3; k++) {
        const x = a[k][p];
        const y = a[k][q];
        a[k][p] = c * x - s * y;
        a[k][q] = s * x + c * y;
      }
      for (let k = 0; k < 3; k++) {
        const x = a[p][k];
        const y = a[q][k];
        a[p][k] = c * x - s * y;
        a[q][k] = s * x + c * y;
      }
      for (let k = 0; k < 3; k++) {
        const x = V[p][k];
        const y = V[q][k];
        V[p][k] = c * x - s * y;
        V[q][k] = s * x + c * y;
      }
    }
  const order = [0, 1, 2].sort((i, j) => a[j][j] - a[i][i]);
  return {values: order.map((i) => a[i][i]), rows: order.map((i) => V[i])};
}

function cloud(points) {
  const m = [0, 1, 2].map((k) => sum(points.map((p) => p[k])) / points.length);
  const A = [0, 1, 2].map(() => [0, 0, 0]);
  for (const p of points)
    for (let i = 0; i < 3; i++)
      for (let j = 0; j < 3; j++) A[i][j] += ((p[i] - m[i]) * (p[j] - m[j])) / points.length;
  return eigen3(A);
}

/**
 * Roll, pitch and yaw [rad] of columns w, x, y, z: continuous over time, or, if `near` is given,
 * within half a turn of these angles.
 */
function rollPitchYaw(q, near) {
  const [w, x, y, z] = q;
  const n = w.length;
  const out = [0, 1, 2].map(() => new Float32Array(n));
  for (let i = 0; i < n; i++) {
    const e = [
      Math.atan2(2 * (w[i] * x[i] + y[i] * z[i]), 1 - 2 * (x[i] * x[i] + y[i] * y[i])),
      Math.asin(clamp(2 * (w[i] * y[i] - z[i] * x[i]), -1, 1)),
      Math.atan2(2 * (w[i] * z[i] + x[i] * y[i]), 1 - 2 * (y[i] * y[i] + z[i] * z[i])),
    ];
    for (let k = 0; k < 3; k++) {
      const anchor = near && Number.isFinite(near[k][i]) ? near[k][i] : i ? out[k][i - 1] : e[k];
      out[k][i] = e[k] - 2 * Math.PI * Math.round((e[k] - anchor) / (2 * Math.PI) || 0);
    }
  }
  return out;
}
