// SPDX-License-Identifier: Apache-2.0
// Trajectories and landmarks of a map.

/** {e, name, t, p, sigma, covariance, error, orientation} of each estimator with a position. */
const mapTracks = () =>
  RUN.estimators
    .filter((e) => e.position)
    .map((e) => {
      const block = e.blocks.find((b) => b.name === e.position);
      const orientation = e.blocks.find((b) => b.name === e.orientation);
      const [x, y, z] = block.value.map(columnOf);
      return {
        e,
        name: e.name,
        block,
        t: columnOf(e.t),
        p: [x, y, z || new Float32Array(x.length)],
        sigma: block.sigma.map(columnOf),
        covariance: (e.position_cov || []).map(columnOf),
        error: block.error.map(columnOf),
        orientation: orientation && orientation.value.map(columnOf),
      };
    });

/** {t, p} of the true position, or null. */
function mapTruth({block}) {
  const [x, y, z] = block.elements.map((name) => truthOf(block, name));
  return x ? {t: columnOf(RUN.t), p: [x, y, z || new Float32Array(x.length)]} : null;
}

const positionAt = ({p}, i) => p.map((column) => column[i]);

/** The covariance of the position in row i; of unknown correlations, the diagonal. */
function positionCovariance({sigma, covariance}, i) {
  const [xx, yy, zz] = sigma.map((column) => column[i] ** 2);
  const [xy, xz, yz] = [0, 1, 2].map((k) => (covariance[k] ? covariance[k][i] : 0));
  return [
    [xx, xy, xz],
    [xy, yy, yz],
    [xz, yz, zz || 0],
  ];
}

const landmarkAt = (map, i) => [map.x[i], map.y[i], map.z[i]];
const trueLandmarkAt = (map, i) => [map.tx[i], map.ty[i], map.tz[i]];

const landmarkCovariance = (map, i) => [
  [map.sx[i] ** 2, map.cxy[i], map.cxz[i]],
  [map.cxy[i], map.sy[i] ** 2, map.cyz[i]],
  [map.cxz[i], map.cyz[i], map.sz[i] ** 2],
];

const isKnownPlace = (p) => p.every(Number.isFinite);

/** Points of a trajectory, at most about 600. */
function samplePath(track) {
  const step = Math.max(1, Math.floor(track.t.length / 600));
  const points = [];
  for (let i = 0; i < track.t.length; i += step) points.push(positionAt(track, i));
  return points.filter(isKnownPlace);
}

/** True places of the landmarks; of unknown ones, the estimates. */
const landmarkPlaces = (map) =>
  Array.from(map.x, (_, i) => {
    const truth = trueLandmarkAt(map, i);
    return isKnownPlace(truth) ? truth : landmarkAt(map, i);
  }).filter(isKnownPlace);
