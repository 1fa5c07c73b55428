#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/install/add_plugin_test.sh CMAKE COMPILER
#
# Configures tests/install/echo with the function alidade_add_plugin of this tree. By default the
# plugin must be compiled with -O2. If the build type or the flags set another optimisation level,
# the plugin must be compiled with that level.
set -euo pipefail
cmake=$1 compiler=$2
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Writes a package configuration that replaces the installed one.
mkdir "$work/package"
cat >"$work/package/alidadeConfig.cmake" <<END
add_library(alidade::model INTERFACE IMPORTED)
include($PWD/cmake/AlidadeAddPlugin.cmake)
END
echo 'set(PACKAGE_VERSION_COMPATIBLE TRUE)' >"$work/package/alidadeConfigVersion.cmake"

# levels OPTION...: prints the optimisation levels with which the plugin is compiled.
levels() {
  rm -rf "$work/build"
  "$cmake" -S tests/install/echo -B "$work/build" -G Ninja -DCMAKE_EXPORT_COMPILE_COMMANDS=ON \
    -DCMAKE_CXX_COMPILER="$compiler" -Dalidade_DIR="$work/package" "$@" >"$work/log" 2>&1 ||
    { cat "$work/log" >&2; exit 1; }
  grep '"command"' "$work/build/compile_commands.json" | grep -oE ' -O[0-9a-z]+' | tr -d ' \n' || true
}
expect() {
  local expected=$1 found
  shift
  found=$(levels "$@")
  [[ $found == "$expected" ]] && return
  echo "error: with '$*' the plugin is compiled with '$found', expected '$expected'" >&2
  exit 1
}

unset CXXFLAGS CMAKE_BUILD_TYPE
expect -O2
expect -O3 -DCMAKE_BUILD_TYPE=Release
expect '' -DCMAKE_BUILD_TYPE=Debug
expect -O0 -DCMAKE_CXX_FLAGS=-O0
