// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "alidade/estimation/delayed_initialisation.h"
#include "alidade/estimation/landmarks.h"

namespace alidade::internal {

/// Counter of the deleted landmarks of each id. The counts cover at least the last 50 000
/// deletions. The count of an id whose last deletion is older may be discarded.
class LandmarkIdReuse {
 public:
  /// Returns the number of deleted landmarks with this id.
  int CountOf(std::int64_t id) const;
  /// Records that a landmark with this id was deleted. `count` is the new number of deleted
  /// landmarks with the id.
  void Record(std::int64_t id, int count);

 private:
  struct Deletion {
    std::int64_t id;
    std::int64_t order;  ///< index of the last deletion with this id
    int count;
  };
  std::vector<Deletion> deletions_;  ///< sorted by id
  std::int64_t total_ = 0;
};

/// Landmark in the state, or a candidate: a landmark that waits for its initialisation.
struct LandmarkRecord {
  std::optional<LandmarkRepresentation> representation;
  std::vector<BlockId> blocks;  ///< by landmark role; empty for a candidate
  int generation = 0, observations = 0, tried = 0, accepted = 0;
  std::int64_t last_frame = 0;  ///< last frame that measured the landmark
  Timestamp first = kNoTimestamp, last = kNoTimestamp;
  bool is_negative = false;  ///< whether the inverse distance is at or below zero
  bool is_known = false;     ///< whether the landmark is known before the run; never pruned
  bool in_state() const { return !blocks.empty(); }
};

/// Landmarks of a filter. Finds the landmark of each measurement of a frame. After the updates of
/// the frame, initialises, converts and prunes landmarks. A copy is a snapshot.
class LandmarkMap {
 public:
  /// Requires that the problem of `index` has landmarks.
  explicit LandmarkMap(const ProblemIndex& index);

  /// Adds the known landmarks to the state. Must be called once, before the first frame.
  void AddKnown(FilterState& f);
  /// Binds the measurements whose landmark is in the state to the blocks of the landmark. The
  /// outcome of other measurements of landmarks becomes kNotReady, or kInvalid if the landmark id
  /// is negative.
  void Attach(FilterState& f, std::span<PendingMeasurement> rows);
  /// Counts, prunes, converts and initialises landmarks. Must be called after the updates of a
  /// frame.
  void Maintain(FilterState& f, std::span<PendingMeasurement> rows);

  std::vector<LandmarkEstimate> Estimates(const State& state) const;
  /// Returns the number of frames until now that contain a measurement of a landmark.
  std::int64_t frame() const { return frame_; }

 private:
  using ById = std::map<std::int64_t, LandmarkRecord>;
  /// Landmark roles of a sensor.
  struct LandmarkSensorInfo {
    /// Index of the first landmark role. The roles of a landmark come last. -1: the sensor does not
    /// measure landmarks.
    int first = -1;
    int position = -1;  ///< index of the role `position`: the camera position in the world
    std::optional<LandmarkRepresentation> representation;
    std::vector<Space> roles;             ///< roles of the landmark
    Scratch<InverseMeasurement> inverse;  ///< result of the last initialisation
    std::vector<BlockId> shared;          ///< by landmark role: block shared in this frame, or -1
  };

  bool IsOfLandmark(const PendingMeasurement& pending) const {
    return SensorInfoOf(pending).first >= 0;
  }
  void Attach(const FilterState& f, PendingMeasurement& pending, const LandmarkRecord& landmark);
  void Count(FilterState& f, std::span<PendingMeasurement> rows);
  void CheckDepths(FilterState& f);
  bool IsNegative(FilterState& f, LandmarkRecord& landmark);
  bool HasLowMatchRatio(const LandmarkRecord& landmark) const;
  std::int64_t PruneFrameOf(const LandmarkRecord& landmark) const;
  void Prune(FilterState& f);
  void Convert(FilterState& f, std::span<PendingMeasurement> rows);
  bool ConvertToXyz(FilterState& f, std::int64_t id, LandmarkRecord& landmark,
                    const PendingMeasurement& pending);
  void InitialiseNew(FilterState& f, std::span<PendingMeasurement> rows);
  ById::iterator FindCandidate(const FilterState& f, const PendingMeasurement& pending);
  void Reserve(FilterState& f, std::span<const PendingMeasurement> rows, std::ptrdiff_t max_count);
  void FindMeasured(std::span<PendingMeasurement> rows);
  double PriorInverseDistance(const State& state);
  Outcome Initialise(FilterState& f, std::int64_t id, PendingMeasurement& pending,
                     LandmarkRecord& landmark);
  LandmarkRecord& RecordOf(std::int64_t id);
  void RecordRemoval(FilterState& f, std::int64_t id, const LandmarkRecord& landmark);
  void DropBlocks(FilterState& f, LandmarkRecord& landmark);
  template <class Condition>
  void DeleteIf(FilterState& f, const Condition& condition);
  ById::iterator Delete(FilterState& f, ById::iterator entry);
  BlockId Declare(FilterState& f, std::int64_t id, const Space& role, BlockStatus status);
  const double* CameraOf(const State& state, const PendingMeasurement& pending) const;
  const LandmarkSensorInfo& SensorInfoOf(const PendingMeasurement& pending) const {
    return sensor_infos_[static_cast<std::size_t>(pending.sensor)];
  }

  LandmarkOptions options_;
  std::vector<LandmarkSensorInfo> sensor_infos_;  ///< by sensor
  ById landmarks_;                                ///< by landmark id
  std::vector<int> shared_block_refcount_;        ///< by block: number of landmarks that share it
  std::int64_t frame_ = 0;  ///< number of frames with a measurement of a landmark
  std::int64_t block_name_counter_ = 0;
  LandmarkIdReuse id_reuse_;
  LandmarkOptions::Prior prior_;  ///< prior of landmarks that this frame initialises

  Space xyz_;  ///< role of a landmark with the representation xyz

  // Reused memory.
  Scratch<std::vector<ById::node_type>> recycled_nodes_;  ///< records of deleted landmarks
  std::string name_;                                      ///< name of the declared block
  /// The first accepted measurement of each landmark in the state, sorted by landmark id.
  Scratch<std::vector<const PendingMeasurement*>> measured_;
  /// Blocks that a new landmark creates, without existing shared blocks.
  struct {
    std::vector<BlockId> blocks;
    std::vector<double> values;
    std::vector<int> rows;  ///< rows of the inverse measurement
  } new_blocks_;
  std::vector<double> inverse_distances_;  ///< inverse distances of converged landmarks
};

}  // namespace alidade::internal
