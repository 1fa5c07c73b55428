// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/score_test.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <map>
#include <numeric>

#include "alidade/base/statistics.h"

namespace alidade {
namespace {

/// Largest share of the measurements that not all runs accepted.
constexpr double kMaxUnmatchedShare = 0.02;
/// Smallest mean square of the change of an innovation over h, in standard deviations. Smaller
/// changes are rounding errors.
constexpr double kSmallestChange = 1e-18;

using Vector = Eigen::Map<const Eigen::VectorXd>;
using Matrix = Eigen::Map<const Eigen::MatrixXd>;  // S is symmetric, so its order is irrelevant

Vector InnovationOf(std::span<const double> numbers, int dof) { return {numbers.data(), dof}; }
Matrix CovarianceOf(std::span<const double> numbers, int dof) {
  return {numbers.data() + dof, dof, dof};
}

/// Returns m / E[r' S^-1 r] of a measurement that a gate with the probability `gate` accepted.
double WeightOf(int dof, double gate) {
  return gate < 1.0 ? 1.0 / TruncatedMean(dof, ChiSquareQuantile(gate, dof)) : 1.0;
}

/// Adds the terms of one measurement. r, dr and dS are those of ComputeScore; l is L of S = L L'.
void AddTerms(const Eigen::VectorXd& r, const Eigen::MatrixXd& l, const Eigen::VectorXd& dr,
              const Eigen::MatrixXd& ds, double weight, Score& score) {
  const auto root = l.triangularView<Eigen::Lower>();
  const Eigen::VectorXd u = root.solve(r), du = root.solve(dr);
  const Eigen::MatrixXd dv = root.solve(root.solve(ds).transpose());
  score.gradient += 0.5 * dv.trace() + weight * (du.dot(u) - 0.5 * u.dot(dv * u));
  score.information += du.squaredNorm() + 0.5 * dv.squaredNorm();
  score.direction.insert(score.direction.end(), du.begin(), du.end());
  for (const double element : dv.reshaped()) score.direction.push_back(element / std::sqrt(2.0));
}

}  // namespace

void InnovationRows::Add(const MeasurementReport& measurement, bool is_scored) {
  const auto m = static_cast<std::size_t>(measurement.dof);
  const bool has_numbers = is_scored && measurement.outcome == Outcome::kAccepted &&
                           measurement.innovation.size() == m && measurement.s.size() == m * m;
  rows_.push_back({measurement.sensor, measurement.landmark, has_numbers ? measurement.dof : 0,
                   numbers_.size()});
  if (!has_numbers) return;
  numbers_.insert(numbers_.end(), measurement.innovation.begin(), measurement.innovation.end());
  numbers_.insert(numbers_.end(), measurement.s.begin(), measurement.s.end());
}

std::span<const double> InnovationRows::Numbers(const Row& row) const {
  const auto m = static_cast<std::size_t>(row.dof);
  return std::span(numbers_).subspan(row.first, m + m * m);
}

double Correlation(const Score& a, const Score& b) {
  const double product =
      std::inner_product(a.direction.begin(), a.direction.end(), b.direction.begin(), 0.0);
  return product / std::sqrt(a.information * b.information);
}

double Score::z() const { return -gradient / std::sqrt(information); }

std::optional<Score> ComputeScore(const InnovationRows& center, const InnovationRows& minus,
                                  const InnovationRows& plus, double h, double gate) {
  const std::size_t count = center.rows().size();
  if (minus.rows().size() != count || plus.rows().size() != count) return std::nullopt;
  Score score;
  std::map<int, double> weights;  // by the size of the measurement
  std::int64_t used = 0, unmatched = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto &row = center.rows()[i], &low = minus.rows()[i], &high = plus.rows()[i];
    if (row.dof == 0 && low.dof == 0 && high.dof == 0) continue;
    const bool is_matched = row.dof == low.dof && row.dof == high.dof && row.sensor == low.sensor &&
                            row.sensor == high.sensor && row.landmark == low.landmark &&
                            row.landmark == high.landmark;
    const int m = row.dof;
    const Eigen::LLT<Eigen::MatrixXd> s(
        is_matched ? Eigen::MatrixXd(CovarianceOf(center.Numbers(row), m)) : Eigen::MatrixXd());
    if (!is_matched || s.info() != Eigen::Success) {
      ++unmatched;
      score.direction.resize(score.direction.size() + static_cast<std::size_t>(m + m * m));
      continue;
    }
    const auto numbers = center.Numbers(row), lower = minus.Numbers(low),
               higher = plus.Numbers(high);
    const Eigen::VectorXd dr = (InnovationOf(higher, m) - InnovationOf(lower, m)) / (2.0 * h);
    const Eigen::MatrixXd ds = (CovarianceOf(higher, m) - CovarianceOf(lower, m)) / (2.0 * h);
    const auto weight = weights.try_emplace(m, 0.0);
    if (weight.second) weight.first->second = WeightOf(m, gate);
    AddTerms(InnovationOf(numbers, m), s.matrixL(), dr, ds, weight.first->second, score);
    ++used;
  }
  const auto total = static_cast<double>(used + unmatched);
  const bool is_matched = static_cast<double>(unmatched) <= kMaxUnmatchedShare * total;
  if (!is_matched || !(score.information * h * h > kSmallestChange * total)) return std::nullopt;
  return score;
}

}  // namespace alidade
