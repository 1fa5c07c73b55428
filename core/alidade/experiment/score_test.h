// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "alidade/estimation/estimator.h"

namespace alidade {

/// Innovations r with their covariances S from one run of a filter, in the order of the updates.
/// Each measurement of the run has one row.
class InnovationRows {
 public:
  struct Row {
    int sensor = -1;
    std::int64_t landmark = -1;
    int dof = 0;            ///< size m of r; 0 if no update used the measurement
    std::size_t first = 0;  ///< index of r_0 in the numbers; S, m x m, follows r

    bool operator==(const Row&) const = default;
  };

  /// Adds the row of a measurement. The row has r and S only if the measurement was accepted and
  /// `is_scored` is true.
  void Add(const MeasurementReport& measurement, bool is_scored);

  const std::vector<Row>& rows() const { return rows_; }
  /// Returns r, followed by S, of a row.
  std::span<const double> Numbers(const Row& row) const;

 private:
  std::vector<Row> rows_;
  std::vector<double> numbers_;
};

/// Score test of one parameter theta of a filter: whether another value of theta explains the
/// innovations better. For a consistent filter, z has the distribution N(0, 1).
struct Score {
  double gradient = 0.0;     ///< g, derivative of -log L with respect to theta
  double information = 0.0;  ///< F, Fisher information of theta
  /// Derivatives of the innovations in units of their standard deviations: L^-1 dr and
  /// L^-1 dS L^-T / sqrt(2) of each measurement, S = L L'. F is the square of its length.
  std::vector<double> direction;

  double z() const;                                        ///< -g / sqrt(F)
  double gain() const { return 0.5 * z() * z(); }          ///< increase of log L after the step
  double step() const { return -gradient / information; }  ///< scoring step of theta
};

/// Returns the correlation of the gradients of two scores from the same center run. If it is 1 or
/// -1, the data cannot distinguish the two parameters.
double Correlation(const Score& a, const Score& b);

/// Computes the score from the innovations at theta, theta - h and theta + h. All runs must have
/// the same data, and one update for each measurement.
///
///   -log L = sum 1/2 (log det S + r' S^-1 r)
///   g      = sum 1/2 tr(S^-1 dS) + w (dr' S^-1 r - 1/2 r' S^-1 dS S^-1 r)
///   F      = sum 1/2 tr(S^-1 dS S^-1 dS) + dr' S^-1 dr
///
/// The sums contain the measurements that all three runs accepted. dr and dS are central
/// differences. w = m / E[r' S^-1 r] corrects for data from which a gate with the probability
/// `gate` removed the largest innovations. Returns nullopt if more than 2 % of the measurements
/// were not accepted in all runs, or if the innovations do not depend on theta.
///
/// Source       [Harvey1989] sec. 3.4, [Rao1948].
std::optional<Score> ComputeScore(const InnovationRows& center, const InnovationRows& minus,
                                  const InnovationRows& plus, double h, double gate = 1.0);

}  // namespace alidade
