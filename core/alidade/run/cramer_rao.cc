// SPDX-License-Identifier: Apache-2.0
#include "alidade/run/cramer_rao.h"

#include <algorithm>
#include <memory>

#include "alidade/filter/linear.h"
#include "alidade/system/truth_match.h"

namespace alidade::internal {
namespace {

/// The system whose best filter is asked for: every measurement counts by its nominal noise, with
/// its Jacobian at the state, and corrects all that it tells of.
System Ideal(System system) {
  for (SensorBinding& sensor : system.sensors) {
    sensor.loss = {};
    for (RoleBinding& role : sensor.roles) {
      role.jacobian_at = JacobianAt::kPrediction;
      if (role.mode == RoleMode::kConsider) role.mode = RoleMode::kEstimate;
    }
  }
  return system;
}

/// Whether a measurement that counts could not be used.
bool LostOne(const UpdateReport& report) {
  return std::ranges::any_of(report.measurements(), [](const MeasurementReport& one) {
    return one.outcome == Outcome::kNotPd || one.outcome == Outcome::kNotFinite ||
           one.outcome == Outcome::kOutOfDomain;
  });
}

}  // namespace

std::string CramerRaoBound::WhyNone(const System& system, const std::vector<StreamInfo>& truths) {
  if (system.landmarks) return "the system has landmarks";
  const std::vector<int> match = MatchTruths(system.layout, truths);
  for (BlockId id = 0; id < std::ssize(match); ++id) {
    const Block& block = system.layout[id];
    const int truth = match[static_cast<std::size_t>(id)];
    const std::string name = '\'' + block.name + '\'';
    if (block.status == BlockStatus::kConsider) return name + " is a consider state";
    if (block.status == BlockStatus::kConstant) continue;
    if (truth < 0) return name + " has no truth";
    if (truths[static_cast<std::size_t>(truth)].sigma > 0.0) {
      return "the truth of " + name + " is not exact";
    }
  }
  return "";
}

CramerRaoBound::CramerRaoBound(const System& system, const std::vector<StreamInfo>& streams,
                               const std::vector<StreamInfo>& truths)
    : loop_(Ideal(system), WithoutRecovery({}), streams, std::make_unique<Linear>()),
      truths_(MatchTruths(system.layout, truths)) {
  ALIDADE_EXPECTS(WhyNone(system, truths).empty());
}

bool CramerRaoBound::Add(const SourceFrame& frame) {
  if (lost_) return false;
  FilterState& f = loop_.f;
  if (f.timestamp == kNoTimestamp) lost_ = !MoveToTruth(frame.truth);
  loop_.Process({frame.timestamp, {}});
  lost_ = lost_ || !MoveToTruth(frame.truth);
  loop_.Process(frame);
  lost_ = lost_ || LostOne(f.report) || f.said.ended || !MoveToTruth(frame.truth);
  return !lost_;
}

/// False where the truth of a block that has a covariance is not known.
bool CramerRaoBound::MoveToTruth(const Truth& truth) {
  State& state = loop_.f.state;
  std::vector<double> values = state.values();
  for (BlockId id = 0; id < std::ssize(truths_); ++id) {
    const Block& block = state.layout()[id];
    const auto t = static_cast<std::size_t>(truths_[static_cast<std::size_t>(id)]);
    const bool known = t < truth.size() && !truth[t].empty();
    if (block.has_covariance() && !known) return false;
    if (block.present && known) std::ranges::copy(truth[t], values.begin() + block.value_offset);
  }
  state.MoveTo(values);
  return true;
}

}  // namespace alidade::internal
