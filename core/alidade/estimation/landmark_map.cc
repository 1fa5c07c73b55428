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

/// Candidates are deleted after this number of frames without an observation.
constexpr int kMaxCandidateFrames = 30;

/// Returns the role of a landmark with the representation xyz, in m.
Space Xyz() {
  return {"landmark", "m", "", {"x", "y", "z"}, Geometry::Vector(3), ALIDADE_ROLE_LANDMARK};
}

bool IsUsed(const PendingMeasurement& pending) {
  return pending.report->outcome == Outcome::kAccepted;
}

/// Returns pointers to the values of the blocks of a landmark. The landmark must have a
/// representation.
std::array<const double*, 3> ValuesOf(const State& state, const LandmarkRecord& landmark) {
  std::array<const double*, 3> values{};
  const auto value = [&](BlockId id) { return state.value(id); };
  std::ranges::transform(landmark.blocks, values.begin(), value);
  return values;
}

bool HasInverseDistance(const LandmarkRecord& landmark) {
  return landmark.in_state() && landmark.representation && !IsXyz(*landmark.representation);
}

/// Returns the inverse distance. It is the last element of each representation that has an inverse
/// distance.
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

/// Returns J P J', the covariance of the position of a landmark. The columns of J belong to the
/// blocks of the landmark.
Eigen::Matrix3d CovarianceOf(const State& state, const LandmarkRecord& landmark,
                             const LandmarkPoint& point) {
  constexpr int kMaxRows = 6;
  std::array<int, kMaxRows> rows;  // rows of P
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

/// Returns the estimate of a landmark in the state.
LandmarkEstimate EstimateOf(const State& state, std::int64_t id, const LandmarkRecord& landmark) {
  LandmarkEstimate estimate;
  estimate.id = id;
  estimate.generation = landmark.generation;
  estimate.representation = landmark.representation;
  estimate.first = landmark.first;
  estimate.last = landmark.last;
  estimate.tried = landmark.tried;
  estimate.accepted = landmark.accepted;
  if (HasInverseDistance(landmark)) {
    estimate.inverse_distance = InverseDistance(state, landmark);
    estimate.sigma = InverseDistanceSigma(state, landmark);
  }
  if (!landmark.representation) {
    for (const BlockId block_id : landmark.blocks) {
      const Block& block = state.layout()[block_id];
      if (block.space.name != "landmark_position" || block.geometry().tangent != 3) continue;
      estimate.position = Eigen::Map<const Eigen::Vector3d>(state.value(block_id));
      estimate.covariance = state.covariance()
                                .lower()
                                .block<3, 3>(block.tangent_offset, block.tangent_offset)
                                .selfadjointView<Eigen::Lower>();
    }
    return estimate;
  }
  const auto point = PointOf(*landmark.representation, ValuesOf(state, landmark).data());
  if (!point) return estimate;
  estimate.position = point->position;
  estimate.covariance = CovarianceOf(state, landmark, *point);
  return estimate;
}

}  // namespace

int LandmarkIdReuse::CountOf(std::int64_t id) const {
  const auto found = std::ranges::lower_bound(deletions_, id, {}, &Deletion::id);
  return found == deletions_.end() || found->id != id ? 0 : found->count;
}

void LandmarkIdReuse::Record(std::int64_t id, int count) {
  constexpr std::int64_t kMaxSize = 100'000;
  auto found = std::ranges::lower_bound(deletions_, id, {}, &Deletion::id);
  if (found == deletions_.end() || found->id != id) found = deletions_.insert(found, Deletion{});
  *found = {id, ++total_, count};
  if (std::ssize(deletions_) <= kMaxSize) return;
  std::erase_if(deletions_,
                [&](const Deletion& deletion) { return deletion.order <= total_ - kMaxSize / 2; });
}

