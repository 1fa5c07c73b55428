#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# mpirun -n N scripts/cluster/mpi_shard.sh OUT CONFIG --runs R [OPTION...]
#
# Runs, as rank i of N, counted from 0, shard i + 1 of `alidade sweep CONFIG --runs R ...` with one
# thread, into OUT.shards. The ranks need no communication: OpenMPI, MPICH and `srun -n N` will do.
# When all have ended, merge them; `&&` does so only where none was stopped:
#
#   mpirun -n 64 scripts/cluster/mpi_shard.sh runs/big config.yaml --runs 10000 &&
#     alidade merge runs/big.shards/* -o runs/big
#
# Run again, it goes on where it was. ALIDADE names the program; default: alidade.
set -euo pipefail

rank=${OMPI_COMM_WORLD_RANK:-${PMI_RANK:-${SLURM_PROCID:-}}}
size=${OMPI_COMM_WORLD_SIZE:-${PMI_SIZE:-${SLURM_NTASKS:-}}}
if (($# < 2)) || [[ -z $rank || -z $size ]]; then
  echo "usage: mpirun -n N $0 OUT CONFIG --runs R [OPTION...]" >&2
  exit 2
fi
out=${1%/}
shift
mkdir -p "$out.shards"

"${ALIDADE:-alidade}" sweep "$@" --shard "$((rank + 1))/$size" --quiet --resume --jobs 1 \
  -o "$out.shards/$((rank + 1))" &
program=$!
trap 'kill -TERM $program 2>/dev/null || true' INT TERM
while true; do
  code=0
  wait "$program" || code=$?
  kill -0 "$program" 2>/dev/null || break # else it was a signal to this script
done
# Some runs failed: the shard is complete all the same, and the other ranks are not to be ended.
((code != 1)) || code=0
exit "$code"
