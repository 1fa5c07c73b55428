// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/ekf_landmarks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "alidade/base/statistics.h"
#include "alidade/system/landmark_representation.h"

namespace alidade {
namespace {

/// A landmark that waits for its initialisation is no more counted after so many frames without it.
constexpr int kWaitingFrames = 30;

/// The role of a landmark that is a point, m.
Space Xyz() {
  return {"landmark", "m", "", {"x", "y", "z"}, Geometry::Vector(3), ALIDADE_ROLE_LANDMARK};
}

}  // namespace

int Generations::Of(std::int64_t id) const {
  const auto found = of_.find(id);
  return found == of_.end() ? 0 : found->second;
}

void Generations::End(std::int64_t id, int generation) {
  constexpr std::size_t kMost = 100'000;
  ++ends_;
  log_.emplace_back(id, of_[id] = generation);
  if (log_.size() <= kMost) return;
  const auto [oldest, its] = log_.front();
  log_.pop_front();
  const auto found = of_.find(oldest);
  if (found != of_.end() && found->second == its) of_.erase(found);
}

void Generations::GoBackTo(std::size_t ends) {
  for (; ends_ > ends && !log_.empty(); --ends_, log_.pop_back()) {
    const auto [id, generation] = log_.back();
    if (generation > 1) {
      of_[id] = generation - 1;
    } else {
      of_.erase(id);
    }
  }
}

Ekf::Landmarks::Landmarks(Ekf& ekf) : ekf_(ekf), options_(*ekf.system_.landmarks) {
  for (const SensorBinding& sensor : ekf_.system_.sensors) {
    Family& family = families_.emplace_back();
    const std::vector<Space>& roles = sensor.model.roles();
    family.representation = RepresentationOf(roles);
    for (std::size_t i = 0; i < roles.size(); ++i) {
      if (roles[i].name == "position") family.position = static_cast<int>(i);
      ALIDADE_EXPECTS(roles[i].landmark() || family.first < 0);
      if (!roles[i].landmark()) continue;
      if (family.first < 0) family.first = static_cast<int>(i);
      family.roles.push_back(roles[i]);
    }
    ALIDADE_EXPECTS(family.first < 0 || sensor.model.prior_size() == 0 ||
                    (options_.prior && std::isfinite(options_.prior->inverse_distance) &&
                     options_.prior->sigma >= 0.0));
    ALIDADE_EXPECTS(family.first < 0 || sensor.model.prior_size() <= 1);
    ALIDADE_EXPECTS(family.first < 0 || family.representation == internal::XyzRepresentation() ||
                    sensor.xyz ||
                    (options_.known.empty() && !(options_.max_linearity_index > 0.0)));
    const int dof = sensor.model.measurement().geometry.tangent;
    const OnePointRansac ransac = sensor.outlier_rejection.value_or(OnePointRansac{});
    support_.push_back(ChiSquareQuantile(ransac.inlier_probability, dof));
    rescue_.push_back(ChiSquareQuantile(ransac.rescue_probability, dof));
  }
}

BlockId Ekf::Landmarks::Declare(std::int64_t id, const Space& role, BlockStatus status) {
  const std::string name = "landmarks." + std::to_string(id) + '.' + role.name;
  return ekf_.state_.Declare(name + '#' + std::to_string(map_.names++), "landmarks", role, status);
}

void Ekf::Landmarks::AddKnown() {
  for (const KnownLandmark& known : options_.known) {
    Landmark& landmark = map_.landmarks[known.id];
    landmark.representation = internal::XyzRepresentation();
    landmark.known = true;
    landmark.blocks = {Declare(
        known.id, Xyz(), known.sigma > 0.0 ? BlockStatus::kEstimated : BlockStatus::kConstant)};
    ekf_.state_.Add(landmark.blocks[0], known.position.data(),
                    known.sigma * known.sigma * Eigen::Matrix3d::Identity());
  }
}

std::vector<const double*> Ekf::Landmarks::ValuesOf(const Landmark& landmark) const {
  std::vector<const double*> values;
  for (const BlockId id : landmark.blocks) values.push_back(ekf_.state_.value(id));
  return values;
}

bool Ekf::Landmarks::HasInverseDistance(const Landmark& landmark) const {
  return landmark.in_state() && landmark.representation && !IsXyz(*landmark.representation);
}

/// The last element of all that has one.
double Ekf::Landmarks::InverseDistance(const Landmark& landmark) const {
  const BlockId last = landmark.blocks.back();
  return ekf_.state_.value(last)[ekf_.state_.layout()[last].geometry().ambient - 1];
}

double Ekf::Landmarks::InverseDistanceSigma(const Landmark& landmark) const {
  const Block& last = ekf_.state_.layout()[landmark.blocks.back()];
  const int row = last.tangent_offset + last.geometry().tangent - 1;
  return std::sqrt(ekf_.state_.covariance().Variance(row));
}

const double* Ekf::Landmarks::CameraOf(const Family& family) const {
  if (family.position < 0) return nullptr;
  const SensorBinding& sensor =
      ekf_.system_.sensors[static_cast<std::size_t>(&family - families_.data())];
  const BlockId id = sensor.roles[static_cast<std::size_t>(family.position)].block;
  return id < 0 ? nullptr : ekf_.state_.value(id);
}

void Ekf::Landmarks::PlanRows() {
  used_ = 0;
  bool any = false;
  for (Row& row : ekf_.rows()) {
    MeasurementReport& entry = ekf_.EntryOf(row);
    if (!Has(row.sensor)) continue;
    any = true;
    if (entry.outcome != Outcome::kAccepted) continue;
    const auto found = map_.landmarks.find(row.measurement->landmark);
    if (row.measurement->landmark < 0) {
      entry.outcome = Outcome::kInvalid;
    } else if (found != map_.landmarks.end() && found->second.in_state()) {
      Plan(row, found->second);
    } else {
      entry.outcome = Outcome::kNotReady;
    }
  }
  if (any) ++map_.frame;
}

/// The plan of the row's sensor with the blocks of the landmark in its last roles.
void Ekf::Landmarks::Plan(Row& row, const Landmark& landmark) {
  if (used_ == plans_.size()) plans_.emplace_back();
  SensorPlan& plan = plans_[used_++];
  const SensorBinding& sensor = ekf_.BindingOf(row);
  const Family& family = FamilyOf(row);
  const SensorPlan& base = ekf_.plans_[static_cast<std::size_t>(row.sensor)];
  plan = base;
  for (const double*& at : plan.linearised_at) {
    if (at == base.implied.data()) at = plan.implied.data();
  }
  for (auto* const roles : {&plan.roles, &plan.linearised_at}) {
    roles->resize(static_cast<std::size_t>(family.first));
  }
  plan.columns.resize(static_cast<std::size_t>(family.first));
  for (const BlockId id : landmark.blocks) {
    const Block& block = ekf_.state_.layout()[id];
    plan.roles.push_back(ekf_.state_.value(id));
    plan.linearised_at.push_back(plan.roles.back());
    plan.columns.push_back(block.has_covariance() ? plan.width : -1);
    if (!block.has_covariance()) continue;
    plan.parts.push_back({block.tangent_offset, block.geometry().tangent, plan.width});
    plan.consider.push_back(false);
    plan.width += block.geometry().tangent;
  }
  plan.strides.assign(plan.roles.size(), plan.width);
  row.plan = &plan;
  row.model = landmark.representation == family.representation ? nullptr : &*sensor.xyz;
  row.zeroed = nullptr;
}

void Ekf::Landmarks::Finish() {
  moved_ = false;
  Count();
  CheckDepths();
  Prune();
  Convert();
  InitialiseNew();
  for (Row& row : ekf_.rows()) {
    row.plan = nullptr;
    row.model = nullptr;
  }
  if (moved_) ekf_.Bind();
}

/// Takes down which landmarks were seen, and what became of their measurements.
void Ekf::Landmarks::Count() {
  for (Row& row : ekf_.rows()) {
    const MeasurementReport& entry = ekf_.EntryOf(row);
    if (!Has(row.sensor) || (row.plan == nullptr && entry.outcome != Outcome::kNotReady)) continue;
    if (!ekf_.plans_[static_cast<std::size_t>(row.sensor)].ready) continue;
    const auto [at, is_new] = map_.landmarks.try_emplace(row.measurement->landmark);
    Landmark& landmark = at->second;
    if (is_new) landmark.generation = generations_.Of(at->first);
    if (landmark.first == kNoTimestamp) landmark.first = ekf_.timestamp_;
    if (landmark.observations == 0 || landmark.seen != map_.frame) ++landmark.observations;
    landmark.seen = map_.frame;
    landmark.last = ekf_.timestamp_;
    if (row.plan == nullptr) continue;
    ++landmark.tried;
    landmark.accepted += Used(entry);
  }
}

/// Looks for inverse distances that an update left at zero or below.
void Ekf::Landmarks::CheckDepths() {
  for (auto at = map_.landmarks.begin(); at != map_.landmarks.end();) {
    Landmark& landmark = at->second;
    const bool negative = HasInverseDistance(landmark) && !(InverseDistance(landmark) > 0.0);
    counts().negative += negative && !landmark.negative;
    landmark.negative = negative;
    if (negative && options_.negative_depth == LandmarkOptions::NegativeDepth::kDelete) {
      at = Delete(at);
    } else {
      ++at;
    }
  }
}

/// Drops what was not seen for long, or fails too often. Known landmarks stay.
void Ekf::Landmarks::Prune() {
  for (auto at = map_.landmarks.begin(); at != map_.landmarks.end();) {
    const Landmark& landmark = at->second;
    const std::int64_t unseen = map_.frame - landmark.seen;
    const int most = landmark.in_state() ? options_.max_missed_frames : kWaitingFrames;
    const bool lost = most > 0 && unseen >= most;
    const bool fails = landmark.tried >= options_.min_attempts &&
                       landmark.accepted < options_.min_match_ratio * landmark.tried;
    if ((lost || fails) && !landmark.known) {
      at = Delete(at);
    } else {
      ++at;
    }
  }
}

std::map<std::int64_t, Ekf::Landmarks::Landmark>::iterator Ekf::Landmarks::Delete(
    std::map<std::int64_t, Landmark>::iterator at) {
  if (at->second.in_state()) {
    DropBlocks(at->second);
    ++counts().deleted;
    generations_.End(at->first, at->second.generation + 1);
    map_.ended = generations_.ends();
  }
  return map_.landmarks.erase(at);
}

/// A shared block goes with the last landmark on it.
void Ekf::Landmarks::DropBlocks(Landmark& landmark) {
  for (const BlockId id : landmark.blocks) {
    const auto shared = map_.users.find(id);
    if (shared != map_.users.end() && --shared->second > 0) continue;
    if (shared != map_.users.end()) map_.users.erase(shared);
    ekf_.state_.Drop(id);
  }
  landmark.blocks.clear();
  moved_ = true;
}

/// Turns those landmarks of the frame into xyz that are linear enough.
void Ekf::Landmarks::Convert() {
  if (!(options_.max_linearity_index > 0.0)) return;
  for (const Row& row : ekf_.rows()) {
    if (row.plan == nullptr || row.model != nullptr || !Used(ekf_.EntryOf(row))) continue;
    const auto found = map_.landmarks.find(row.measurement->landmark);
    if (found == map_.landmarks.end() || !found->second.in_state()) continue;
    counts().converted += ConvertToXyz(found->first, found->second, FamilyOf(row));
  }
}

bool Ekf::Landmarks::ConvertToXyz(std::int64_t id, Landmark& landmark, const Family& family) {
  const double* const camera = CameraOf(family);
  if (!HasInverseDistance(landmark) || camera == nullptr) return false;
  const std::vector<const double*> values = ValuesOf(landmark);
  const double linearity = internal::LinearityOf(*landmark.representation, values.data(),
                                                 InverseDistanceSigma(landmark), camera);
  const auto point = internal::PointOf(*landmark.representation, values.data());
  if (!point || !(linearity < options_.max_linearity_index)) return false;
  std::vector<Eigen::MatrixXd> jacobians;
  Eigen::Index column = 0;
  for (const BlockId block : landmark.blocks) {
    const int size = ekf_.state_.layout()[block].geometry().tangent;
    jacobians.emplace_back(point->jacobian.middleCols(column, size));
    column += size;
  }
  const BlockId to = Declare(id, Xyz(), BlockStatus::kEstimated);
  ekf_.state_.Initialise(to, point->position.data(), landmark.blocks, jacobians,
                         Eigen::Matrix3d::Zero());
  DropBlocks(landmark);
  landmark.blocks = {to};
  landmark.representation = internal::XyzRepresentation();
  return true;
}

std::vector<LandmarkEstimate> Ekf::Landmarks::Estimates() const {
  std::vector<LandmarkEstimate> estimates;
  for (const auto& [id, landmark] : map_.landmarks) {
    if (!landmark.in_state()) continue;
    LandmarkEstimate& one = estimates.emplace_back();
    one.id = id;
    one.generation = landmark.generation;
    one.representation = landmark.representation;
    one.first = landmark.first;
    one.last = landmark.last;
    one.tried = landmark.tried;
    one.accepted = landmark.accepted;
    if (HasInverseDistance(landmark)) {
      one.inverse_distance = InverseDistance(landmark);
      one.sigma = InverseDistanceSigma(landmark);
    }
    if (!landmark.representation) continue;
    const auto point = internal::PointOf(*landmark.representation, ValuesOf(landmark).data());
    if (!point) continue;
    one.position = point->position;
    one.covariance = CovarianceOf(landmark, point->jacobian);
  }
  return estimates;
}

/// J P J' of the blocks of a landmark.
Eigen::Matrix3d Ekf::Landmarks::CovarianceOf(
    const Landmark& landmark, const Eigen::Matrix<double, 3, Eigen::Dynamic>& jacobian) const {
  std::vector<JacobianBlock> parts;
  Eigen::Index column = 0;
  for (const BlockId id : landmark.blocks) {
    const Block& block = ekf_.state_.layout()[id];
    const int size = block.geometry().tangent;
    if (block.has_covariance()) {
      parts.push_back({block.tangent_offset, jacobian.middleCols(column, size)});
    }
    column += size;
  }
  return Times(parts, 3, ekf_.state_.covariance().TimesTransposed(parts, 3));
}

}  // namespace alidade
