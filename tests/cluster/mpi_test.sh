#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/cluster/mpi_test.sh PROGRAM
#
# Runs scripts/cluster/mpi_shard.sh under mpirun. The merged shards of all ranks must have the same
# bytes as a sweep in one process. Exit code 77: mpirun is not installed.
set -euo pipefail
ALIDADE=$(realpath "$1")
export ALIDADE
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
command -v mpirun >/dev/null || exit 77
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
config=examples/05_depth_principled/config.yaml

"$ALIDADE" sweep "$config" --runs 20 -o "$work/whole" --quiet
mpirun --oversubscribe -n 3 scripts/cluster/mpi_shard.sh "$work/mpi" "$config" --runs 20
"$ALIDADE" merge "$work/mpi.shards"/* -o "$work/mpi" --quiet
diff -r "$work/whole" "$work/mpi"

# A run that fails does not end the other ranks.
printf 't_s,d\n0,80\n0.1,none\n' >"$work/table.csv"
cat >"$work/table.yaml" <<'YAML'
alidade: 1
state:
  target:
    model: constant_velocity
    blocks: {position: depth, velocity: depth_rate}
    noise: {kind: discrete, acceleration: 1.0}
    initial: {depth: {mean: 0.3, sigma: 0.1}, depth_rate: {mean: 0, sigma: 0.5}}
sensors:
  stereo: {model: stereo_disparity, stream: disparity, roles: {depth: target.depth},
           focal_px: 400, baseline_m: 0.065, sigma_px: 1.0}
source: {type: tables, path: table.csv, streams: {disparity: d}}
estimators: {ekf: {type: ekf}}
YAML
mpirun --oversubscribe -n 3 scripts/cluster/mpi_shard.sh "$work/bad" "$work/table.yaml" --runs 6 \
  2>"$work/stderr"
code=0
"$ALIDADE" merge "$work/bad.shards"/* -o "$work/bad" --quiet 2>>"$work/stderr" || code=$?
((code == 1))
[[ $(wc -l <"$work/bad/failures.csv") == 7 ]]
echo "ok"
