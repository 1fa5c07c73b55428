# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
#
# Functions and settings that all scripts use. A script sources this file in the root folder of the
# repository, under `set -o pipefail`.

# Number of parallel compilers: at most one for each processor, and at most one for each 2 GiB of
# memory.
jobs=$(nproc)
memory_jobs=$(awk '/^MemAvailable:/ { print int($2 / 2097152) }' /proc/meminfo)
((memory_jobs < jobs)) && jobs=$((memory_jobs > 1 ? memory_jobs : 1))
# One more test than processors, because many tests wait.
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-$((jobs + 1))}
export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$jobs}

if command -v ccache >/dev/null; then
  export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi

# Shows the progress `[done/all]` that its input reports. On a terminal, each report replaces the
# previous one. Otherwise, one line is printed after each tenth of the work.
progress() {
  local line tenth=0
  while IFS= read -r line; do
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    if [[ -t 2 ]]; then
      printf '\r%-12s' "${BASH_REMATCH[0]}" >&2
    elif ((BASH_REMATCH[1] * 10 / BASH_REMATCH[2] > tenth)); then
      tenth=$((BASH_REMATCH[1] * 10 / BASH_REMATCH[2]))
      printf '  %s\n' "${BASH_REMATCH[0]}" >&2
    fi
  done
  [[ ! -t 2 ]] || printf '\r%12s\r' '' >&2
}

# Runs a command. Shows the output of the command only if the command fails.
quietly() {
  local log
  log=$(mktemp)
  if ! "$@" 2>&1 | tee "$log" | progress; then
    cat "$log" >&2
    rm -f "$log"
    echo "error: this command failed: $*" >&2
    return 1
  fi
  rm -f "$log"
}
