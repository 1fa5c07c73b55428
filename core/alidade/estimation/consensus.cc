// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/consensus.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "alidade/base/random.h"
#include "alidade/base/statistics.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/state/tiles.h"

namespace alidade::internal {

Consensus::Consensus(const Problem& problem) {
  for (const SensorBinding& sensor : problem.sensors) {
    const int dof = sensor.model->measurement().geometry.tangent;
    const OnePointRansac ransac = sensor.outlier_rejection.value_or(OnePointRansac{});
    support_.push_back(ChiSquareQuantile(ransac.inlier_probability, dof));
    rescue_.push_back(ChiSquareQuantile(ransac.rescue_probability, dof));
  }
}

bool Consensus::IsEnabledFor(std::span<PendingMeasurement* const> rows) {
  return std::ranges::any_of(rows, [](const PendingMeasurement* pending) {
    return pending->binding->outlier_rejection.has_value();
  });
}

[[gnu::noinline]] void Consensus::Split(FilterState& f, std::span<PendingMeasurement* const> rows,
                                        std::uint64_t seed,
                                        std::vector<PendingMeasurement*>& inliers,
                                        std::vector<PendingMeasurement*>& remaining) {
  matches_.clear();
  for (PendingMeasurement* const pending : rows) {
    (pending->binding->outlier_rejection ? matches_ : inliers).push_back(pending);
  }
  FindBest(f, seed);
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    (best_[i] != 0 ? inliers : remaining).push_back(matches_[i]);
  }
  std::ranges::sort(inliers, {},
                    [](const PendingMeasurement* pending) { return pending->linearised.column; });
}

/// Writes the support of the best hypothesis to best_.
void Consensus::FindBest(FilterState& f, std::uint64_t seed) {
  Random random(seed);
  order_.resize(matches_.size());
  std::iota(order_.begin(), order_.end(), 0);
  best_.assign(matches_.size(), 0);
  std::ptrdiff_t best_count = 0;
  double failure = 1.0;  // smallest 1 - confidence of the sensors
  for (const PendingMeasurement* const pending : matches_) {
    failure = std::min(failure, 1.0 - pending->binding->outlier_rejection->confidence);
  }
  double tries = static_cast<double>(order_.size());
  for (std::size_t k = 0; static_cast<double>(k) < tries; ++k) {
    const auto untried = static_cast<double>(order_.size() - k);
    std::swap(order_[k], order_[k + static_cast<std::size_t>(untried * random.Uniform())]);
    FindSupport(f, order_[k]);
    ++f.report.landmarks.hypotheses;
    const std::ptrdiff_t count = std::ranges::count(supports_, 1);
    if (count <= best_count) continue;
    best_count = count;
    best_ = supports_;
    const double share = static_cast<double>(count) / static_cast<double>(order_.size());
    const double needed = share < 1.0 ? std::log(failure) / std::log1p(-share) : 1.0;
    tries = std::min(tries, needed);
  }
}

/// Finds the matches whose residuals are within their noise after an update by one match alone. The
/// update does not change consider states and known roles.
void Consensus::FindSupport(FilterState& f, std::size_t hypothesis) {
  const Workspace::Use use(f.work);
  const PendingMeasurement& match = *matches_[hypothesis];
  const MeasurementReport& report = *match.report;
  const Eigen::Index n = f.size(), m = report.dof;
  const std::span<PendingMeasurement* const> matches = std::span(matches_).subspan(hypothesis, 1);
  Workspace::Matrix pht = f.work.Take(n, m), s = f.work.Take(m, m);
  Workspace::Vector y = f.work.Take(m), dx = f.work.Take(n);
  s = Eigen::Map<const RowMajor>(report.s.data(), m, m);
  f.update.CopyColumns(match.linearised.column, pht);  // P H' was computed for the gate
  y = Eigen::Map<const Eigen::VectorXd>(report.innovation.data(), m);
  ForEachConsidered(f, matches, [&](int offset, int size, int column, int count) {
    pht.block(offset, column, size, count).setZero();
  });
  Factorise(s);  // S is positive definite, because the match passed the gate
  s.triangularView<Eigen::Lower>().solveInPlace(y);
  s.triangularView<Eigen::Lower>().transpose().solveInPlace(y);
  dx.noalias() = pht * y;
  f.state.Retract(dx.data(), f.moved);
  supports_.assign(matches_.size(), 0);
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    PendingMeasurement& pending = *matches_[i];
    const MeasurementReport& entry = *pending.report;
    h_.resize(entry.z.size());
    residual_.resize(entry.innovation.size());
    if (PredictAt(f, pending, f.moved, h_.data()) != Outcome::kAccepted) continue;
    pending.model->measurement().geometry.Minus(entry.z.data(), h_.data(), residual_.data());
    const double d2 = SquaredMahalanobis(pending.R.data(), residual_.data(), entry.dof, f.work);
    supports_[i] = d2 <= support_[static_cast<std::size_t>(pending.sensor)] ? 1 : 0;
  }
}

}  // namespace alidade::internal
