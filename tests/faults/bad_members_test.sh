#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/faults/bad_members_test.sh COMPILER INCLUDE...
#
# Compiles tests/faults/plugins/bad_member.cc with every value of BAD_MEMBER. If a member of a model
# cannot be called, the compiler error must name the member, the call and the model.
set -euo pipefail
compiler=$1
shift
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
flags=(-std=c++17 -Wall -Wextra -Wpedantic -Werror -Icore)
for include in "$@"; do flags+=(-isystem "$include"); done
errors=$(mktemp)
trap 'rm -f "$errors"' EXIT

compiles() {
  "$compiler" "${flags[@]}" -fsyntax-only "-DBAD_MEMBER=$1" tests/faults/plugins/bad_member.cc \
    2>"$errors"
}
refused() {
  local number=$1 model=$2 words=$3
  if ! compiles "$number"; then
    grep -qF "$words" "$errors" && grep -qF "$model" "$errors" && return
    cat "$errors" >&2
  fi
  echo "error: BAD_MEMBER=$number: the compiler does not refuse $model with '$words'" >&2
  exit 1
}

compiles 0 || { cat "$errors" >&2; exit 1; }
jacobian='Jacobian exists but cannot be called as Jacobian(const double* role..., [const double* known,] MatrixRef J_z_role...) const'
for number in 1 2 3 4; do refused "$number" Seen "$jacobian"; done
for number in 5 6; do
  refused "$number" Seen 'Valid exists but cannot be called as bool Valid([const double* known,] const double* z) const'
done
refused 7 Seen 'Initialise exists, but the model does not define kInitialises, the index of the role that Initialise computes'
refused 8 Seen 'Initialise cannot be called as bool Initialise(const T* other_role..., [const double* known,] const T* z, [const T* prior,] T* y) const'
for number in 10 11; do
  refused "$number" Moved 'StepJacobian exists but cannot be called as StepJacobian(const double* block..., const double* w, double dt_s, MatrixRef F, MatrixRef G) const'
done
refused 12 Moved 'Stationary exists but cannot be called as bool Stationary() const'
refused 13 Seen 'a sensor needs template <class T> bool Predict(const T* role..., [const double* known,] T* z) const'
refused 14 Seen 'a sensor needs template <class T> void SqrtNoise(const T* role..., [const double* known,] [const T* z,] T* L) const'
refused 15 Moved 'a motion model needs template <class T> void Step(const T* block..., [const T* u,] const T* w, double dt_s, T* next...) const'
refused 16 Moved 'a motion model needs void SqrtQ([const double* block...,] double dt_s, MatrixRef Lq) const'
for number in 17 18 19; do
  refused "$number" Moved 'kStepOrder has to be a static constexpr int from 0 to 8'
done
refused 20 Seen 'a sensor needs static constexpr std::array kRoles'
refused 20 Seen 'a sensor needs static constexpr alidade::Quantity kMeasurement'
refused 21 Seen 'Predict has to be a template <class T> on the scalar type'
refused 22 Moved 'a motion model needs static constexpr std::array kBlocks'
refused 23 Moved 'Step has to be a template <class T> on the scalar type'
refused 24 Moved 'noise_kind has to be declared as NoiseKind noise_kind() const'
echo "all faults are refused with the expected messages"
