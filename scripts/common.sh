# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
#
# What the scripts share; they source it from the top of the tree.

# Compilers at once: one for each processor, and one for each 2 GiB of memory.
jobs=$(nproc)
memory_jobs=$(awk '/^MemAvailable:/ { print int($2 / 2097152) }' /proc/meminfo)
((memory_jobs < jobs)) && jobs=$((memory_jobs > 1 ? memory_jobs : 1))
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-$jobs}
export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$jobs}

if command -v ccache >/dev/null; then
  export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi

# Runs a command and shows what it printed only when it fails.
quietly() {
  local log
  log=$(mktemp)
  if ! "$@" >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    echo "error: failed: $*" >&2
    return 1
  fi
  rm -f "$log"
}