LandmarkMap::LandmarkMap(const ProblemIndex& index)
    : options_(*index.problem.landmarks), xyz_(Xyz()) {
  for (const SensorBinding& sensor : index.problem.sensors) {
    LandmarkSensorInfo& info = sensor_infos_.emplace_back();
    const std::vector<Space>& roles = sensor.model->roles();
    info.representation = RepresentationOf(roles);
    for (std::size_t i = 0; i < roles.size(); ++i) {
      if (roles[i].name == "position") info.position = static_cast<int>(i);
      ALIDADE_EXPECTS(roles[i].landmark() || info.first < 0);
      if (!roles[i].landmark()) continue;
      if (info.first < 0) info.first = static_cast<int>(i);
      info.roles.push_back(roles[i]);
    }
    ALIDADE_EXPECTS(info.first < 0 || sensor.model->inverse().prior_size == 0 ||
                    (options_.prior && std::isfinite(options_.prior->inverse_distance) &&
                     options_.prior->sigma >= 0.0));
    ALIDADE_EXPECTS(info.first < 0 || sensor.model->inverse().prior_size <= 1);
    ALIDADE_EXPECTS(info.first < 0 || info.representation == XyzRepresentation() || sensor.xyz ||
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
  name_ += std::to_string(block_name_counter_++);
  return f.state.Declare(name_, "landmarks", role, status);
}

void LandmarkMap::AddKnown(FilterState& f) {
  for (const KnownLandmark& known : options_.known) {
    LandmarkRecord& landmark = landmarks_[known.id];
    landmark.representation = XyzRepresentation();
    landmark.is_known = true;
    landmark.blocks = {Declare(
        f, known.id, xyz_, known.sigma > 0.0 ? BlockStatus::kEstimated : BlockStatus::kConstant)};
    f.state.Add(landmark.blocks[0], known.position.data(),
                known.sigma * known.sigma * Eigen::Matrix3d::Identity());
  }
}

const double* LandmarkMap::CameraOf(const State& state, const PendingMeasurement& pending) const {
  const int position = SensorInfoOf(pending).position;
  if (position < 0) return nullptr;
  const BlockId id = pending.binding->roles[static_cast<std::size_t>(position)].block;
  return id < 0 ? nullptr : state.value(id);
}

[[gnu::noinline]] void LandmarkMap::Attach(FilterState& f, std::span<PendingMeasurement> rows) {
  bool has_landmarks = false;
  for (PendingMeasurement& pending : rows) {
    if (!IsOfLandmark(pending)) continue;
    has_landmarks = true;
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
  if (has_landmarks) ++frame_;
}

/// Sets the last roles of the measurement to the blocks of the landmark.
void LandmarkMap::Attach(const FilterState& f, PendingMeasurement& pending,
                         const LandmarkRecord& landmark) {
  const LandmarkSensorInfo& info = SensorInfoOf(pending);
  pending.landmark_place = *pending.place;
  pending.landmark_place.PutLandmark(static_cast<std::size_t>(info.first), f.state.layout(),
                                     landmark.blocks);
  pending.Bind(pending.landmark_place);
  if (landmark.representation != info.representation) pending.model = pending.binding->xyz.get();
}

[[gnu::noinline]] void LandmarkMap::Maintain(FilterState& f, std::span<PendingMeasurement> rows) {
  Count(f, rows);
  CheckDepths(f);
  Prune(f);
  Convert(f, rows);
  InitialiseNew(f, rows);
}

/// Counts the observations, the tried measurements and the accepted measurements of each landmark.
void LandmarkMap::Count(FilterState& f, std::span<PendingMeasurement> rows) {
  for (const PendingMeasurement& pending : rows) {
    if (!IsOfLandmark(pending) ||
        (!pending.is_on_landmark() && pending.report->outcome != Outcome::kNotReady))
      continue;
    if (!IsReady(f, pending)) continue;
    LandmarkRecord& landmark = RecordOf(pending.measurement->landmark);
    if (landmark.first == kNoTimestamp) landmark.first = f.timestamp;
    if (landmark.observations == 0 || landmark.last_frame != frame_) ++landmark.observations;
    landmark.last_frame = frame_;
    landmark.last = f.timestamp;
    if (!pending.is_on_landmark()) continue;
    ++landmark.tried;
    landmark.accepted += IsUsed(pending);
  }
}

/// Returns the record of a landmark. Creates the record if it does not exist. A new record reuses
/// the memory of a deleted record.
LandmarkRecord& LandmarkMap::RecordOf(std::int64_t id) {
  const auto entry = landmarks_.lower_bound(id);
  if (entry != landmarks_.end() && entry->first == id) return entry->second;
  if (recycled_nodes_.empty()) {
    LandmarkRecord& landmark = landmarks_.try_emplace(entry, id)->second;
    landmark.generation = id_reuse_.CountOf(id);
    return landmark;
  }
  ById::node_type node = std::move(recycled_nodes_.back());
  recycled_nodes_.pop_back();
  LandmarkRecord landmark;
  landmark.blocks.swap(node.mapped().blocks);
  landmark.generation = id_reuse_.CountOf(id);
  node.key() = id;
  node.mapped() = std::move(landmark);
  return landmarks_.insert(entry, std::move(node))->second;
}

/// Counts landmarks whose inverse distance is at or below zero after an update. With
/// `negative_depth: delete`, also deletes these landmarks.
void LandmarkMap::CheckDepths(FilterState& f) {
  DeleteIf(f, [&](LandmarkRecord& landmark) {
    return IsNegative(f, landmark) &&
           options_.negative_depth == LandmarkOptions::NegativeDepth::kDelete;
  });
}

/// Returns whether the inverse distance of a landmark is at or below zero. Counts the landmark if
/// the inverse distance was above zero before.
bool LandmarkMap::IsNegative(FilterState& f, LandmarkRecord& landmark) {
  const bool is_negative =
      HasInverseDistance(landmark) && !(InverseDistance(f.state, landmark) > 0.0);
  f.report.landmarks.negative += is_negative && !landmark.is_negative;
  landmark.is_negative = is_negative;
  return is_negative;
}

/// Deletes landmarks that were not observed for too many frames or have a low match ratio. Known
/// landmarks are never deleted.
void LandmarkMap::Prune(FilterState& f) {
  DeleteIf(f, [&](const LandmarkRecord& landmark) {
    return !landmark.is_known && (frame_ >= PruneFrameOf(landmark) || HasLowMatchRatio(landmark));
  });
}

/// Returns whether too few measurements of a landmark were accepted.
bool LandmarkMap::HasLowMatchRatio(const LandmarkRecord& landmark) const {
  return landmark.tried >= options_.min_attempts &&
         landmark.accepted < options_.min_match_ratio * landmark.tried;
}

/// Returns the number of the frame in which a landmark will be deleted, unless an earlier frame
/// measures the landmark.
std::int64_t LandmarkMap::PruneFrameOf(const LandmarkRecord& landmark) const {
  const int max_frames = landmark.in_state() ? options_.max_missed_frames : kMaxCandidateFrames;
  return max_frames > 0 ? landmark.last_frame + max_frames
                        : std::numeric_limits<std::int64_t>::max();
}

template <class Condition>
void LandmarkMap::DeleteIf(FilterState& f, const Condition& condition) {
  for (auto entry = landmarks_.begin(); entry != landmarks_.end();) {
    entry = condition(entry->second) ? Delete(f, entry) : std::next(entry);
  }
}

LandmarkMap::ById::iterator LandmarkMap::Delete(FilterState& f, ById::iterator entry) {
  if (entry->second.in_state()) {
    RecordRemoval(f, entry->first, entry->second);
    DropBlocks(f, entry->second);
    ++f.report.landmarks.deleted;
    id_reuse_.Record(entry->first, entry->second.generation + 1);
  }
  const auto next = std::next(entry);
  recycled_nodes_.push_back(landmarks_.extract(entry));
  return next;
}

/// Appends the last estimate of a landmark to the report. The landmark is still in the state.
void LandmarkMap::RecordRemoval(FilterState& f, std::int64_t id, const LandmarkRecord& landmark) {
  f.report.removed_landmarks.push_back(EstimateOf(f.state, id, landmark));
  f.report.removed_landmarks.back().removed = f.timestamp;
}

/// Removes the blocks of a landmark from the state. A shared block is removed with the last
/// landmark that shares it.
void LandmarkMap::DropBlocks(FilterState& f, LandmarkRecord& landmark) {
  for (const BlockId id : landmark.blocks) {
    const auto index = static_cast<std::size_t>(id);
    const bool shared = index < shared_block_refcount_.size() && shared_block_refcount_[index] > 0;
    if (shared && --shared_block_refcount_[index] > 0) continue;
    f.state.Remove(id);
  }
  landmark.blocks.clear();
}

/// Converts a landmark to xyz if the frame measures it and its linearity index is below the limit.
void LandmarkMap::Convert(FilterState& f, std::span<PendingMeasurement> rows) {
  if (!(options_.max_linearity_index > 0.0)) return;
  for (const PendingMeasurement& pending : rows) {
    if (!pending.is_on_landmark() || pending.model != pending.binding->model.get() ||
        !IsUsed(pending))
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
  const BlockId xyz = Declare(f, id, xyz_, BlockStatus::kEstimated);
  const Eigen::Matrix3d no_noise = Eigen::Matrix3d::Zero();
  f.state.Initialise({&xyz, 1}, point->position.data(), landmark.blocks, point->jacobian, no_noise);
  DropBlocks(f, landmark);
  landmark.blocks = {xyz};
  landmark.representation = XyzRepresentation();
  return true;
}

/// Initialises candidates that the frame measures. Stops when the frame measures max_per_frame
/// landmarks of the state.
void LandmarkMap::InitialiseNew(FilterState& f, std::span<PendingMeasurement> rows) {
  FindMeasured(rows);
  auto count = std::ssize(measured_);
  for (LandmarkSensorInfo& info : sensor_infos_) info.shared.assign(info.roles.size(), -1);
  if (options_.prior) prior_ = *options_.prior;
  bool is_prior_adapted = prior_.adapt_after == 0;
  Reserve(f, rows, options_.max_per_frame - count);
  for (PendingMeasurement& pending : rows) {
    if (count >= options_.max_per_frame) return;
    const auto found = FindCandidate(f, pending);
    if (found == landmarks_.end()) continue;
    if (!is_prior_adapted) prior_.inverse_distance = PriorInverseDistance(f.state);
    is_prior_adapted = true;
    pending.report->outcome = Initialise(f, found->first, pending, found->second);
    if (pending.report->outcome != Outcome::kInitialised) continue;
    ++f.report.landmarks.initialised;
    ++count;
  }
}

/// Returns the candidate that the measurement can initialise. If the measurement cannot initialise
/// a candidate, returns the end of the map.
LandmarkMap::ById::iterator LandmarkMap::FindCandidate(const FilterState& f,
                                                       const PendingMeasurement& pending) {
  if (!IsOfLandmark(pending) || pending.report->outcome != Outcome::kNotReady ||
      !IsReady(f, pending) ||
      pending.binding->model->inverse().role != SensorInfoOf(pending).first) {
    return landmarks_.end();
  }
  const bool uses_prior =
      pending.binding->model->inverse().prior_size > 0 && prior_.min_observations > 0;
  const int min_observations = uses_prior ? prior_.min_observations : options_.min_observations;
  const auto found = landmarks_.find(pending.measurement->landmark);
  const bool is_candidate = found != landmarks_.end() && !found->second.in_state() &&
                            found->second.observations >= min_observations;
  return is_candidate ? found : landmarks_.end();
}

/// Reserves memory for the landmarks that the frame may initialise, at most `max_count`. This saves
/// time in the first frame, which initialises many landmarks.
void LandmarkMap::Reserve(FilterState& f, std::span<const PendingMeasurement> rows,
                          std::ptrdiff_t max_count) {
  int size = 0;
  for (const PendingMeasurement& pending : rows) {
    if (max_count <= 0) break;
    if (FindCandidate(f, pending) == landmarks_.end()) continue;
    for (const Space& role : SensorInfoOf(pending).roles)
      size += role.shared() ? 0 : role.geometry.tangent;
    --max_count;
  }
  f.state.covariance().Reserve(size);
}

/// Sets measured_ to the first accepted measurement of each landmark in the state, sorted by id.
void LandmarkMap::FindMeasured(std::span<PendingMeasurement> rows) {
  measured_.clear();
  for (const PendingMeasurement& pending : rows) {
    if (!pending.is_on_landmark() || !IsUsed(pending)) continue;
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

/// Returns the median inverse distance of the measured landmarks that have converged. If fewer than
/// adapt_after have converged, returns the inverse distance of the prior.
double LandmarkMap::PriorInverseDistance(const State& state) {
  // Limit of the linearity index of a converged landmark, if landmarks are not converted to xyz.
  constexpr double kConverged = 0.1;
  const double limit =
      options_.max_linearity_index > 0.0 ? options_.max_linearity_index : kConverged;
  inverse_distances_.clear();
  for (const PendingMeasurement* const pending : measured_) {
    const double* const camera = CameraOf(state, *pending);
    const LandmarkRecord& landmark = landmarks_.at(pending->measurement->landmark);
    if (camera == nullptr || !landmark.representation) continue;
    if (HasInverseDistance(landmark) && !(LinearityIndexOf(state, landmark, camera) < limit))
      continue;
    const auto point = PointOf(*landmark.representation, ValuesOf(state, landmark).data());
    const Eigen::Map<const Eigen::Vector3d> r(camera);
    if (point) inverse_distances_.push_back(1.0 / (point->position - r).norm());
  }
  if (inverse_distances_.empty() || std::ssize(inverse_distances_) < options_.prior->adapt_after) {
    return options_.prior->inverse_distance;
  }
  const auto middle = inverse_distances_.begin() + std::ssize(inverse_distances_) / 2;
  std::ranges::nth_element(inverse_distances_, middle);
  return *middle;
}

/// Initialises the blocks of a landmark, and their correlation with the other blocks of the sensor.
/// The first landmark that a sensor initialises in a frame creates the block of a shared role. The
/// other landmarks of the sensor share this block.
Outcome LandmarkMap::Initialise(FilterState& f, std::int64_t id, PendingMeasurement& pending,
                                LandmarkRecord& landmark) {
  LandmarkSensorInfo& info = sensor_infos_[static_cast<std::size_t>(pending.sensor)];
  InverseMeasurement& inverse = info.inverse;
  const Outcome outcome = Invert(f, pending, options_.prior ? &prior_ : nullptr, inverse);
  if (outcome != Outcome::kAccepted) return outcome;
  auto& [blocks, values, rows] = new_blocks_;
  blocks.clear();
  values.clear();
  rows.clear();
  const double* y = inverse.y.data();
  int offset = 0;
  for (std::size_t i = 0; i < info.roles.size(); ++i) {
    const Space& role = info.roles[i];
    if (info.shared[i] >= 0) {
      landmark.blocks.push_back(info.shared[i]);
    } else {
      blocks.push_back(Declare(f, id, role, BlockStatus::kEstimated));
      landmark.blocks.push_back(blocks.back());
      values.insert(values.end(), y, y + role.geometry.ambient);
      for (int k = 0; k < role.geometry.tangent; ++k) rows.push_back(offset + k);
      if (role.shared()) info.shared[i] = blocks.back();
    }
    if (role.shared()) {
      const auto block = static_cast<std::size_t>(landmark.blocks.back());
      shared_block_refcount_.resize(std::max(shared_block_refcount_.size(), block + 1));
      ++shared_block_refcount_[block];
    }
    y += role.geometry.ambient;
    offset += role.geometry.tangent;
  }
  const Workspace::Use use(f.work);
  const auto size = std::ssize(rows);
  Eigen::Map<RowMajor> by_x(f.work.Take(size * inverse.by_x.cols()).data(), size,
                            inverse.by_x.cols());
  Workspace::Matrix noise = f.work.Take(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const int row_of_y = rows[static_cast<std::size_t>(i)];
    by_x.row(i) = inverse.by_x.row(row_of_y);
    for (Eigen::Index j = 0; j < size; ++j) {
      noise(i, j) = inverse.noise_covariance(row_of_y, rows[static_cast<std::size_t>(j)]);
    }
  }
  f.state.Initialise(blocks, values.data(), inverse.from, by_x, noise);
  landmark.representation = info.representation;
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
