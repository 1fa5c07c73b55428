// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "alidade/state/covariance.h"

namespace alidade {

/// The part b of a state that no measurement touches for a while, exactly [Guivant2001],
/// [Knight2001]. The part a that is left, the active one, is a filter by itself, of any cost but
/// that of b; Phi lies there (Covariance::outside). What its steps and updates mean for b is kept
/// in k numbers and a k x k matrix until it is asked for:
///
///   P_ab = Phi Z,  P_bb = P0_bb - Z' Psi Z,  x_b = x0_b (+) Z' theta
///   S Z = P0_kb,  S S' = P0_kk: k are the rows of P0 that were active then, and those that became
///   so since (the basis). Any S without zeros on its diagonal would do; by this one Psi has
///   eigenvalues in [0, 1], and Z' Psi Z no more than the digits of P0.
///
///   begin   Phi = S, Psi = 0, theta = 0
///   step    x_a' = F x_a + w:  Phi <- F Phi
///   update  W = P_aa H' L^-T, G = L^-1 H Phi, y = L^-1 r, L L' = P_r, the covariance of r:
///           Psi <- Psi + G' G,  theta <- theta + G' y,  Phi <- Phi - W G
///   recall  of j in b, T T' = P0_jj - Z_j' Z_j:
///           P_ja = Z_j' Phi',  P_jj = P0_jj - Z_j' Psi Z_j,  x_j as above,  S <- [S, 0; Z_j', T],
///           Phi <- [Phi, 0; Z_j' (I - Psi), T],  Psi <- diag(Psi, 0),  theta <- (theta, 0)
///
/// A block that enters a with correlation J P_a has J Phi; one that leaves the state takes its row
/// of Phi along. P0 lies here whole, with a's rows as they were. Of rows of a that are still, what
/// holds for b holds too.
class Postponed {
 public:
  /// P0 and x0 are those of a whole state.
  Postponed(Covariance&& p0, std::vector<double>&& x0, std::vector<std::pair<int, int>>&& gaps)
      : p(std::move(p0)), x(std::move(x0)), x_gaps(std::move(gaps)) {}

  /// Makes P_aa of the given rows of P0, one after the other, and Phi.
  void Begin(std::span<const int> rows, Covariance& active);
  /// k.
  int basis() const { return static_cast<int>(basis_.size()); }
  /// After an update of P_aa: `g` G' (k x m), `w` W (n x m), y (m). O(k^2 m + k n m).
  void Correct(Covariance& active, const Workspace::Matrix& g, const Workspace::Matrix& w,
               const Workspace::Vector& y);
  /// Fills rows [at, at + size) of P, which are zero, by those of P0 from `row` on, and dx by what
  /// has to be added to their values. O(k (k + n) size).
  void Recall(int row, int size, int at, Covariance& active, double* dx);
  /// P0 <- P, `homes` the rows in P0 of those of P_aa, -1: none; dx what x0 misses, |P0|. What
  /// follows is Begin. O(|P0|^2 k).
  void CatchUp(Covariance& active, std::span<const int> homes, std::vector<double>& dx);

  /// Where a block lies here; -1: it has no place yet.
  struct Home {
    int row = -1, value = -1;
  };
  Covariance p;                             ///< P0
  std::vector<double> x;                    ///< x0
  std::vector<std::pair<int, int>> x_gaps;  ///< (offset, size)
  std::vector<Home> homes;                  ///< by block
  /// Of blocks that have left the state; their rows are part of the basis.
  struct Left {
    Home home;
    int rows, numbers;
  };
  std::vector<Left> left;

 private:
  std::vector<int> basis_;  ///< rows of P0
  Eigen::MatrixXd s_;       ///< S, the lower triangle of its first k rows
  Eigen::MatrixXd psi_;     ///< Psi, the same; zero elsewhere
  Eigen::VectorXd theta_;
};

}  // namespace alidade
