// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/landmark_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/estimation/landmark_representation.h"
#include "alidade/state/projection.h"

namespace alidade::internal {
namespace {

/// A landmark that waits for its initialisation is no more counted after so many frames without it.
constexpr int kWaitingFrames = 30;

/// The role of a landmark that is a point, m.
Space Xyz() {
  return {"landmark", "m", "", {"x", "y", "z"}, Geometry::Vector(3), ALIDADE_ROLE_LANDMARK};
}

bool IsUsed(const PendingMeasurement& pending) {
  return pending.report->outcome == Outcome::kAccepted;
}

/// Of a landmark that has a representation.
std::array<const double*, 3> ValuesOf(const State& state, const LandmarkRecord& landmark) {
  std::array<const double*, 3> values{};
  const auto value = [&](BlockId id) { return state.value(id); };
  std::ranges::transform(landmark.blocks, values.begin(), value);
  return values;
}

bool HasInverseDistance(const LandmarkRecord& landmark) {
  return landmark.in_state() && landmark.representation && !IsXyz(*landmark.representation);
}

/// The last element of all that has one.
double InverseDistance(const State& state, const LandmarkRecord& landmark) {
  const BlockId last = landmark.blocks.back();
  return state.value(last)[state.layout()[last].geometry().ambient - 1];
}

double InverseDistanceSigma(const State& state, const LandmarkRecord& landmark) {
  const Block& last = state.layout()[landmark.blocks.back()];
  const int row = last.tangent_offset + last.geometry().tangent - 1;
  return std::sqrt(state.covariance().Variance(row));
}

double LinearityIndexOf(const State& state, const LandmarkRecord& landmark, const double* camera) {
  return LinearityOf(*landmark.representation, ValuesOf(state, landmark).data(),
                     InverseDistanceSigma(state, landmark), camera);
}

/// J P J' of the blocks of a landmark.
Eigen::Matrix3d CovarianceOf(const State& state, const LandmarkRecord& landmark,
                             const LandmarkPoint& point) {
  constexpr int kWidest = 6;
  std::array<int, kWidest> rows;  // of P
  auto jacobian = point.jacobian;
  int used = 0, column = 0;
  for (const BlockId id : landmark.blocks) {
    const Block& block = state.layout()[id];
    for (int k = 0; k < block.geometry().tangent; ++k, ++column) {
      if (!block.has_covariance()) continue;
      rows[static_cast<std::size_t>(used)] = block.tangent_offset + k;
      jacobian.col(used++) = point.jacobian.col(column);
    }
  }
  jacobian.conservativeResize(Eigen::NoChange, used);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  const std::span present(rows.data(), static_cast<std::size_t>(used));
  AddProjection(state.covariance(), {jacobian.data(), 3, present}, covariance.data());
  return covariance;
}

/// Of a landmark in the state.
LandmarkEstimate EstimateOf(const State& state, std::int64_t id, const LandmarkRecord& landmark) {
  LandmarkEstimate one;
  one.id = id;
  one.generation = landmark.generation;
  one.representation = landmark.representation;
  one.first = landmark.first;
  one.last = landmark.last;
  one.tried = landmark.tried;
  one.accepted = landmark.accepted;
  if (HasInverseDistance(landmark)) {
    one.inverse_distance = InverseDistance(state, landmark);
    one.sigma = InverseDistanceSigma(state, landmark);
  }
  if (!landmark.representation) {
    for (const BlockId of : landmark.blocks) {
      const Block& block = state.layout()[of];
      if (block.space.name != "landmark_position" || block.geometry().tangent != 3) continue;
      one.position = Eigen::Map<const Eigen::Vector3d>(state.value(of));
      one.covariance = state.covariance()
                           .lower()
                           .block<3, 3>(block.tangent_offset, block.tangent_offset)
                           .selfadjointView<Eigen::Lower>();
    }
    return one;
  }
  const auto point = PointOf(*landmark.representation, ValuesOf(state, landmark).data());
  if (!point) return one;
  one.position = point->position;
  one.covariance = CovarianceOf(state, landmark, *point);
  return one;
}

}  // namespace

int LandmarkIdReuse::Of(std::int64_t id) const {
  const auto found = std::ranges::lower_bound(ended_, id, {}, &Ended::id);
  return found == ended_.end() || found->id != id ? 0 : found->generation;
}

void LandmarkIdReuse::End(std::int64_t id, int generation) {
  constexpr std::int64_t kMost = 100'000;
  auto found = std::ranges::lower_bound(ended_, id, {}, &Ended::id);
  if (found == ended_.end() || found->id != id) found = ended_.insert(found, Ended{});
  *found = {id, ++ends_, generation};
  if (std::ssize(ended_) <= kMost) return;
  std::erase_if(ended_, [&](const Ended& one) { return one.order <= ends_ - kMost / 2; });
}

LandmarkMap::LandmarkMap(const ProblemIndex& index)
    : options_(*index.problem.landmarks), xyz_(Xyz()) {
  for (const SensorBinding& sensor : index.problem.sensors) {
    Family& family = families_.emplace_back();
    const std::vector<Space>& roles = sensor.model->roles();
    family.representation = RepresentationOf(roles);
    for (std::size_t i = 0; i < roles.size(); ++i) {
      if (roles[i].name == "position") family.position = static_cast<int>(i);
      ALIDADE_EXPECTS(roles[i].landmark() || family.first < 0);
      if (!roles[i].landmark()) continue;
      if (family.first < 0) family.first = static_cast<int>(i);
      family.roles.push_back(roles[i]);
    }
    ALIDADE_EXPECTS(family.first < 0 || sensor.model->inverse().prior_size == 0 ||
                    (options_.prior && std::isfinite(options_.prior->inverse_distance) &&
                     options_.prior->sigma >= 0.0));
    ALIDADE_EXPECTS(family.first < 0 || sensor.model->inverse().prior_size <= 1);
    ALIDADE_EXPECTS(family.first < 0 || family.representation == XyzRepresentation() ||
                    sensor.xyz ||
                    (options_.known.empty() && !(options_.max_linearity_index > 0.0)));
  }
}

BlockId LandmarkMap::Declare(FilterState& f, std::int64_t id, const Space& role,
                             BlockStatus status) {
  name_ = "landmarks.";
  name_ += std::to_string(id);
  name_ += '.';
  name_ += role.name;
  name_ += '#';
  name_ += std::to_string(names_++);
  return f.state.Declare(name_, "landmarks", role, status);
}

void LandmarkMap::AddKnown(FilterState& f) {
  for (const KnownLandmark& known : options_.known) {
    LandmarkRecord& landmark = landmarks_[known.id];
    landmark.representation = XyzRepresentation();
    landmark.known = true;
    landmark.blocks = {Declare(
        f, known.id, xyz_, known.sigma > 0.0 ? BlockStatus::kEstimated : BlockStatus::kConstant)};
    f.state.Add(landmark.blocks[0], known.position.data(),
                known.sigma * known.sigma * Eigen::Matrix3d::Identity());
  }
}

const double* LandmarkMap::CameraOf(const State& state, const PendingMeasurement& pending) const {
  const int position = FamilyOf(pending).position;
  if (position < 0) return nullptr;
  const BlockId id = pending.binding->roles[static_cast<std::size_t>(position)].block;
  return id < 0 ? nullptr : state.value(id);
}

[[gnu::noinline]] void LandmarkMap::Attach(FilterState& f, std::span<PendingMeasurement> rows) {
  bool any = false;
  for (PendingMeasurement& pending : rows) {
    if (!Has(pending)) continue;
    any = true;
    Outcome& outcome = pending.report->outcome;
    if (outcome != Outcome::kAccepted) continue;
    const auto found = landmarks_.find(pending.measurement->landmark);
    if (pending.measurement->landmark < 0) {
      outcome = Outcome::kInvalid;
    } else if (found != landmarks_.end() && found->second.in_state()) {
      Attach(f, pending, found->second);
    } else {
      outcome = Outcome::kNotReady;
    }
  }
  if (any) ++frame_;
}

/// Puts the blocks of the landmark into the row's last roles.
void LandmarkMap::Attach(const FilterState& f, PendingMeasurement& pending,
                         const LandmarkRecord& landmark) {
  const Family& family = FamilyOf(pending);
  pending.own = *pending.place;
  pending.own.PutLandmark(static_cast<std::size_t>(family.first), f.state.layout(),
                          landmark.blocks);
  pending.Bind(pending.own);
  if (landmark.representation != family.representation) pending.model = pending.binding->xyz.get();
}

[[gnu::noinline]] void LandmarkMap::Maintain(FilterState& f, std::span<PendingMeasurement> rows) {
  Count(f, rows);
  CheckDepths(f);
  Prune(f);
  Convert(f, rows);
  InitialiseNew(f, rows);
}

/// Takes down which landmarks were seen, and what became of their measurements.
void LandmarkMap::Count(FilterState& f, std::span<PendingMeasurement> rows) {
  for (const PendingMeasurement& pending : rows) {
    if (!Has(pending) || (!pending.on_landmark() && pending.report->outcome != Outcome::kNotReady))
      continue;
    if (!IsReady(f, pending)) continue;
    LandmarkRecord& landmark = RecordOf(pending.measurement->landmark);
    if (landmark.first == kNoTimestamp) landmark.first = f.timestamp;
    if (landmark.observations == 0 || landmark.seen != frame_) ++landmark.observations;
    landmark.seen = frame_;
    landmark.last = f.timestamp;
    if (!pending.on_landmark()) continue;
    ++landmark.tried;
    landmark.accepted += IsUsed(pending);
  }
}

/// A new one has the memory of one that is gone.
LandmarkRecord& LandmarkMap::RecordOf(std::int64_t id) {
  const auto at = landmarks_.lower_bound(id);
  if (at != landmarks_.end() && at->first == id) return at->second;
  if (spare_.empty()) {
    LandmarkRecord& landmark = landmarks_.try_emplace(at, id)->second;
    landmark.generation = generations_.Of(id);
    return landmark;
  }
  ById::node_type node = std::move(spare_.back());
  spare_.pop_back();
  LandmarkRecord fresh;
  fresh.blocks.swap(node.mapped().blocks);
  fresh.generation = generations_.Of(id);
  node.key() = id;
  node.mapped() = std::move(fresh);
  return landmarks_.insert(at, std::move(node))->second;
}

/// Looks for inverse distances that an update left at zero or below.
void LandmarkMap::CheckDepths(FilterState& f) {
  DeleteIf(f, [&](LandmarkRecord& landmark) {
    return IsNegative(f, landmark) &&
           options_.negative_depth == LandmarkOptions::NegativeDepth::kDelete;
  });
}

/// Counts it where it has become so.
bool LandmarkMap::IsNegative(FilterState& f, LandmarkRecord& landmark) {
  const bool negative = HasInverseDistance(landmark) && !(InverseDistance(f.state, landmark) > 0.0);
  f.report.landmarks.negative += negative && !landmark.negative;
  landmark.negative = negative;
  return negative;
}

/// Deletes landmarks that were not seen for long, or fail too often. Known landmarks stay.
void LandmarkMap::Prune(FilterState& f) {
  DeleteIf(f, [&](const LandmarkRecord& landmark) {
    return !landmark.known && (frame_ >= DueOf(landmark) || Fails(landmark));
  });
}

/// Whether too few of its measurements are accepted.
bool LandmarkMap::Fails(const LandmarkRecord& landmark) const {
  return landmark.tried >= options_.min_attempts &&
         landmark.accepted < options_.min_match_ratio * landmark.tried;
}

/// The frame at which it is lost, unless it is seen before.
std::int64_t LandmarkMap::DueOf(const LandmarkRecord& landmark) const {
  const int most = landmark.in_state() ? options_.max_missed_frames : kWaitingFrames;
  return most > 0 ? landmark.seen + most : std::numeric_limits<std::int64_t>::max();
}

template <class Condition>
void LandmarkMap::DeleteIf(FilterState& f, const Condition& condition) {
  for (auto at = landmarks_.begin(); at != landmarks_.end();) {
    at = condition(at->second) ? Delete(f, at) : std::next(at);
  }
}

LandmarkMap::ById::iterator LandmarkMap::Delete(FilterState& f, ById::iterator at) {
  if (at->second.in_state()) {
    NoteRemoval(f, at->first, at->second);
    DropBlocks(f, at->second);
    ++f.report.landmarks.deleted;
    generations_.End(at->first, at->second.generation + 1);
  }
  const auto next = std::next(at);
  spare_.push_back(landmarks_.extract(at));
  return next;
}

/// Puts what is known of it, as long as it is in the state, into the report.
void LandmarkMap::NoteRemoval(FilterState& f, std::int64_t id, const LandmarkRecord& landmark) {
  f.report.removed_landmarks.push_back(EstimateOf(f.state, id, landmark));
  f.report.removed_landmarks.back().removed = f.timestamp;
}

/// A shared block goes with the last landmark on it.
void LandmarkMap::DropBlocks(FilterState& f, LandmarkRecord& landmark) {
  for (const BlockId id : landmark.blocks) {
    const auto index = static_cast<std::size_t>(id);
    const bool shared = index < users_.size() && users_[index] > 0;
    if (shared && --users_[index] > 0) continue;
    f.state.Remove(id);
  }
  landmark.blocks.clear();
}

/// Turns those landmarks of the frame into xyz that are linear enough.
void LandmarkMap::Convert(FilterState& f, std::span<PendingMeasurement> rows) {
  if (!(options_.max_linearity_index > 0.0)) return;
  for (const PendingMeasurement& pending : rows) {
    if (!pending.on_landmark() || pending.model != pending.binding->model.get() || !IsUsed(pending))
      continue;
    const auto found = landmarks_.find(pending.measurement->landmark);
    if (found == landmarks_.end() || !found->second.in_state()) continue;
    f.report.landmarks.converted += ConvertToXyz(f, found->first, found->second, pending);
  }
}

bool LandmarkMap::ConvertToXyz(FilterState& f, std::int64_t id, LandmarkRecord& landmark,
                               const PendingMeasurement& pending) {
  const double* const camera = CameraOf(f.state, pending);
  if (!HasInverseDistance(landmark) || camera == nullptr) return false;
  const double linearity = LinearityIndexOf(f.state, landmark, camera);
  const auto point = PointOf(*landmark.representation, ValuesOf(f.state, landmark).data());
  if (!point || !(linearity < options_.max_linearity_index)) return false;
  const BlockId to = Declare(f, id, xyz_, BlockStatus::kEstimated);
  const Eigen::Matrix3d none = Eigen::Matrix3d::Zero();
  f.state.Initialise({&to, 1}, point->position.data(), landmark.blocks, point->jacobian, none);
  DropBlocks(f, landmark);
  landmark.blocks = {to};
  landmark.representation = XyzRepresentation();
  return true;
}

/// Initialises landmarks of this frame that wait, as long as too few are measured.
void LandmarkMap::InitialiseNew(FilterState& f, std::span<PendingMeasurement> rows) {
  FindMeasured(rows);
  auto measured = std::ssize(measured_);
  for (Family& family : families_) family.shared.assign(family.roles.size(), -1);
  if (options_.prior) prior_ = *options_.prior;
  bool asked_map = prior_.adapt_after == 0;
  Reserve(f, rows, options_.max_per_frame - measured);
  for (PendingMeasurement& pending : rows) {
    if (measured >= options_.max_per_frame) return;
    const auto found = FindWaiting(f, pending);
    if (found == landmarks_.end()) continue;
    if (!asked_map) prior_.inverse_distance = PriorInverseDistance(f.state);
    asked_map = true;
    pending.report->outcome = Initialise(f, found->first, pending, found->second);
    if (pending.report->outcome != Outcome::kInitialised) continue;
    ++f.report.landmarks.initialised;
    ++measured;
  }
}

/// The landmark that the row may initialise, or the end.
LandmarkMap::ById::iterator LandmarkMap::FindWaiting(const FilterState& f,
                                                     const PendingMeasurement& pending) {
  if (!Has(pending) || pending.report->outcome != Outcome::kNotReady || !IsReady(f, pending) ||
      pending.binding->model->inverse().role != FamilyOf(pending).first) {
    return landmarks_.end();
  }
  const bool takes_prior =
      pending.binding->model->inverse().prior_size > 0 && prior_.min_observations > 0;
  const int least = takes_prior ? prior_.min_observations : options_.min_observations;
  const auto found = landmarks_.find(pending.measurement->landmark);
  const bool waits =
      found != landmarks_.end() && !found->second.in_state() && found->second.observations >= least;
  return waits ? found : landmarks_.end();
}

/// Takes memory at once for those that may come, `most`: the first frame has many.
void LandmarkMap::Reserve(FilterState& f, std::span<const PendingMeasurement> rows,
                          std::ptrdiff_t most) {
  int size = 0;
  for (const PendingMeasurement& pending : rows) {
    if (most <= 0) break;
    if (FindWaiting(f, pending) == landmarks_.end()) continue;
    for (const Space& role : FamilyOf(pending).roles)
      size += role.shared() ? 0 : role.geometry.tangent;
    --most;
  }
  f.state.covariance().Reserve(size);
}

/// A row that was used of each landmark in the state, by id; the first one of several.
void LandmarkMap::FindMeasured(std::span<PendingMeasurement> rows) {
  measured_.clear();
  for (const PendingMeasurement& pending : rows) {
    if (!pending.on_landmark() || !IsUsed(pending)) continue;
    const auto found = landmarks_.find(pending.measurement->landmark);
    if (found != landmarks_.end() && found->second.in_state()) measured_.push_back(&pending);
  }
  const auto id = [](const PendingMeasurement* pending) { return pending->measurement->landmark; };
  std::ranges::sort(measured_, {}, [&](const PendingMeasurement* pending) {
    return std::pair(id(pending), pending);
  });
  const auto same = [&](const PendingMeasurement* a, const PendingMeasurement* b) {
    return id(a) == id(b);
  };
  measured_.erase(std::unique(measured_.begin(), measured_.end(), same), measured_.end());
}

/// The median of the converged inverse distances among landmarks that were measured, where there
/// are enough; else the prior's.
double LandmarkMap::PriorInverseDistance(const State& state) {
  constexpr double kConverged = 0.1;  // of the index of linearity, where nothing is converted
  const double limit =
      options_.max_linearity_index > 0.0 ? options_.max_linearity_index : kConverged;
  distances_.clear();
  for (const PendingMeasurement* const pending : measured_) {
    const double* const camera = CameraOf(state, *pending);
    const LandmarkRecord& landmark = landmarks_.at(pending->measurement->landmark);
    if (camera == nullptr || !landmark.representation) continue;
    if (HasInverseDistance(landmark) && !(LinearityIndexOf(state, landmark, camera) < limit))
      continue;
    const auto point = PointOf(*landmark.representation, ValuesOf(state, landmark).data());
    const Eigen::Map<const Eigen::Vector3d> r(camera);
    if (point) distances_.push_back(1.0 / (point->position - r).norm());
  }
  if (distances_.empty() || std::ssize(distances_) < options_.prior->adapt_after) {
    return options_.prior->inverse_distance;
  }
  const auto middle = distances_.begin() + std::ssize(distances_) / 2;
  std::ranges::nth_element(distances_, middle);
  return *middle;
}

/// Gives the landmark its blocks, correlated with those that the observation took. Of a shared role
/// the first landmark of the frame makes the block, and the others of the same sensor take it.
Outcome LandmarkMap::Initialise(FilterState& f, std::int64_t id, PendingMeasurement& pending,
                                LandmarkRecord& landmark) {
  Family& family = families_[static_cast<std::size_t>(pending.sensor)];
  InverseMeasurement& inverse = family.inverse;
  const Outcome outcome = Invert(f, pending, options_.prior ? &prior_ : nullptr, inverse);
  if (outcome != Outcome::kAccepted) return outcome;
  auto& [fresh, values, rows] = fresh_;
  fresh.clear();
  values.clear();
  rows.clear();
  const double* y = inverse.y.data();
  int at = 0;
  for (std::size_t i = 0; i < family.roles.size(); ++i) {
    const Space& role = family.roles[i];
    if (family.shared[i] >= 0) {
      landmark.blocks.push_back(family.shared[i]);
    } else {
      fresh.push_back(Declare(f, id, role, BlockStatus::kEstimated));
      landmark.blocks.push_back(fresh.back());
      values.insert(values.end(), y, y + role.geometry.ambient);
      for (int k = 0; k < role.geometry.tangent; ++k) rows.push_back(at + k);
      if (role.shared()) family.shared[i] = fresh.back();
    }
    if (role.shared()) {
      const auto block = static_cast<std::size_t>(landmark.blocks.back());
      users_.resize(std::max(users_.size(), block + 1));
      ++users_[block];
    }
    y += role.geometry.ambient;
    at += role.geometry.tangent;
  }
  const Workspace::Use use(f.work);
  const auto size = std::ssize(rows);
  Eigen::Map<RowMajor> by_x(f.work.Take(size * inverse.by_x.cols()).data(), size,
                            inverse.by_x.cols());
  Workspace::Matrix own = f.work.Take(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const int row_of_y = rows[static_cast<std::size_t>(i)];
    by_x.row(i) = inverse.by_x.row(row_of_y);
    for (Eigen::Index j = 0; j < size; ++j) {
      own(i, j) = inverse.own(row_of_y, rows[static_cast<std::size_t>(j)]);
    }
  }
  f.state.Initialise(fresh, values.data(), inverse.from, by_x, own);
  landmark.representation = family.representation;
  f.motions.EndInterval();
  return Outcome::kInitialised;
}

std::vector<LandmarkEstimate> LandmarkMap::Estimates(const State& state) const {
  std::vector<LandmarkEstimate> estimates;
  for (const auto& [id, landmark] : landmarks_) {
    if (landmark.in_state()) estimates.push_back(EstimateOf(state, id, landmark));
  }
  return estimates;
}

}  // namespace alidade::internal
