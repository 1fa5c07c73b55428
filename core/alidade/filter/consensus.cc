// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/consensus.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "alidade/base/random.h"
#include "alidade/base/statistics.h"
#include "alidade/filter/evaluate_models.h"
#include "alidade/filter/stack.h"
#include "alidade/state/small_kernels.h"

namespace alidade::internal {

Consensus::Consensus(const System& system) {
  for (const SensorBinding& sensor : system.sensors) {
    const int dof = sensor.model.measurement().geometry.tangent;
    const OnePointRansac ransac = sensor.outlier_rejection.value_or(OnePointRansac{});
    support_.push_back(ChiSquareQuantile(ransac.inlier_probability, dof));
    rescue_.push_back(ChiSquareQuantile(ransac.rescue_probability, dof));
  }
}

bool Consensus::IsAsked(std::span<Row* const> rows) {
  return std::ranges::any_of(
      rows, [](const Row* row) { return row->binding->outlier_rejection.has_value(); });
}

void Consensus::Split(FilterState& f, std::span<Row* const> rows, std::uint64_t seed,
                      std::vector<Row*>& agreed, std::vector<Row*>& rest) const {
  std::vector<Row*> matches;
  for (Row* const row : rows) {
    (row->binding->outlier_rejection ? matches : agreed).push_back(row);
  }
  const std::vector<char> support = Support(f, matches, seed);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    (support[i] != 0 ? agreed : rest).push_back(matches[i]);
  }
}

std::vector<char> Consensus::Support(FilterState& f, std::span<Row* const> matches,
                                     std::uint64_t seed) const {
  Random random(seed);
  std::vector<std::size_t> order(matches.size());
  std::iota(order.begin(), order.end(), 0);
  std::vector<char> agrees, best;
  std::ptrdiff_t most = 0;
  const double failure = 1.0 - matches[0]->binding->outlier_rejection->confidence;
  double tries = static_cast<double>(order.size());
  for (std::size_t k = 0; static_cast<double>(k) < tries; ++k) {
    const auto left = static_cast<double>(order.size() - k);
    std::swap(order[k], order[k + static_cast<std::size_t>(left * random.Uniform())]);
    SupportOf(f, order[k], matches, agrees);
    ++f.report.landmarks.hypotheses;
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
void Consensus::SupportOf(FilterState& f, std::size_t hypothesis, std::span<Row* const> matches,
                          std::vector<char>& agrees) const {
  const Row& one = *matches[hypothesis];
  const MeasurementReport& own = *one.report;
  const Eigen::Index n = f.size(), m = own.dof;
  Eigen::MatrixXd pht = Eigen::Map<const Eigen::MatrixXd>(one.PHt.data(), n, m);
  MaskConsidered(f, matches.subspan(hypothesis, 1), pht);
  const Eigen::Map<const Eigen::MatrixXd> s(own.s.data(), m, m);
  const Eigen::Map<const Eigen::VectorXd> innovation(own.innovation.data(), m);
  const Eigen::VectorXd dx = pht * s.llt().solve(innovation);
  f.state.Retract(dx.data(), f.buffers.moved);
  agrees.assign(matches.size(), 0);
  std::vector<double> h, r, work;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Row& row = *matches[i];
    const MeasurementReport& entry = *row.report;
    h.resize(entry.z.size());
    r.resize(static_cast<std::size_t>(entry.dof));
    if (PredictAt(f, row, f.buffers.moved, h.data()) != Outcome::kAccepted) continue;
    row.model->measurement().geometry.Minus(entry.z.data(), h.data(), r.data());
    work.resize(r.size() * (r.size() + 1));
    const double d2 = SquaredMahalanobis(row.R.data(), r.data(), entry.dof, work.data());
    agrees[i] = d2 <= support_[static_cast<std::size_t>(row.sensor)] ? 1 : 0;
  }
}

}  // namespace alidade::internal
