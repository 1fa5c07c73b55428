// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "alidade/estimation/frame.h"
#include "alidade/estimation/problem.h"
#include "alidade/state/state.h"

namespace alidade::internal {

/// Pointers to the values of the roles of a sensor.
using Roles = std::array<const double*, kMaxRoles>;

/// Offsets of the roles of a sensor in x, P and H. The roles of a landmark come last. The offsets
/// of these roles are set when a measurement names the landmark.
struct SensorPlace {
  int sensor = -1;  ///< index into Problem::sensors
  const SensorBinding* binding = nullptr;
  std::vector<int> values;          ///< by role: offset in x; -1: the role has no block
  std::vector<char> is_known;       ///< by role: whether its mode is RoleMode::kKnown
  std::vector<int> columns;         ///< by role: first column of its Jacobian in H; -1: none
  std::vector<int> strides;         ///< by role: row stride of its Jacobian, equal to `width`
  std::vector<JacobianPart> parts;  ///< parts of a row of H: one for each role with a Jacobian
  std::vector<int> rows;            ///< by column of H: row of P
  std::vector<bool> is_consider;    ///< by part: whether its role has RoleMode::kConsider
  bool has_consider = false;        ///< whether any part is a consider state
  bool linearises_at_measurement = false;  ///< whether a role has JacobianAt::kMeasurement
  bool has_landmark = false;
  int width = 0;             ///< number of columns of H
  int ambient = 0, dof = 0;  ///< ambient and tangent size of the measurement
  int known_size = 0;        ///< number of known numbers of a measurement

  /// Sets the offsets of role `first` and all later roles to the offsets of the blocks of a
  /// landmark.
  void PutLandmark(std::size_t first, const StateLayout& layout,
                   const std::vector<BlockId>& blocks);
};

/// Offsets of the blocks of a motion model in x and P.
struct MotionPlace {
  /// Range of adjacent values of x.
  struct ValueRange {
    int offset, size;
    const Geometry* geometry;  ///< manifold to which the values are normalised; null: a vector
  };
  std::vector<int> values;                      ///< by block: offset in x
  std::vector<ValueRange> block_ranges;         ///< ranges of all blocks
  std::vector<ValueRange> non_constant_ranges;  ///< ranges of the blocks that are not constant
  std::vector<int> at;                          ///< by row of F: row of P; -1: not in P
  std::vector<int> rows;                        ///< rows of P that belong to the blocks
  std::vector<int> present;                     ///< by element of `rows`: row of F
  bool holds = false;  ///< whether the noise is discrete (constant over an interval)
};

/// Problem whose names are resolved to indices: the stream of each sensor, and the offsets of the
/// blocks of sensors and motion models. Offsets are also reserved for blocks without a value, so
/// that the offsets never change. The blocks of landmarks come after all other blocks.
struct ProblemIndex {
  /// `source_streams` are the streams of the source, in the order of Measurement::stream.
  /// ContractViolation if the size of a stream differs from the size of its sensor's measurement.
  ProblemIndex(Problem indexed_problem, const std::vector<StreamInfo>& source_streams);

  const Problem problem;
  const std::vector<StreamInfo> streams;
  /// State before the first measurement, with space for all blocks that have a prior.
  const State initial;
  std::vector<SensorPlace> sensor_places;
  std::vector<MotionPlace> motion_places;
  std::vector<int> stream_of_sensor;  ///< by sensor: index of its stream; -1: not in the source
  bool has_consider = false;          ///< whether a role of a sensor is a consider state
};

}  // namespace alidade::internal
