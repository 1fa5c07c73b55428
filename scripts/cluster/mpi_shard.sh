#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# mpirun -n N scripts/cluster/mpi_shard.sh OUT CONFIG --runs R [OPTION...]
#
# Runs one shard of `alidade sweep CONFIG --runs R ...` with one thread. Rank i of N, counted from
# 0, runs shard i + 1. Writes to OUT.shards. The ranks do not communicate, so OpenMPI, MPICH and
# `srun -n N` are suitable. Merge the shards when all ranks have ended. Because of `&&` in this
# example, the merge runs only if no rank was stopped:
#
#   mpirun -n 64 scripts/cluster/mpi_shard.sh runs/big config.yaml --runs 10000 &&
#     alidade merge runs/big.shards/* -o runs/big
#
# A second call resumes the sweep. The environment variable ALIDADE contains the path of the
# program; default: alidade.
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
  kill -0 "$program" 2>/dev/null || break # otherwise a signal interrupted `wait`
done
# Code 1 means that some runs failed, but the shard is complete. This script then exits with 0, so
# mpirun does not end the other ranks.
((code != 1)) || code=0
exit "$code"
