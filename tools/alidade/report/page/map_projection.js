// SPDX-License-Identifier: Apache-2.0
// Parallel projection of a map, from above, from the side or from any direction.

/** Rotates the vectors a and b in their plane by an angle. */
const rotatePair = (a, b, angle) => [
  a.map((v, k) => v * Math.cos(angle) + b[k] * Math.sin(angle)),
  b.map((v, k) => v * Math.cos(angle) - a[k] * Math.sin(angle)),
];

const negated = (v) => v.map((c) => -c);

/** The vector or its negative, so that its largest component is positive. */
function oriented(v) {
  const largest = [0, 1, 2].reduce((m, k) => (Math.abs(v[k]) > Math.abs(v[m]) ? k : m), 0);
  return v[largest] < 0 ? negated(v) : v;
}

/**
 * The plane in which the points of the path vary most; for a straight path, the plane of path and
 * landmarks. Returns {basis: [right, up, normal], name}.
 */
function fitPlane(path, landmarks) {
  let axes = cloud(path);
  let name = 'the plane of the path';
  const isStraight = axes.values[1] < 0.02 * axes.values[0];
  if (isStraight && landmarks.length > 3) {
    axes = cloud(path.concat(landmarks));
    name = 'the plane of path and landmarks';
  }
  const normal = oriented(axes.rows[2]);
  const right = oriented(axes.rows[0]);
  return {basis: [right, cross3(normal, right), normal], name};
}

/** Rows of `axes`: the directions to the right, upwards and towards the viewer. */
class Projection {
  constructor(points, basis) {
    this.points = points;
    this.basis = basis;
    const ends = [0, 1, 2].map((k) =>
      quantiles(
        points.map((p) => p[k]),
        [0.02, 0.98],
      ),
    );
    this.centre = ends.map(([a, b]) => (a + b) / 2);
    this.scale = 0; // pixels per metre; 0: fitted at the next drawing
  }

  /** Looks from above, from the side, or obliquely. */
  look(mode) {
    const [right, up, normal] = this.basis;
    this.mode = mode;
    this.scale = 0;
    if (mode === 'top') this.axes = [right, up, normal];
    else if (mode === 'side') this.axes = [right, normal, negated(up)];
    else {
      const [turned] = rotatePair(right, up, -0.6);
      const [viewer] = rotatePair(negated(cross3(normal, turned)), normal, 0.55);
      this.axes = [turned, cross3(viewer, turned), viewer];
    }
  }

  /** Sets the size of the picture. Fits the view if it has no scale. `cut`: share of far points. */
  resize(width, height, cut) {
    this.width = width;
    this.height = height;
    if (this.scale > 0) return;
    const [right, up, viewer] = this.axes;
    const rangeOf = (axis) =>
      quantiles(
        this.points.map((p) => dot3(axis, p)),
        [cut, 1 - cut],
      );
    const [x, y] = [rangeOf(right), rangeOf(up)];
    const middle = [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2, dot3(viewer, this.centre)];
    this.centre = [0, 1, 2].map((k) => sum(this.axes.map((axis, i) => middle[i] * axis[k])));
    const scaleOf = ([a, b], size) => size / Math.max(b - a, 1e-9);
    this.scale = 0.88 * Math.min(scaleOf(x, width - 30), scaleOf(y, height - 60));
  }

  project(p) {
    const d = p.map((v, k) => v - this.centre[k]);
    const x = this.width / 2 + this.scale * dot3(this.axes[0], d);
    return [x, this.height / 2 - this.scale * dot3(this.axes[1], d)];
  }

  /** Outline of the 3-sigma ellipsoid of a covariance. It is exact in a parallel projection. */
  ellipse(place, covariance) {
    const part = (a, b) => dot3(a, covariance.map((row) => dot3(row, b)));
    const [right, up] = this.axes;
    const [xx, xy, yy] = [part(right, right), part(right, up), part(up, up)];
    const middle = (xx + yy) / 2;
    const half = Math.hypot((xx - yy) / 2, xy);
    const angle = 0.5 * Math.atan2(2 * xy, xx - yy);
    const [a, b] = [middle + half, middle - half].map(
      (v) => 3 * this.scale * Math.sqrt(Math.max(0, v)),
    );
    if (!(a > 0.7) || a > 4000) return [];
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const points = [];
    for (let i = 0; i <= 40; i++) {
      const [x, y] = [a * Math.cos((i * Math.PI) / 20), b * Math.sin((i * Math.PI) / 20)];
      points.push(place[0] + x * c - y * s, place[1] - x * s - y * c);
    }
    return points;
  }

  turn(dx, dy) {
    let [right, up, viewer] = this.axes;
    [right, viewer] = rotatePair(right, viewer, dx);
    [up, viewer] = rotatePair(up, viewer, -dy);
    this.axes = [cross3(up, viewer), up, viewer];
    this.mode = '3d';
  }

  move(dx, dy) {
    const [right, up] = this.axes;
    this.centre = this.centre.map((v, k) => v - (dx * right[k] - dy * up[k]) / this.scale);
  }
}
