#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/cluster/slurm_test.sh PROGRAM
#
# Runs scripts/cluster/slurm_array.sh on a temporary Slurm cluster that consists of this machine
# only. The merged shards must have the same bytes as a sweep in one process. If a task is
# cancelled, a second submission with the same arguments must finish its shard. Exit code 77: Slurm
# is not installed.
set -euo pipefail
ALIDADE=$(realpath "$1")
export ALIDADE
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
PATH=$PATH:/usr/sbin:/sbin
for program in sbatch slurmctld slurmd munged; do
  command -v "$program" >/dev/null || exit 77
done

work=$(mktemp -d)
daemons=()
finish() {
  for ((i = ${#daemons[@]} - 1; i >= 0; --i)); do
    kill "${daemons[i]}" 2>/dev/null || true
    wait "${daemons[i]}" 2>/dev/null || true
  done
  rm -rf "$work"
}
trap finish EXIT
fail() {
  echo "error: $*" >&2
  tail -n 20 "$work"/*.log "$work"/*.shards/*.log >&2 || true
  exit 1
}
# Repeats a command until it succeeds, for at most five minutes.
eventually() {
  for ((i = 0; i < 3000; ++i)); do
    "$@" >/dev/null 2>&1 && return
    sleep 0.1
  done
  fail "no success within five minutes: $*"
}

# ---- Slurm

user=$(id -un) host=$(hostname -s) port=$((20000 + $$ % 20000))
chmod 755 "$work"
mkdir "$work/state" "$work/spool"
head -c 1024 /dev/urandom >"$work/munge.key"
chmod 600 "$work/munge.key"
cat >"$work/slurm.conf" <<CONF
ClusterName=alone
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_interval=1
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=2
PartitionName=all Nodes=ALL Default=YES State=UP
CONF
export SLURM_CONF=$work/slurm.conf
munged --foreground --force --key-file="$work/munge.key" --socket="$work/munge.socket" \
  --pid-file="$work/munge.pid" --log-file="$work/munged.log" --seed-file="$work/munge.seed" \
  >"$work/munge_out.log" 2>&1 &
daemons+=($!)
eventually test -S "$work/munge.socket"
slurmctld -D -f "$SLURM_CONF" >"$work/slurmctld.log" 2>&1 &
daemons+=($!)
slurmd -D -f "$SLURM_CONF" -N "$host" >"$work/slurmd.log" 2>&1 &
daemons+=($!)
is_up() { [[ $(sinfo --noheader --format=%T) == idle ]]; }
eventually is_up

# ---- the script under test

has_ended() { [[ -z $(squeue --noheader) ]]; }
config=examples/05_depth_principled/config.yaml
whole() { "$ALIDADE" sweep "$config" -o "$work/$1_whole" --quiet "${@:2}"; }

whole first --runs 20
scripts/cluster/slurm_array.sh --cpus-per-task=1 -- 3 "$work/first" "$config" --runs 20
eventually test -e "$work/first"
eventually has_ended
diff -r "$work/first_whole" "$work/first" || fail "the merged shards differ from the sweep in one process"

# Cancels the job while both shards are running. The finished runs are kept, and nothing is merged.
runs=(--runs 800 --set source.duration_s=60)
scripts/cluster/slurm_array.sh -- 2 "$work/second" "$config" "${runs[@]}"
has_begun() { test -s "$work/second.shards/$1.partial/finished_runs.jsonl"; }
eventually has_begun 1
eventually has_begun 2
scancel --name=sweep
eventually has_ended
[[ ! -e $work/second ]] || fail "the sweep was merged although a shard is not finished"
grep -q '"status": "stopped"' "$work/second.shards/2.partial/sweep.json" || fail "shard 2 does not have the status 'stopped'"
grep -q 'second.shards/[12]: the sweep is not finished' "$work/second.shards/merge.log" ||
  fail "merge.log does not name the unfinished shard"
scripts/cluster/slurm_array.sh -- 2 "$work/second" "$config" "${runs[@]}"
eventually test -e "$work/second"
eventually has_ended
whole second "${runs[@]}"
diff -r "$work/second_whole" "$work/second" || fail "the resumed shards differ from the sweep in one process"
echo "ok"
