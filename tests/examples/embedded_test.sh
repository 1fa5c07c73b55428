#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/examples/embedded_test.sh COMPILER INCLUDE...
#
# Compiles examples/09_static_depth and the shipped models as C++17 with COMPILER, without
# exceptions and without RTTI. Fails if the example would allocate memory or throw. INCLUDE: include
# folders of the libraries and of Eigen. If COMPILER is not installed, the exit code is 77.
set -euo pipefail
compiler=$1
shift
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

if ! command -v "$compiler" >/dev/null; then
  echo "skipped: $compiler is not installed"
  exit 77
fi
flags=(-std=c++17 -O2 -fno-exceptions -fno-rtti -Wall -Wextra -Wpedantic -Werror -Wno-psabi
  -Icore -I.)
for include in "$@"; do flags+=(-isystem "$include"); done
object=$(mktemp --suffix .o)
trap 'rm -f "$object"' EXIT

printf '#include "%s"\n' alidade/model/static_ekf.h motion_models/*.h sensors/*.h |
  "$compiler" "${flags[@]}" -fsyntax-only -x c++ -
"$compiler" "${flags[@]}" -c examples/09_static_depth/main.cc -o "$object"
# -print-prog-name may print a name without a folder. The shell then searches PATH for it.
undefined=$("$("$compiler" -print-prog-name=nm)" -uC "$object")
if grep -E 'operator (new|delete)|alloc|__cxa_[^a]|_Unwind|typeinfo' <<<"$undefined"; then
  echo "error: the example uses the functions above, which allocate memory or handle exceptions"
  exit 1
fi
echo "$("$compiler" -dumpmachine): compiled"
