// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/cramer_rao.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <utility>

#include "alidade/estimation/ekf_equations.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/model/landmark.h"

namespace alidade::internal {
namespace {

/// The problem whose best filter is asked for: every measurement counts by its nominal noise, with
/// its Jacobian at the state, and corrects all that it tells of.
Problem Ideal(Problem problem) {
  for (SensorBinding& sensor : problem.sensors) {
    sensor.loss = {};
    for (RoleBinding& role : sensor.roles) {
      role.jacobian_at = JacobianAt::kPrediction;
      if (role.mode == RoleMode::kConsider) role.mode = RoleMode::kEstimate;
    }
  }
  return problem;
}

/// Whether a measurement that counts could not be used.
bool LostOne(const UpdateReport& report) {
  return std::ranges::any_of(report.measurements(), [](const MeasurementReport& one) {
    return one.outcome == Outcome::kNotPd || one.outcome == Outcome::kNotFinite ||
           one.outcome == Outcome::kOutOfDomain;
  });
}

/// Why landmarks that `sensor` initialises cannot start at truth; "": they can.
std::string WhyNotAtTruth(const SensorBinding& sensor) {
  const auto representation = RepresentationOf(sensor.model->roles());
  const std::string name = '\'' + sensor.name + '\'';
  if (!representation) return name + " has landmarks of a representation of its own";
  if (IsXyz(*representation) && sensor.model->inverse().prior_size > 0) {
    return name + " places landmarks as xyz by a prior, by whose mean the Jacobians are";
  }
  return "";
}

/// Of a problem with landmarks.
std::string WhyNoMap(const Problem& problem) {
  for (std::size_t i = 0; i < problem.sensors.size(); ++i) {
    const SensorBinding& sensor = problem.sensors[i];
    for (std::size_t k = 0; k < i; ++k) {
      if (problem.sensors[k].stream != sensor.stream) continue;
      return '\'' + problem.sensors[k].name + "' and '" + sensor.name + "' share a stream";
    }
    if (!sensor.model->has_landmark()) continue;
    if (std::string why = WhyNotAtTruth(sensor); !why.empty()) return why;
  }
  return "";
}

/// Of a block `landmarks.ID.role#N`.
std::int64_t LandmarkOf(const Block& block) {
  return std::stoll(block.name.substr(block.owner.size() + 1));
}

/// The landmark at p as a sensor's roles write it, from one metre before it along z. What is
/// measured of it does not depend on from where.
std::vector<double> Written(LandmarkRepresentation representation, const std::array<double, 3>& p) {
  return WithRepresentation(representation, [&](auto as) {
    using As = decltype(as);
    std::vector<double> y(detail::Blocks<As>::kAmbient);
    As::FromRay(Ray<double>{{p[0], p[1], p[2] - 1.0}, {0.0, 0.0, 1.0}, 1.0}, y.data());
    return y;
  });
}

}  // namespace

std::string CramerRaoBound::WhyNone(const Problem& problem, const std::vector<StreamInfo>& truths) {
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
    : engine_(Ideal(problem), WithoutRecovery({}), streams, std::make_unique<EkfEquations>()),
      true_landmark_(std::move(true_landmark)),
      truths_(MatchTruths(problem.layout, truths)) {
  ALIDADE_EXPECTS(WhyNone(problem, truths).empty());
  ALIDADE_EXPECTS(!problem.landmarks || true_landmark_);
  for (const StreamInfo& stream : streams) {
    const auto at = std::ranges::find(problem.sensors, stream.name, &SensorBinding::stream);
    const auto sensor = static_cast<int>(at - problem.sensors.begin());
    sensors_.push_back(at == problem.sensors.end() ? -1 : sensor);
  }
}

bool CramerRaoBound::Add(const SourceFrame& frame) {
  if (lost_) return false;
  FilterState& f = engine_.f;
  if (f.timestamp == kNoTimestamp) lost_ = !MoveToTruth(frame.truth);
  engine_.Process({frame.timestamp, {}});
  lost_ = lost_ || !MoveToTruth(frame.truth);
  if (!engine_.landmarks) {
    engine_.Process(frame);
  } else if (!lost_) {
    Frame at_truth = frame;
    bool all = !f.blocks.waiting;
    lost_ = !MeasureAtTruth(at_truth, all);
    engine_.Process(at_truth);
    lost_ = lost_ || (!all && f.report.landmarks.initialised > 0);
  }
  lost_ = lost_ || LostOne(f.report) || f.health.ended || !MoveToTruth(frame.truth);
  return !lost_;
}

/// Puts what each sensor measures at truth in place of what is valid of the frame; `all` becomes
/// false where that is beyond the sensor's limits, so that it stays as it was measured. False where
/// a landmark has no truth.
bool CramerRaoBound::MeasureAtTruth(Frame& frame, bool& all) const {
  const FilterState& f = engine_.f;
  for (Measurement& one : frame.measurements) {
    const int index = sensors_[static_cast<std::size_t>(one.stream)];
    if (index < 0) continue;
    const SensorBinding& sensor = f.problem_index->problem.sensors[static_cast<std::size_t>(index)];
    const SensorModel& model = *sensor.model;
    if (f.blocks.waiting || model.Valid({one.values.data(), one.known.data()}) != Status::kOk)
      continue;
    std::vector<const double*> roles;
    for (const RoleBinding& role : sensor.roles) {
      const bool has_value = role.block >= 0 && f.state.layout()[role.block].present;
      roles.push_back(has_value ? f.state.value(role.block) : nullptr);
    }
    std::vector<double> landmark;
    if (model.has_landmark()) {
      if (one.landmark < 0) continue;
      const auto p = true_landmark_(one.landmark);
      if (!p) return false;
      landmark = Written(*RepresentationOf(model.roles()), *p);
      int at = 0;
      roles.resize(model.roles().size());
      for (std::size_t i = 0; i < roles.size(); ++i) {
        if (!model.roles()[i].landmark()) continue;
        roles[i] = landmark.data() + at;
        at += model.roles()[i].geometry.ambient;
      }
    }
    std::vector<double> h(one.values.size());
    const bool there = model.Predict(roles.data(), h.data(), one.known.data()) == Status::kOk &&
                       model.Valid({h.data(), one.known.data()}) == Status::kOk;
    if (there) one.values = std::move(h);
    all = all && there;
  }
  return true;
}

/// False where the truth of a block that has a covariance is not known.
bool CramerRaoBound::MoveToTruth(const Truth& truth) {
  State& state = engine_.f.state;
  std::vector<double> values = state.values();
  for (BlockId id = 0; id < std::ssize(truths_); ++id) {
    const Block& block = state.layout()[id];
    const auto t = static_cast<std::size_t>(truths_[static_cast<std::size_t>(id)]);
    const bool known = t < truth.size() && !truth[t].empty();
    if (block.has_covariance() && !known) return false;
    if (block.present && known) std::ranges::copy(truth[t], values.begin() + block.value_offset);
  }
  if (engine_.landmarks && !MoveLandmarks(values)) return false;
  state.MoveTo(values);
  return true;
}

/// What a block of a landmark that is new in this frame has at truth. Its anchor is among those of
/// the frame, which are to be one: which of several it has, its block does not say.
std::optional<std::vector<double>> CramerRaoBound::AtTruth(
    const Block& block, const double* value, std::span<const Block* const> anchors) const {
  const auto place = true_landmark_(LandmarkOf(block));
  if (!place) return {};
  if (block.geometry().ambient == 3 && block.space.name == "landmark") {
    return std::vector<double>(place->begin(), place->end());
  }
  const bool anchored = block.space.name != "landmark";
  if (anchored && anchors.empty()) return {};
  const double* from = anchored ? landmarks_.at(anchors.front()->name).data() : value;
  const Eigen::Map<const Eigen::Vector3d> a(from), p(place->data());
  constexpr double kSame = 1e-9;  // m, what rounding may make of one camera
  for (const Block* other : anchors) {
    if (!((a - Eigen::Map<const Eigen::Vector3d>(landmarks_.at(other->name).data())).norm() <
          kSame)) {
      return {};
    }
  }
  const double distance = (p - a).norm();
  const Eigen::Vector3d m = (p - a) / distance;
  if (block.space.name == "direction") return std::vector<double>{m.x(), m.y(), m.z()};
  if (anchored) return std::vector<double>{1.0 / distance};
  std::vector<double> y(6);
  const Ray<double> ray{{a.x(), a.y(), a.z()}, {m.x(), m.y(), m.z()}, 1.0 / distance};
  if (!InverseDepth::FromRay(ray, y.data())) return {};
  return y;
}

/// False where the place of one is not known.
bool CramerRaoBound::MoveLandmarks(std::vector<double>& values) {
  const std::vector<Block>& blocks = engine_.f.state.layout().blocks();
  std::map<std::string, std::vector<double>> present;
  std::vector<const Block*> fresh, anchors;
  for (std::size_t id = truths_.size(); id < blocks.size(); ++id) {
    const Block& block = blocks[id];
    if (!block.present) continue;
    if (auto known = landmarks_.extract(block.name)) {
      present.insert(std::move(known));
    } else {
      (block.space.name == "anchor" ? anchors : fresh).push_back(&block);
    }
  }
  for (const Block* block : anchors) {
    const double* a = values.data() + block->value_offset;
    present[block->name].assign(a, a + block->geometry().ambient);
  }
  landmarks_ = std::move(present);
  for (const Block* block : fresh) {
    auto at_truth = AtTruth(*block, values.data() + block->value_offset, anchors);
    if (!at_truth) return false;
    landmarks_[block->name] = std::move(*at_truth);
  }
  for (std::size_t id = truths_.size(); id < blocks.size(); ++id) {
    if (!blocks[id].present) continue;
    std::ranges::copy(landmarks_.at(blocks[id].name), values.begin() + blocks[id].value_offset);
  }
  return true;
}

}  // namespace alidade::internal
