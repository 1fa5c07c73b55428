// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "alidade/filter/ekf.h"
#include "alidade/system/landmarks.h"

namespace alidade {

/// What passes from frame to frame besides the blocks of the state.
struct LandmarkMap {
  struct Landmark {
    std::optional<LandmarkRepresentation> representation;
    std::vector<BlockId> blocks;  ///< by landmark role; empty: seen, but not in the state yet
    int generation = 0, observations = 0, tried = 0, accepted = 0;
    std::int64_t seen = 0;  ///< the last frame that measured it
    Timestamp first = kNoTimestamp, last = kNoTimestamp;
    bool negative = false;  ///< its inverse distance is
    bool known = false;     ///< from the config: never pruned
    bool in_state() const { return !blocks.empty(); }
  };
  std::map<std::int64_t, Landmark> landmarks;  ///< by the id of the measurements
  std::map<BlockId, int> users;                ///< of a shared block: landmarks on it
  std::int64_t frame = 0;                      ///< frames with a measurement of a landmark
  std::int64_t names = 0;                      ///< blocks named so far
  std::size_t ended = 0;                       ///< landmarks that were in the state and left it
};

/// How many landmarks of an id have ended, over the newest 100 000 ends. Goes back with the filter
/// without being copied into its snapshots.
class Generations {
 public:
  /// Landmarks that ended so far.
  std::size_t ends() const { return ends_; }
  int Of(std::int64_t id) const;
  void End(std::int64_t id, int generation);
  /// To when so many had ended.
  void GoBackTo(std::size_t ends);

 private:
  std::deque<std::pair<std::int64_t, int>> log_;  ///< id, its ended generations then
  std::map<std::int64_t, int> of_;
  std::size_t ends_ = 0;
};

/// The landmarks of a filter: finds them for the measurements of a frame, and initialises,
/// converts and prunes them after its update.
class Ekf::Landmarks {
 public:
  explicit Landmarks(Ekf& ekf);

  /// Whether the roles of a sensor are filled by the landmark that a measurement names.
  bool Has(int sensor) const { return families_[static_cast<std::size_t>(sensor)].first >= 0; }
  /// Puts the known landmarks into the state, once.
  void AddKnown();
  /// Gives the rows of landmarks in the state their plans; the others are not ready.
  void PlanRows();
  /// Makes the updates with rows that passed their gates, where a sensor asks for RANSAC; else
  /// false, and nothing done.
  bool FuseByConsensus(std::span<Row* const> passed);
  /// After the update with those rows.
  void Finish();

  const LandmarkMap& map() const { return map_; }
  void Restore(const LandmarkMap& map) {
    map_ = map;
    generations_.GoBackTo(map.ended);
  }
  std::vector<LandmarkEstimate> Estimates() const;

 private:
  using Landmark = LandmarkMap::Landmark;
  /// How a sensor sees landmarks.
  struct Family {
    int first = -1;     ///< of its landmark roles, which come last; -1: it sees none
    int position = -1;  ///< its role `position`, the camera's in the world
    std::optional<LandmarkRepresentation> representation;
    std::vector<Space> roles;               ///< the landmark's
    std::map<std::size_t, BlockId> shared;  ///< by landmark role: blocks of this frame
  };

  static bool Used(const MeasurementReport& entry) { return entry.outcome == Outcome::kAccepted; }
  void Plan(Row& row, const Landmark& landmark);
  void Count();
  void CheckDepths();
  void Prune();
  void Convert();
  void InitialiseNew();
  bool ConvertToXyz(std::int64_t id, Landmark& landmark, const Family& family);
  std::vector<char> Support(std::span<Row* const> matches);
  void SupportOf(std::size_t hypothesis, std::span<Row* const> matches, std::vector<char>& agrees);
  std::vector<const Row*> MeasuredOnce() const;
  Outcome Initialise(std::int64_t id, Row& row, Landmark& landmark);
  double PriorInverseDistance(std::span<const Row* const> measured) const;
  Eigen::Matrix3d CovarianceOf(const Landmark& landmark,
                               const Eigen::Matrix<double, 3, Eigen::Dynamic>& jacobian) const;
  void DropBlocks(Landmark& landmark);
  std::map<std::int64_t, Landmark>::iterator Delete(std::map<std::int64_t, Landmark>::iterator at);
  BlockId Declare(std::int64_t id, const Space& role, BlockStatus status);
  std::vector<const double*> ValuesOf(const Landmark& landmark) const;
  bool HasInverseDistance(const Landmark& landmark) const;
  double InverseDistance(const Landmark& landmark) const;
  double InverseDistanceSigma(const Landmark& landmark) const;
  const double* CameraOf(const Family& family) const;
  const Family& FamilyOf(const Row& row) const {
    return families_[static_cast<std::size_t>(row.sensor)];
  }
  LandmarkCounts& counts() { return ekf_.report_.landmarks; }

  Ekf& ekf_;
  const LandmarkOptions options_;
  std::vector<Family> families_;  ///< by sensor
  LandmarkMap map_;
  Generations generations_;
  std::deque<SensorPlan> plans_;  ///< of the frame's rows
  std::size_t used_ = 0;
  bool moved_ = false;                    ///< blocks came or went since the plans were made
  std::vector<double> support_, rescue_;  ///< bounds on r' R^-1 r and NIS, by sensor
  LandmarkOptions::Prior prior_;          ///< of what is initialised in this frame
};

}  // namespace alidade
