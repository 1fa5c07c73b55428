#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/install/estimation_test.sh CMAKE BUILD COMPILER OPTIONS [CXXFLAG...] INCLUDE...
#
# Installs the component `estimation` of BUILD into an empty folder, so that the folder contains no
# header of another room. Builds the C++ examples and the program of late measurements with only
# this folder and Eigen (INCLUDE). These programs must print the expected estimates. Then the script
# also installs the component `testing` and builds the tests of tests/install/testing with both
# components. Finally it configures the project with ALIDADE_ESTIMATION_ONLY, without any other
# package.
set -euo pipefail
cmake=$1 build=$2 compiler=$3
IFS=',' read -ra options <<<"$4"
shift 4
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() {
  echo "error: $*" >&2
  exit 1
}

"$cmake" --install "$build" --prefix "$work/alidade" --component estimation >"$work/log" ||
  { cat "$work/log" >&2; exit 1; }
include=$work/alidade/include
for room in testing io config plugin experiment record; do
  [[ ! -e $include/alidade/$room ]] || fail "the component contains headers of $room"
done
foreign=$(grep -rhoE '#include <(yaml|boost|spdlog|openssl|nlohmann|ceres|opencv)[^>]*>' "$include" || true)
[[ -z $foreign ]] || fail "headers of the component include $foreign"
library=$(find "$work/alidade" -name libalidade-estimation.so)
[[ -n $library ]] || fail "the component does not contain libalidade-estimation.so"

flags=(-std=c++20 -I"$include")
only_flags=(-O1)
for argument in "$@"; do
  [[ $argument == -* ]] && only_flags+=("$argument") || flags+=(-isystem "$argument")
done
flags+=("${only_flags[@]}")
# run FOLDER: builds the program in FOLDER and prints its output.
run() {
  "$compiler" "${flags[@]}" "${options[@]}" "$1/main.cc" -o "$work/program" \
    "$library" -Wl,-rpath,"$(dirname "$library")"
  "$work/program"
}

# The last depth must be within 4 sigma of the truth.
run examples/31_depth_cpp | tee "$work/depth" | tail -1 |
  awk '{ d = $3 - $8; if (d * d > 16 * $5 * $5 || $5 > 0.01) exit 1 }' ||
  fail "examples/31_depth_cpp prints a wrong estimate: $(cat "$work/depth")"
run examples/32_landmarks_cpp >"$work/landmarks"
found=$(grep -c '^landmark' "$work/landmarks")
((found >= 8)) || fail "examples/32_landmarks_cpp maps only $found landmarks; expected at least 8: $(cat "$work/landmarks")"
awk -F'[(,)]' '/^robot/ {
    for (i = 0; i < 2; ++i) {
      d = $(2 + i) - $(10 + i); s = $(6 + i)
      if (d * d > 16 * s * s || s > 0.5) exit 1
    }
  }' "$work/landmarks" || fail "examples/32_landmarks_cpp prints a wrong estimate: $(cat "$work/landmarks")"
run tests/install/late >"$work/late"
awk '{ d = $4 - $9; if (d * d > 16 * $6 * $6 || $6 > 0.01 || $1 < 400) exit 1 }' "$work/late" ||
  fail "tests/install/late prints a wrong estimate: $(cat "$work/late")"

"$cmake" --install "$build" --prefix "$work/alidade" --component testing >"$work/log" ||
  { cat "$work/log" >&2; exit 1; }
{
  "$cmake" -S tests/install/testing -B "$work/testing" -DCMAKE_CXX_COMPILER="$compiler" \
    -DCMAKE_CXX_FLAGS="$(printf '%s ' "${only_flags[@]}")" -DCMAKE_PREFIX_PATH="$work/alidade" &&
    "$cmake" --build "$work/testing" && "$work/testing/models_test"
} >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }

without=(yaml-cpp Boost OpenSSL nlohmann_json spdlog CLI11 Ceres OpenCV GTest)
"$cmake" -S . -B "$work/only" -DCMAKE_CXX_COMPILER="$compiler" -DALIDADE_ESTIMATION_ONLY=ON \
  $(printf -- '-DCMAKE_DISABLE_FIND_PACKAGE_%s=ON ' "${without[@]}") >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
echo "the programs need only the component, and the project configures without other packages"
