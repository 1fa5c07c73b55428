#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/install/flags_test.sh FLAG FOLDER OPTIONS COMPILER [CXXFLAG...] INCLUDE...
#
# Compiles tests/install/outsider/filter.cc with -FLAG and with OPTIONS, the options (separated by
# commas) that the target alidade::estimation adds. Runs the program with the libraries in FOLDER,
# which were built without the flag. If the processor lacks the instructions, the program is only
# compiled. Without OPTIONS the program must either work or be refused with a message that names the
# remedy.
set -euo pipefail
flag=-$1 folder=$2 compiler=$4
IFS=',' read -ra options <<<"$3"
shift 4
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

flags=(-std=c++20 -O1 -Icore -Itools)
for argument in "$@"; do
  [[ $argument == -* ]] && flags+=("$argument") || flags+=(-isystem "$argument")
done
flags+=("$flag")
source=tests/install/outsider/filter.cc

"$compiler" "${flags[@]}" "${options[@]}" "$source" -L"$folder" -lalidade-tools -lalidade-core -lalidade-estimation \
  -Wl,-rpath,"$folder" \
  -o "$work/filter"
if [[ $flag == -mavx2 ]] && ! grep -qw avx2 /proc/cpuinfo; then
  echo "$flag: compiled; the processor cannot run it"
else
  "$work/filter"
  echo "$flag: compiled and run"
fi

# Determines how the flags change the alignment of Eigen.
macros=$("$compiler" "${flags[@]}" -dM -E -x c++ - </dev/null)
remedy=
grep -q '__SANITIZE_ADDRESS__' <<<"$macros" && remedy=-DEIGEN_MALLOC_ALREADY_ALIGNED=1
grep -q '__AVX__' <<<"$macros" && remedy=-DEIGEN_MAX_ALIGN_BYTES=16
if "$compiler" "${flags[@]}" -fsyntax-only "$source" 2>"$work/errors"; then
  [[ -z $remedy ]] && exit
  echo "error: $flag is not refused without the options of alidade::estimation" >&2
  exit 1
fi
if [[ -z $remedy ]] || ! grep -qF -- "link the CMake target alidade::estimation" "$work/errors" ||
  ! grep -qF -- "$remedy" "$work/errors"; then
  cat "$work/errors" >&2
  echo "error: $flag is refused, but the message lacks the expected words or the remedy '$remedy'" >&2
  exit 1
fi
echo "$flag: refused without the options of alidade::estimation"
