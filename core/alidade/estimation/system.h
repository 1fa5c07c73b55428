// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alidade/estimation/landmarks.h"
#include "alidade/estimation/models.h"
#include "alidade/estimation/robust_loss.h"
#include "alidade/state/eigen_alignment.h"
#include "alidade/state/state.h"

namespace alidade {

/// What an update does with the block in a role: correct it; let its uncertainty count but leave it
/// (Schmidt); take its value as exact (its Jacobian is zero).
enum class RoleMode { kEstimate, kConsider, kKnown };

/// Where a sensor's Jacobian is taken for the value of a role: the prediction, or the value the
/// measurement itself implies (Initialise of that role).
enum class JacobianAt { kPrediction, kMeasurement };

struct RoleBinding {
  BlockId block = -1;  ///< -1: an optional role left unbound
  RoleMode mode = RoleMode::kEstimate;
  JacobianAt jacobian_at = JacobianAt::kPrediction;
};

/// stream -> sensor model -> the blocks that fill its roles. The roles of a landmark, which come
/// last, have none.
struct SensorBinding {
  std::string name;
  std::string stream;
  SharedSensor model;
  std::vector<RoleBinding> roles;
  RobustLoss loss = {};  ///< on the Mahalanobis distance of the innovation
  /// The same sensor of landmarks that are xyz, where `model` is of another representation and
  /// landmarks may become xyz or start as such. Its other roles are those of `model`.
  SharedSensor xyz = {};
  /// How those of its matches are found that agree; none: each is gated on its own alone.
  std::optional<OnePointRansac> outlier_rejection = {};
};

/// Stream -> the control input of a motion model.
struct InputBinding {
  std::string stream;  ///< "" where the model takes none
  /// From this age on an input does not act any more.
  double timeout_s = std::numeric_limits<double>::infinity();
};

/// Motion model -> the blocks it moves, and what drives it.
struct MotionBinding {
  std::string name;
  SharedMotion model;
  std::vector<BlockId> blocks;
  InputBinding input = {};
};

/// How a block starts: a value with a covariance, or the first measurement of a sensor.
struct Prior {
  BlockId block = -1;
  std::vector<double> mean;
  Eigen::MatrixXd covariance;
  std::string from;  ///< a sensor's name, or "" where mean and covariance are given
};

/// The problem that every estimator is given: blocks, how they move, what measures them, how they
/// start.
struct System {
  StateLayout layout;
  std::vector<MotionBinding> motions;
  std::vector<SensorBinding> sensors;
  std::vector<Prior> priors;
  std::optional<double> initial_time_s;      ///< time of the priors; else the first frame's
  std::optional<LandmarkOptions> landmarks;  ///< there where a sensor measures landmarks

  /// The state before the first measurement, in the order of the layout: all blocks with a given
  /// prior are present. `reserved`: those that start from a measurement have their places.
  State InitialState(bool reserved = false) const;
  /// -1 where there is none.
  int FindSensor(std::string_view name) const;
};

namespace internal {

/// The block of a position that landmarks are seen from; -1: there is none.
BlockId PositionBlockOf(const System& system);

/// The unit of a block, or else of a sensor's role that it fills.
std::string UnitOf(const System& system, BlockId id);

}  // namespace internal

/// Directions of the initial state near the prior that no sensor can see, whatever the input,
/// from the rank of [H0; H1 F0; H2 F1 F0; ...] under changing ones [Hermann1977]: the block
/// elements each moves. With landmarks, `scale` is that of trajectory and map; exact priors are
/// seen.
std::vector<std::vector<std::string>> UnobservableDirections(const System& system);

}  // namespace alidade
