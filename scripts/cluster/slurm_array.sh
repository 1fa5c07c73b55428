#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# scripts/cluster/slurm_array.sh [OPTION OF SBATCH...] -- SHARDS OUT CONFIG --runs N [OPTION...]
#
# Submits `alidade sweep CONFIG --runs N ...` to Slurm: an array job with one task for each of
# SHARDS shards, and a job that merges the shards into OUT after all tasks have ended. Both jobs use
# the options of sbatch:
#
#   scripts/cluster/slurm_array.sh --cpus-per-task=4 -- 16 runs/big config.yaml --runs 10000
#
# Writes shards and logs to OUT.shards. If a task is stopped, killed or requeued, its finished runs
# remain. To complete the other runs, submit the same command again. The environment variable
# ALIDADE contains the path of the program; default: alidade.
set -euo pipefail
alidade=${ALIDADE:-alidade}

submit() {
  local options=() shards out array merge
  while (($#)) && [[ $1 != -- ]]; do
    options+=("$1")
    shift
  done
  if (($# < 4)) || ! [[ $2 =~ ^[1-9][0-9]*$ ]]; then
    echo "usage: $0 [OPTION OF SBATCH...] -- SHARDS OUT CONFIG --runs N [OPTION...]" >&2
    exit 2
  fi
  shards=$2 out=${3%/}
  shift 3
  mkdir -p "$out.shards"
  array=$(sbatch --parsable --job-name=sweep --array="1-$shards" --requeue --open-mode=append \
    --output="$out.shards/%a.log" "${options[@]}" "$0" --task "$shards" "$out" "$@")
  array=${array%%;*} # the job ID, without `;CLUSTER`
  # The merge starts after any end of the tasks (`afterany`), because `alidade merge` reports
  # missing and unfinished shards.
  merge=$(sbatch --parsable --job-name=merge --dependency="afterany:$array" --open-mode=append \
    --output="$out.shards/merge.log" "${options[@]}" "$0" --merge "$shards" "$out")
  echo "submitted: shards $array, merge ${merge%%;*}"
}

# `exec` replaces the shell, so the signals that Slurm sends, for example before the time limit,
# reach the program.
case ${1:-} in
  --task)
    shards=$2 out=$3
    shift 3
    exec "$alidade" sweep "$@" --shard "$SLURM_ARRAY_TASK_ID/$shards" --quiet --resume \
      --jobs "${SLURM_CPUS_PER_TASK:-1}" -o "$out.shards/$SLURM_ARRAY_TASK_ID"
    ;;
  --merge)
    folders=()
    for ((i = 1; i <= $2; ++i)); do folders+=("$3.shards/$i"); done
    exec "$alidade" merge "${folders[@]}" -o "$3"
    ;;
  *) submit "$@" ;;
esac
