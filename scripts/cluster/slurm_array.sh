#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# scripts/cluster/slurm_array.sh [OPTION OF SBATCH...] -- SHARDS OUT CONFIG --runs N [OPTION...]
#
# Submits `alidade sweep CONFIG --runs N ...` to Slurm: an array job with a task for each of SHARDS
# shards, and a job that merges them into OUT once all tasks have ended. The options of sbatch are
# those of both jobs:
#
#   scripts/cluster/slurm_array.sh --cpus-per-task=4 -- 16 runs/big config.yaml --runs 10000
#
# Shards and logs go to OUT.shards. A task that was stopped, killed or requeued keeps its finished
# runs: to finish the others, submit the same again. ALIDADE names the program; default:
# alidade.
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
  array=${array%%;*} # of `ID;CLUSTER`
  # afterany: `alidade merge` names shards that are missing or unfinished.
  merge=$(sbatch --parsable --job-name=merge --dependency="afterany:$array" --open-mode=append \
    --output="$out.shards/merge.log" "${options[@]}" "$0" --merge "$shards" "$out")
  echo "submitted: shards $array, merge ${merge%%;*}"
}

# A signal of Slurm, as before the end of the time limit, is to reach the program: hence exec.
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
