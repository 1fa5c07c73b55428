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

bool Consensus::IsAsked(std::span<PendingMeasurement* const> rows) {
  return std::ranges::any_of(rows, [](const PendingMeasurement* pending) {
    return pending->binding->outlier_rejection.has_value();
  });
}

[[gnu::noinline]] void Consensus::Split(FilterState& f, std::span<PendingMeasurement* const> rows,
                                        std::uint64_t seed,
                                        std::vector<PendingMeasurement*>& agreed,
                                        std::vector<PendingMeasurement*>& rest) {
  matches_.clear();
  for (PendingMeasurement* const pending : rows) {
    (pending->binding->outlier_rejection ? matches_ : agreed).push_back(pending);
  }
  FindBest(f, seed);
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    (best_[i] != 0 ? agreed : rest).push_back(matches_[i]);
  }
  std::ranges::sort(agreed, {},
                    [](const PendingMeasurement* pending) { return pending->linearised.column; });
}

/// The best support, in best_.
void Consensus::FindBest(FilterState& f, std::uint64_t seed) {
  Random random(seed);
  order_.resize(matches_.size());
  std::iota(order_.begin(), order_.end(), 0);
  best_.assign(matches_.size(), 0);
  std::ptrdiff_t most = 0;
  double failure = 1.0;  // the least that a sensor allows
  for (const PendingMeasurement* const pending : matches_) {
    failure = std::min(failure, 1.0 - pending->binding->outlier_rejection->confidence);
  }
  double tries = static_cast<double>(order_.size());
  for (std::size_t k = 0; static_cast<double>(k) < tries; ++k) {
    const auto left = static_cast<double>(order_.size() - k);
    std::swap(order_[k], order_[k + static_cast<std::size_t>(left * random.Uniform())]);
    FindSupport(f, order_[k]);
    ++f.report.landmarks.hypotheses;
    const std::ptrdiff_t count = std::ranges::count(agrees_, 1);
    if (count <= most) continue;
    most = count;
    best_ = agrees_;
    const double share = static_cast<double>(count) / static_cast<double>(order_.size());
    const double needed = share < 1.0 ? std::log(failure) / std::log1p(-share) : 1.0;
    tries = std::min(tries, needed);
  }
}

/// Which of the matches lie within their noise of what the state predicts that one of them corrects
/// by itself, as an update would: consider states stay, and known roles are seen as they are.
void Consensus::FindSupport(FilterState& f, std::size_t hypothesis) {
  const Workspace::Use use(f.work);
  const PendingMeasurement& one = *matches_[hypothesis];
  const MeasurementReport& own = *one.report;
  const Eigen::Index n = f.size(), m = own.dof;
  const std::span<PendingMeasurement* const> itself = std::span(matches_).subspan(hypothesis, 1);
  Workspace::Matrix pht = f.work.Take(n, m), s = f.work.Take(m, m);
  Workspace::Vector y = f.work.Take(m), dx = f.work.Take(n);
  s = Eigen::Map<const RowMajor>(own.s.data(), m, m);
  f.update.CopyColumns(one.linearised.column, pht);  // P H', as the gate left it
  y = Eigen::Map<const Eigen::VectorXd>(own.innovation.data(), m);
  ForEachConsidered(f, itself, [&](int offset, int size, int at, int k) {
    pht.block(offset, at, size, k).setZero();
  });
  Factorise(s);  // positive definite: it has passed the gate
  s.triangularView<Eigen::Lower>().solveInPlace(y);
  s.triangularView<Eigen::Lower>().transpose().solveInPlace(y);
  dx.noalias() = pht * y;
  f.state.Retract(dx.data(), f.moved);
  agrees_.assign(matches_.size(), 0);
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    PendingMeasurement& pending = *matches_[i];
    const MeasurementReport& entry = *pending.report;
    h_.resize(entry.z.size());
    r_.resize(entry.innovation.size());
    if (PredictAt(f, pending, f.moved, h_.data()) != Outcome::kAccepted) continue;
    pending.model->measurement().geometry.Minus(entry.z.data(), h_.data(), r_.data());
    const double d2 = SquaredMahalanobis(pending.R.data(), r_.data(), entry.dof, f.work);
    agrees_[i] = d2 <= support_[static_cast<std::size_t>(pending.sensor)] ? 1 : 0;
  }
}

}  // namespace alidade::internal
