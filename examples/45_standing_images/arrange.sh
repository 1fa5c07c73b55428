#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# arrange.sh CAMERA POSES FOLDER
#
# Arranges the images of a camera of EuRoC, with nanoseconds as names, for the source image_tracks:
# FOLDER/data with the images, FOLDER/data.csv with their times, and FOLDER/sensor.yaml. POSES is
# the table of the true poses of the body. The script writes those of the camera, relative to the
# first image, to FOLDER/data/truth.tum.
set -euo pipefail
mkdir -p "$3/data"
cp "$1"/*.png "$3/data"
cp "$1/sensor.yaml" "$3"
(cd "$3/data" && printf '%s\n' *.png | sed 's/\(.*\)\.png/\1,&/' > ../data.csv)

# T_BS is the pose of the camera in the body: R b + t.
sed -n '/data:/,/\]/p' "$1/sensor.yaml" | tr -c '0-9e.+-' ' ' > "$3/camera.txt"
awk -F, '
  # Rotates the vector v by the quaternion q, or by its inverse for s = -1.
  function rotate(q, s, v,    u, i) {
    for (i = 1; i <= 3; ++i) u[i] = s * q[i]
    cross(u, v, c); cross(u, c, d)
    for (i = 1; i <= 3; ++i) v[i] += 2 * (q[0] * c[i] + d[i])
  }
  function cross(a, b, out) {
    out[1] = a[2] * b[3] - a[3] * b[2]
    out[2] = a[3] * b[1] - a[1] * b[3]
    out[3] = a[1] * b[2] - a[2] * b[1]
  }
  # Rotates a vector from the body to the camera.
  function to_camera(v,    i, w) {
    for (i = 1; i <= 3; ++i) w[i] = m[i] * v[1] + m[4 + i] * v[2] + m[8 + i] * v[3]
    for (i = 1; i <= 3; ++i) v[i] = w[i]
  }
  FILENAME ~ /camera.txt$/ { split($0, m, " "); next }
  FILENAME ~ /data.csv$/ { is_image[$1] = 1; next }
  $1 in is_image {
    for (i = 0; i <= 3; ++i) q[i] = $(5 + i)
    for (i = 1; i <= 3; ++i) p[i] = m[4 * i]
    rotate(q, 1, p)                                      # position of the camera
    for (i = 1; i <= 3; ++i) p[i] += $(1 + i)
    if (!n++) for (i = 0; i <= 3; ++i) { q0[i] = q[i]; p0[i] = p[i] }
    for (i = 1; i <= 3; ++i) { p[i] -= p0[i]; a[i] = q0[i]; b[i] = q[i] }
    rotate(q0, -1, p); to_camera(p)
    w = q0[0] * q[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    cross(a, b, c)                                       # q0^-1 q
    for (i = 1; i <= 3; ++i) r[i] = q0[0] * b[i] - q[0] * a[i] - c[i]
    to_camera(r)
    printf "%s.%s %.6f %.6f %.6f %.6f %.6f %.6f %.6f\n", substr($1, 1, 10), substr($1, 11),
           p[1], p[2], p[3], r[1], r[2], r[3], w
  }' "$3/camera.txt" "$3/data.csv" "$2" > "$3/data/truth.tum"
rm "$3/camera.txt"
