// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "alidade/estimation/frame.h"
#include "alidade/estimation/problem.h"
#include "alidade/state/state.h"

namespace alidade::internal {

/// The values that fill the roles of a sensor.
using Roles = std::array<const double*, kMaxRoles>;

/// A sensor and how it touches the state, by places in x and P. The roles of a landmark, which come
/// last, have theirs where a measurement names it.
struct SensorPlace {
  int sensor = -1;  ///< index into Problem::sensors
  const SensorBinding* binding = nullptr;
  std::vector<int> values;          ///< by role: of its value in x; -1: it has none
  std::vector<char> known;          ///< by role: at its value in the filter, wherever h is taken
  std::vector<int> columns;         ///< by role: in a row of H; -1: no Jacobian
  std::vector<int> strides;         ///< for the model: `width` for each role
  std::vector<JacobianPart> parts;  ///< of a row of H
  std::vector<int> rows;            ///< of P, by column of H
  std::vector<bool> consider;       ///< of the parts
  bool considers = false;           ///< any of them
  bool elsewhere = false;           ///< one is linearised at what the measurement implies
  bool has_landmark = false;
  int width = 0;             ///< of a row of H
  int ambient = 0, dof = 0;  ///< of the measurement
  int known_size = 0;        ///< of what comes with it

  /// Gives its last roles, from `first` on, the places of the blocks of a landmark.
  void PutLandmark(std::size_t first, const StateLayout& layout,
                   const std::vector<BlockId>& blocks);
};

/// How a motion model moves the state, by places in x and P.
struct MotionPlace {
  /// Values that lie together in x.
  struct Values {
    int at, size;
    const Geometry* geometry;  ///< that they are brought back to; null: vectors
  };
  std::vector<int> values;    ///< by block: in x
  std::vector<Values> all;    ///< of its blocks
  std::vector<Values> moved;  ///< of those that are not constant
  std::vector<int> at;        ///< in P, of each row of F; -1: not in P
  std::vector<int> rows;      ///< those that are in P
  std::vector<int> present;   ///< of F, by element of `rows`
  bool holds = false;         ///< its noise is discrete
};

/// A problem on its layout: which stream each sensor reads, and where its blocks and those of the
/// motion models lie. Blocks of the problem have their places from the start, also before they have
/// a value, and never move; landmarks lie behind them.
struct ProblemIndex {
  /// `streams` are the source's, in the order of Measurement::stream. ContractViolation where a
  /// sensor's stream has another size than it measures.
  ProblemIndex(Problem problem, const std::vector<StreamInfo>& streams);

  const Problem problem;
  const std::vector<StreamInfo> streams;
  const State initial;  ///< with a place for every block that has a prior
  std::vector<SensorPlace> sensor_places;
  std::vector<MotionPlace> motion_places;
  std::vector<int> stream_of_sensor;  ///< -1: the source has none of that name
  bool considers = false;             ///< whether a sensor considers any of its roles
};

}  // namespace alidade::internal
