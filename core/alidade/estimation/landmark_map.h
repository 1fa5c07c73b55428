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

/// How many landmarks of an id have ended, over the newest 50 000 ends at least.
class LandmarkIdReuse {
 public:
  int Of(std::int64_t id) const;
  void End(std::int64_t id, int generation);

 private:
  struct Ended {
    std::int64_t id;
    std::int64_t order;  ///< of its last end
    int generation;
  };
  std::vector<Ended> ended_;  ///< by id
  std::int64_t ends_ = 0;
};

/// One landmark, in the state or waiting for it.
struct LandmarkRecord {
  std::optional<LandmarkRepresentation> representation;
  std::vector<BlockId> blocks;  ///< by landmark role; empty: seen, but not in the state yet
  int generation = 0, observations = 0, tried = 0, accepted = 0;
  std::int64_t seen = 0;  ///< the last frame that measured it
  Timestamp first = kNoTimestamp, last = kNoTimestamp;
  bool negative = false;  ///< its inverse distance is
  bool known = false;     ///< from the config: never pruned
  bool in_state() const { return !blocks.empty(); }
};

/// The landmarks of a filter: finds them for the measurements of a frame, and initialises, converts
/// and prunes them after its update. A copy is a snapshot.
class LandmarkMap {
 public:
  /// Of a problem that has landmarks.
  explicit LandmarkMap(const ProblemIndex& index);

  /// Puts the known landmarks into the state, once.
  void AddKnown(FilterState& f);
  /// Gives the rows of landmarks in the state their places; the others are not ready.
  void Attach(FilterState& f, std::span<PendingMeasurement> rows);
  /// After the updates with those rows.
  void Maintain(FilterState& f, std::span<PendingMeasurement> rows);

  std::vector<LandmarkEstimate> Estimates(const State& state) const;
  /// Frames with a measurement of a landmark.
  std::int64_t frame() const { return frame_; }

 private:
  using ById = std::map<std::int64_t, LandmarkRecord>;
  /// How a sensor sees landmarks.
  struct Family {
    int first = -1;     ///< of its landmark roles, which come last; -1: it sees none
    int position = -1;  ///< its role `position`, the camera's in the world
    std::optional<LandmarkRepresentation> representation;
    std::vector<Space> roles;             ///< the landmark's
    Scratch<InverseMeasurement> inverse;  ///< of the last measurement that it initialised by
    std::vector<BlockId> shared;          ///< by landmark role: the block of this frame, or -1
  };

  bool Has(const PendingMeasurement& pending) const { return FamilyOf(pending).first >= 0; }
  void Attach(const FilterState& f, PendingMeasurement& pending, const LandmarkRecord& landmark);
  void Count(FilterState& f, std::span<PendingMeasurement> rows);
  void CheckDepths(FilterState& f);
  bool IsNegative(FilterState& f, LandmarkRecord& landmark);
  bool Fails(const LandmarkRecord& landmark) const;
  std::int64_t DueOf(const LandmarkRecord& landmark) const;
  void Prune(FilterState& f);
  void Convert(FilterState& f, std::span<PendingMeasurement> rows);
  bool ConvertToXyz(FilterState& f, std::int64_t id, LandmarkRecord& landmark,
                    const PendingMeasurement& pending);
  void InitialiseNew(FilterState& f, std::span<PendingMeasurement> rows);
  ById::iterator FindWaiting(const FilterState& f, const PendingMeasurement& pending);
  void Reserve(FilterState& f, std::span<const PendingMeasurement> rows, std::ptrdiff_t most);
  void FindMeasured(std::span<PendingMeasurement> rows);
  double PriorInverseDistance(const State& state);
  Outcome Initialise(FilterState& f, std::int64_t id, PendingMeasurement& pending,
                     LandmarkRecord& landmark);
  LandmarkRecord& RecordOf(std::int64_t id);
  void NoteRemoval(FilterState& f, std::int64_t id, const LandmarkRecord& landmark);
  void DropBlocks(FilterState& f, LandmarkRecord& landmark);
  template <class Condition>
  void DeleteIf(FilterState& f, const Condition& condition);
  ById::iterator Delete(FilterState& f, ById::iterator at);
  BlockId Declare(FilterState& f, std::int64_t id, const Space& role, BlockStatus status);
  const double* CameraOf(const State& state, const PendingMeasurement& pending) const;
  const Family& FamilyOf(const PendingMeasurement& pending) const {
    return families_[static_cast<std::size_t>(pending.sensor)];
  }

  LandmarkOptions options_;
  std::vector<Family> families_;  ///< by sensor
  ById landmarks_;                ///< by the id of the measurements
  std::vector<int> users_;        ///< by block, where it is shared: landmarks on it
  std::int64_t frame_ = 0;        ///< frames with a measurement of a landmark
  std::int64_t names_ = 0;        ///< blocks named so far
  LandmarkIdReuse generations_;
  LandmarkOptions::Prior prior_;  ///< of what is initialised in this frame

  Space xyz_;  ///< the role of a landmark that is a point

  // Memory.
  Scratch<std::vector<ById::node_type>> spare_;  ///< records of landmarks that are gone
  std::string name_;                             ///< of the block that is declared
  Scratch<std::vector<const PendingMeasurement*>>
      measured_;  ///< a used row of each landmark in the state, by id
  struct {
    std::vector<BlockId> blocks;
    std::vector<double> values;
    std::vector<int> rows;         ///< of the inverse
  } fresh_;                        ///< the blocks of a landmark that are not shared with others
  std::vector<double> distances_;  ///< inverse, of those that have converged
};

}  // namespace alidade::internal
