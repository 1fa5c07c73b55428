// SPDX-License-Identifier: Apache-2.0
//
// 1-point RANSAC [Civera2010].
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "alidade/base/random.h"
#include "alidade/filter/ekf_landmarks.h"
#include "alidade/state/small_kernels.h"

namespace alidade {

bool Ekf::Landmarks::FuseByConsensus(std::span<Row* const> passed) {
  std::vector<Row*> matches, agreed, rest;
  for (Row* const row : passed) {
    const bool asks = ekf_.BindingOf(*row).outlier_rejection.has_value();
    (asks ? matches : agreed).push_back(row);
  }
  if (matches.empty()) return false;
  const std::vector<char> support = Support(matches);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    (support[i] != 0 ? agreed : rest).push_back(matches[i]);
  }
  const auto apply = [this](const std::vector<Row*>& rows) {
    if (rows.empty()) return;
    for (Row* const row : rows) ekf_.Weigh(*row);
    const Outcome outcome = ekf_.Apply(rows);
    for (const Row* const row : rows) ekf_.EntryOf(*row).outcome = outcome;
  };
  apply(agreed);
  std::vector<Row*> rescued;
  for (Row* const row : rest) {
    MeasurementReport& entry = ekf_.EntryOf(*row);
    entry.outcome = ekf_.Linearise(*row);
    if (entry.outcome == Outcome::kAccepted) entry.outcome = ekf_.Gate(*row);
    if (entry.outcome != Outcome::kAccepted) continue;
    if (entry.nis <= rescue_[static_cast<std::size_t>(row->sensor)]) {
      rescued.push_back(row);
    } else {
      entry.outcome = Outcome::kGated;
    }
  }
  counts().rescued += static_cast<int>(rescued.size());
  apply(rescued);
  return true;
}

/// Which of the matches support the best of those that are tried. No match is tried twice, and the
/// more support one has, the fewer are tried: log(1 - confidence) / log(1 - share of support).
std::vector<char> Ekf::Landmarks::Support(std::span<Row* const> matches) {
  Random random(static_cast<std::uint64_t>(map_.frame));
  std::vector<std::size_t> order(matches.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::vector<char> agrees, best;
  std::ptrdiff_t most = 0;
  const double failure = 1.0 - ekf_.BindingOf(*matches[0]).outlier_rejection->confidence;
  double tries = static_cast<double>(order.size());
  for (std::size_t k = 0; static_cast<double>(k) < tries; ++k) {
    const auto left = static_cast<double>(order.size() - k);
    std::swap(order[k], order[k + static_cast<std::size_t>(left * random.Uniform())]);
    SupportOf(order[k], matches, agrees);
    ++counts().hypotheses;
    const std::ptrdiff_t count = std::ranges::count(agrees, 1);
    if (count <= most) continue;
    most = count;
    best = agrees;
    const double share = static_cast<double>(count) / static_cast<double>(order.size());
    const double needed = share < 1.0 ? std::log(failure) / std::log1p(-share) : 1.0;
    tries = std::min(tries, needed);
  }
  best.resize(matches.size(), 0);
  return best;
}

/// Which of the matches lie within their noise of what the state predicts that one of them corrects
/// by itself, as an update would: consider states stay, and known roles are seen as they are.
void Ekf::Landmarks::SupportOf(std::size_t hypothesis, std::span<Row* const> matches,
                               std::vector<char>& agrees) {
  const Row& one = *matches[hypothesis];
  const MeasurementReport& own = ekf_.EntryOf(one);
  const Eigen::Index n = ekf_.state_.covariance().size(), m = own.dof;
  Eigen::MatrixXd pht = Eigen::Map<const Eigen::MatrixXd>(one.pht.data(), n, m);
  ekf_.MaskConsidered(matches.subspan(hypothesis, 1), pht);
  const Eigen::Map<const Eigen::MatrixXd> s(own.s.data(), m, m);
  const Eigen::Map<const Eigen::VectorXd> innovation(own.innovation.data(), m);
  const Eigen::VectorXd dx = pht * s.llt().solve(innovation);
  std::vector<double> moved;
  ekf_.state_.Retract(dx.data(), moved);
  agrees.assign(matches.size(), 0);
  std::vector<double> h, r, work;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Row& row = *matches[i];
    const MeasurementReport& entry = ekf_.EntryOf(row);
    const SensorModel& model = ekf_.ModelOf(row);
    h.resize(entry.z.size());
    r.resize(static_cast<std::size_t>(entry.dof));
    if (model.Predict(ekf_.RolesAt(row, moved), h.data()) != Status::kOk) continue;
    model.measurement().geometry.Minus(entry.z.data(), h.data(), r.data());
    work.resize(r.size() * (r.size() + 1));
    const double d2 = internal::SquaredMahalanobis(row.r.data(), r.data(), entry.dof, work.data());
    agrees[i] = d2 <= support_[static_cast<std::size_t>(row.sensor)] ? 1 : 0;
  }
}

}  // namespace alidade
