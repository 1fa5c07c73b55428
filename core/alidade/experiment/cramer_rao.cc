// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/cramer_rao.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <utility>

#include "alidade/estimation/ekf_equations.h"
#include "alidade/experiment/name_in_entry.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/model/landmark.h"

namespace alidade::internal {
namespace {

/// Returns the problem of the optimal filter, which has no losses, evaluates all Jacobians at the
/// state, and updates all roles.
Problem IdealProblem(Problem problem) {
  for (SensorBinding& sensor : problem.sensors) {
    sensor.loss = {};
    for (RoleBinding& role : sensor.roles) {
      role.jacobian_at = JacobianAt::kPrediction;
      if (role.mode == RoleMode::kConsider) role.mode = RoleMode::kEstimate;
    }
  }
  return problem;
}

/// Returns whether a valid measurement could not be used.
bool HasFailedMeasurement(const UpdateReport& report) {
  return std::ranges::any_of(report.measurements(), [](const MeasurementReport& measurement) {
    return measurement.outcome == Outcome::kNotPd || measurement.outcome == Outcome::kNotFinite ||
           measurement.outcome == Outcome::kOutOfDomain;
  });
}

/// Returns the reason why landmarks of `sensor` cannot start at truth, or "" if they can start
/// there.
std::string WhyNotAtTruth(const SensorBinding& sensor) {
  const auto representation = RepresentationOf(sensor.model->roles());
  const std::string name = '\'' + sensor.name + '\'';
  if (!representation) return name + " has a custom landmark representation";
  if (IsXyz(*representation) && sensor.model->inverse().prior_size > 0) {
    return name + " initialises xyz landmarks with a prior, whose mean changes the Jacobians";
  }
  return "";
}

/// Returns the reason why a problem with landmarks has no bound, or "" if it has a bound.
std::string WhyNoMap(const Problem& problem) {
  for (std::size_t i = 0; i < problem.sensors.size(); ++i) {
    const SensorBinding& sensor = problem.sensors[i];
    for (std::size_t k = 0; k < i; ++k) {
      if (problem.sensors[k].stream != sensor.stream) continue;
      return '\'' + problem.sensors[k].name + "' and '" + sensor.name + "' use the same stream";
    }
    if (!sensor.model->has_landmark()) continue;
    if (std::string why = WhyNotAtTruth(sensor); !why.empty()) return why;
  }
  return "";
}

/// Returns the ID in the name of a landmark block, `landmarks.ID.role#N`.
std::int64_t LandmarkOf(const Block& block) { return std::stoll(NameInEntry(block)); }

/// Returns the values of a landmark at p in the given representation. The anchor is p - (0, 0, 1)
/// m. Measurements of the landmark do not depend on the anchor.
std::vector<double> LandmarkValues(LandmarkRepresentation representation,
                                   const std::array<double, 3>& p) {
  return WithRepresentation(representation, [&](auto representation_type) {
    using Type = decltype(representation_type);
    std::vector<double> y(detail::Blocks<Type>::kAmbient);
    Type::FromRay(Ray<double>{{p[0], p[1], p[2] - 1.0}, {0.0, 0.0, 1.0}, 1.0}, y.data());
    return y;
  });
}

}  // namespace

std::string CramerRaoBound::WhyUnavailable(const Problem& problem,
                                           const std::vector<StreamInfo>& truths) {
  if (problem.landmarks) {
    if (std::string why = WhyNoMap(problem); !why.empty()) return why;
  }
  const std::vector<int> match = MatchTruths(problem.layout, truths);
  for (BlockId id = 0; id < std::ssize(match); ++id) {
    const Block& block = problem.layout[id];
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

CramerRaoBound::CramerRaoBound(const Problem& problem, const std::vector<StreamInfo>& streams,
                               const std::vector<StreamInfo>& truths, TrueLandmark true_landmark)
    : engine_(IdealProblem(problem), EkfOptions{.rejection_recovery = RejectionRecovery::kNone},
              streams, std::make_unique<EkfEquations>()),
      true_landmark_(std::move(true_landmark)),
      truths_(MatchTruths(problem.layout, truths)) {
  ALIDADE_EXPECTS(WhyUnavailable(problem, truths).empty());
  ALIDADE_EXPECTS(!problem.landmarks || true_landmark_);
  for (const StreamInfo& stream : streams) {
    const auto found = std::ranges::find(problem.sensors, stream.name, &SensorBinding::stream);
    const auto sensor = static_cast<int>(found - problem.sensors.begin());
    sensors_.push_back(found == problem.sensors.end() ? -1 : sensor);
  }
}

bool CramerRaoBound::Add(const SourceFrame& frame) {
  if (is_lost_) return false;
  FilterState& f = engine_.f;
  if (f.timestamp == kNoTimestamp) is_lost_ = !MoveToTruth(frame.truth);
  engine_.Process({frame.timestamp, {}});
  is_lost_ = is_lost_ || !MoveToTruth(frame.truth);
  if (!engine_.landmarks) {
    engine_.Process(frame);
  } else if (!is_lost_) {
    Frame at_truth = frame;
    bool has_all = !f.blocks.has_missing;
    is_lost_ = !ReplaceByPrediction(at_truth, has_all);
    engine_.Process(at_truth);
    is_lost_ = is_lost_ || (!has_all && f.report.landmarks.initialised > 0);
  }
  is_lost_ =
      is_lost_ || HasFailedMeasurement(f.report) || f.health.ended || !MoveToTruth(frame.truth);
  return !is_lost_;
}

/// Replaces each valid measurement of the frame by its prediction at truth. If a prediction is
/// invalid, leaves the measurement unchanged and sets `has_all` to false. Returns false if a
/// landmark has no truth.
bool CramerRaoBound::ReplaceByPrediction(Frame& frame, bool& has_all) const {
  const FilterState& f = engine_.f;
  for (Measurement& measurement : frame.measurements) {
    const int index = sensors_[static_cast<std::size_t>(measurement.stream)];
    if (index < 0) continue;
    const SensorBinding& sensor = f.problem_index->problem.sensors[static_cast<std::size_t>(index)];
    const SensorModel& model = *sensor.model;
    if (f.blocks.has_missing ||
        model.Valid({measurement.values.data(), measurement.known.data()}) != Status::kOk)
      continue;
    std::vector<const double*> roles;
    for (const RoleBinding& role : sensor.roles) {
      const bool has_value = role.block >= 0 && f.state.layout()[role.block].present;
      roles.push_back(has_value ? f.state.value(role.block) : nullptr);
    }
    std::vector<double> landmark;
    if (model.has_landmark()) {
      if (measurement.landmark < 0) continue;
      const auto p = true_landmark_(measurement.landmark);
      if (!p) return false;
      landmark = LandmarkValues(*RepresentationOf(model.roles()), *p);
      int offset = 0;
      roles.resize(model.roles().size());
      for (std::size_t i = 0; i < roles.size(); ++i) {
        if (!model.roles()[i].landmark()) continue;
        roles[i] = landmark.data() + offset;
        offset += model.roles()[i].geometry.ambient;
      }
    }
    std::vector<double> h(measurement.values.size());
    const bool is_valid =
        model.Predict(roles.data(), h.data(), measurement.known.data()) == Status::kOk &&
        model.Valid({h.data(), measurement.known.data()}) == Status::kOk;
    if (is_valid) measurement.values = std::move(h);
    has_all = has_all && is_valid;
  }
  return true;
}

/// Sets the state to truth. Returns false if the truth of a block with a covariance is unknown.
bool CramerRaoBound::MoveToTruth(const Truth& truth) {
  State& state = engine_.f.state;
  std::vector<double> values = state.values();
  for (BlockId id = 0; id < std::ssize(truths_); ++id) {
    const Block& block = state.layout()[id];
    const auto t = static_cast<std::size_t>(truths_[static_cast<std::size_t>(id)]);
    const bool is_known = t < truth.size() && !truth[t].empty();
    if (block.has_covariance() && !is_known) return false;
    if (block.present && is_known) std::ranges::copy(truth[t], values.begin() + block.value_offset);
  }
  if (engine_.landmarks && !MoveLandmarks(values)) return false;
  state.MoveTo(values);
  return true;
}

/// Returns the true value of a landmark block that is new in this frame. Returns nullopt if the
/// anchors of this frame differ, because a block does not identify its anchor.
std::optional<std::vector<double>> CramerRaoBound::TrueValue(
    const Block& block, const double* value, std::span<const Block* const> anchors) const {
  const auto position = true_landmark_(LandmarkOf(block));
  if (!position) return {};
  if (block.geometry().ambient == 3 && block.space.name == "landmark") {
    return std::vector<double>(position->begin(), position->end());
  }
  const bool is_anchored = block.space.name != "landmark";
  if (is_anchored && anchors.empty()) return {};
  const double* origin = is_anchored ? landmarks_.at(anchors.front()->name).data() : value;
  const Eigen::Map<const Eigen::Vector3d> a(origin), p(position->data());
  constexpr double kSame = 1e-9;  // m, largest difference of equal anchors due to rounding
  for (const Block* anchor : anchors) {
    if (!((a - Eigen::Map<const Eigen::Vector3d>(landmarks_.at(anchor->name).data())).norm() <
          kSame)) {
      return {};
    }
  }
  const double distance = (p - a).norm();
  const Eigen::Vector3d m = (p - a) / distance;
  if (block.space.name == "direction") return std::vector<double>{m.x(), m.y(), m.z()};
  if (is_anchored) return std::vector<double>{1.0 / distance};
  std::vector<double> y(6);
  const Ray<double> ray{{a.x(), a.y(), a.z()}, {m.x(), m.y(), m.z()}, 1.0 / distance};
  if (!InverseDepth::FromRay(ray, y.data())) return {};
  return y;
}

/// Sets the landmark blocks in `values` to truth. Returns false if the true position of a landmark
/// is unknown.
bool CramerRaoBound::MoveLandmarks(std::vector<double>& values) {
  const std::vector<Block>& blocks = engine_.f.state.layout().blocks();
  std::map<std::string, std::vector<double>> present;
  std::vector<const Block*> new_blocks, anchors;
  for (std::size_t id = truths_.size(); id < blocks.size(); ++id) {
    const Block& block = blocks[id];
    if (!block.present) continue;
    if (auto known = landmarks_.extract(block.name)) {
      present.insert(std::move(known));
    } else {
      (block.space.name == "anchor" ? anchors : new_blocks).push_back(&block);
    }
  }
  for (const Block* block : anchors) {
    const double* a = values.data() + block->value_offset;
    present[block->name].assign(a, a + block->geometry().ambient);
  }
  landmarks_ = std::move(present);
  for (const Block* block : new_blocks) {
    auto true_value = TrueValue(*block, values.data() + block->value_offset, anchors);
    if (!true_value) return false;
    landmarks_[block->name] = std::move(*true_value);
  }
  for (std::size_t id = truths_.size(); id < blocks.size(); ++id) {
    if (!blocks[id].present) continue;
    std::ranges::copy(landmarks_.at(blocks[id].name), values.begin() + blocks[id].value_offset);
  }
  return true;
}

}  // namespace alidade::internal
