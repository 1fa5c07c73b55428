// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/problem.h"

namespace alidade {

/// Side of the error of a group element X: X = X^ Exp(xi) for the left-invariant error, and
/// X = Exp(xi) X^ for the right-invariant error, with the estimate X^.
enum class ErrorSide { kLeft, kRight };

/// Blocks of a problem whose errors are the error of one element of SE(2), SE(3) or SE_2(3). The
/// blocks are, in this order: a position in the plane and a heading; or a position in space and an
/// orientation; or these and a velocity.
struct InvariantError {
  ErrorSide side = ErrorSide::kLeft;
  std::vector<BlockId> blocks;
};

/// Returns "", or the reason why the blocks cannot have an invariant error: their geometries are
/// not those of a group, they do not belong to one motion model, one of them is not estimated or
/// starts from a measurement, a sensor does not estimate one of them in the usual way, or the
/// problem has landmarks.
std::string FindDefect(const InvariantError& error, const Problem& problem);

/// Creates an estimator that linearises the models of `problem` in an invariant error [Barrau2017].
/// `make` creates an estimator for a problem with one block X of the group instead of the blocks.
/// The models are the same. With the error e of the blocks and M(X) = de/dxi, their Jacobians are
///
///   motion   F_xi = M(X')^-1 F M(X),   G_xi = M(X')^-1 G
///   sensor   H_xi = H M(X)
///
/// The initial covariance is M^-1 P M^-T. States, covariances, and gains of the result are those of
/// the blocks of `problem`: P = M P_xi M', K = M K_xi. The gain is expressed at the estimate after
/// the frame. The inverse measurement model of a sensor for one of the blocks is not used. Throws
/// Error kBadConfig with the text of FindDefect.
std::unique_ptr<Estimator> MakeInvariant(
    const InvariantError& error, const Problem& problem,
    const std::function<std::unique_ptr<Estimator>(const Problem&)>& make);

namespace internal {

/// Returns the problem that MakeInvariant passes to `make`. Its last block is X.
Problem InvariantProblem(const InvariantError& error, const Problem& problem);

}  // namespace internal

}  // namespace alidade
