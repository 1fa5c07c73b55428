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

/// Offsets of the roles of a sensor in x, P and H. The roles of a landmark come last, and have
/// offsets once a measurement names the landmark.
struct SensorPlace {
  int sensor = -1;  ///< index into Problem::sensors
  const SensorBinding* binding = nullptr;
  std::vector<int> values;          ///< by role: offset in x; -1: the role is not bound
  std::vector<char> known;          ///< by role: whether the sensor knows it (RoleMode::kKnown)
  std::vector<int> columns;         ///< by role: first column of its Jacobian in H; -1: none
  std::vector<int> strides;         ///< by role, for the model: `width`
  std::vector<JacobianPart> parts;  ///< of a row of H, one for each role with a Jacobian
  std::vector<int> rows;            ///< of P, by column of H
  std::vector<bool> consider;       ///< by part: whether it is considered
  bool considers = false;           ///< whether any part is considered
  bool elsewhere = false;           ///< whether a role is linearised at the measurement
  bool has_landmark = false;
  int width = 0;             ///< columns of H
  int ambient = 0, dof = 0;  ///< sizes of the measurement
  int known_size = 0;        ///< size of the known numbers that come with it

  /// Sets the offsets of the roles from `first` on to those of the blocks of a landmark.
  void PutLandmark(std::size_t first, const StateLayout& layout,
                   const std::vector<BlockId>& blocks);
};

/// Offsets of the blocks of a motion model in x and P.
struct MotionPlace {
  /// Adjacent values of x.
  struct Values {
    int at, size;
    const Geometry* geometry;  ///< manifold to normalise to; null: a vector
  };
  std::vector<int> values;    ///< by block: offset in x
  std::vector<Values> all;    ///< of all blocks
  std::vector<Values> moved;  ///< of the blocks that are not constant
  std::vector<int> at;        ///< by row of F: row of P; -1: not in P
  std::vector<int> rows;      ///< the rows of P
  std::vector<int> present;   ///< by element of `rows`: row of F
  bool holds = false;         ///< whether its noise is discrete
};

/// A problem with its names resolved to indices: the stream of each sensor, and the offsets of the
/// blocks of sensors and motion models. Offsets are fixed from the start, also of blocks that have
/// no value yet; landmarks come after them.
struct ProblemIndex {
  /// `streams` are those of the source, in the order of Measurement::stream. ContractViolation if
  /// the stream of a sensor has another size than its measurement.
  ProblemIndex(Problem problem, const std::vector<StreamInfo>& streams);

  const Problem problem;
  const std::vector<StreamInfo> streams;
  const State initial;  ///< with memory for every block that has a prior
  std::vector<SensorPlace> sensor_places;
  std::vector<MotionPlace> motion_places;
  std::vector<int> stream_of_sensor;  ///< -1: the source has no stream of that name
  bool considers = false;             ///< whether a sensor considers any of its roles
};

}  // namespace alidade::internal
