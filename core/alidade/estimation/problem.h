// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/frame.h"
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

/// What fills a role of a sensor; a block alone is estimated.
struct RoleBinding {
  RoleBinding() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): a block alone is a binding
  RoleBinding(BlockId id, RoleMode use = RoleMode::kEstimate,
              JacobianAt at = JacobianAt::kPrediction)
      : block(id), mode(use), jacobian_at(at) {}

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

/// How a block of a state starts: from a mean with standard deviations, or from the first
/// measurement of a sensor.
struct InitialValue {
  /// One standard deviation for all elements of the tangent, or one for each.
  InitialValue(std::string block, std::vector<double> mean, std::vector<double> sigma,
               BlockStatus status = BlockStatus::kEstimated);
  InitialValue(std::string block, std::vector<double> mean, double sigma,
               BlockStatus status = BlockStatus::kEstimated);
  InitialValue(std::string block, double mean, double sigma,
               BlockStatus status = BlockStatus::kEstimated);
  /// A covariance of the tangent in place of standard deviations.
  static InitialValue WithCovariance(std::string block, std::vector<double> mean,
                                     Eigen::MatrixXd covariance,
                                     BlockStatus status = BlockStatus::kEstimated);
  /// A value that is known exactly.
  static InitialValue Constant(std::string block, std::vector<double> value);
  /// `sensor` has to have an inverse measurement model of the block; a filter refuses what cannot
  /// start so.
  static InitialValue FromMeasurement(std::string block, std::string sensor);

  std::string block;  ///< as the model names it
  std::string name;   ///< of the block in the problem; empty: as the model names it
  std::vector<double> mean, sigma;
  Eigen::MatrixXd covariance;  ///< empty: sigma counts
  BlockStatus status = BlockStatus::kEstimated;
  std::string from;  ///< the sensor; empty: mean and sigma count
};

/// How a state that comes with its sensor, a bias say, starts and moves.
struct OwnedState {
  /// What the model of a sensor says of one of its roles.
  static OwnedState Of(const OwnedRole& owned);

  InitialValue initial;
  /// Its dynamics, density and time constant count. A Gauss-Markov process returns to the mean of
  /// `initial`.
  OwnedRole process;
};

/// A state of a problem: its blocks by their names there.
struct StateHandle {
  /// Error kBadConfig if there is no block of that name.
  BlockId operator[](std::string_view block) const;

  std::string name;
  std::map<std::string, BlockId, std::less<>> blocks;
  int input = -1;  ///< the stream of its control input; -1: it takes none
};

/// A sensor of a problem.
struct SensorHandle {
  int index = -1;   ///< into Problem::sensors
  int stream = -1;  ///< into Problem::streams
};

/// What a sensor has besides its model and roles.
struct SensorOptions {
  std::string stream = {};  ///< that it reads; empty: one of its own name
  RobustLoss loss = {};
  SharedSensor xyz = {};  ///< as in SensorBinding
  std::optional<OnePointRansac> outlier_rejection = {};
  /// By role: of states that come with the sensor, in place of what its model says.
  std::map<std::size_t, OwnedState> owned = {};
};

/// The problem that every estimator is given: blocks, how they move, what measures them, how they
/// start. Add* check what they add at once. Errors: kBadConfig, which says what does not fit.
struct Problem {
  /// A state whose blocks are those of the model, each with its initial value. A block with the
  /// flag ALIDADE_ROLE_OWNED that has none is constant at the neutral element. `input`: of a model
  /// that takes a control input; without a stream it reads NAME.INPUT.
  StateHandle AddState(const std::string& name, SharedMotion model,
                       const std::vector<InitialValue>& initial, const InputBinding& input = {});
  template <MotionStruct Model>
  StateHandle AddState(const std::string& name, Model model,
                       const std::vector<InitialValue>& initial, const InputBinding& input = {}) {
    return AddState(name, MakeMotion(std::move(model), name), initial, input);
  }
  /// A sensor with what fills its roles, in their order, but those of a landmark, which a
  /// measurement names. Roles at the end that are optional may be left out.
  SensorHandle AddSensor(const std::string& name, SharedSensor model,
                         std::vector<RoleBinding> roles, const SensorOptions& options = {});
  template <SensorStruct Model>
  SensorHandle AddSensor(const std::string& name, Model model, std::vector<RoleBinding> roles,
                         const SensorOptions& options = {}) {
    return AddSensor(name, MakeSensor(std::move(model), name), std::move(roles), options);
  }

  /// The state before the first measurement, in the order of the layout: all blocks with a given
  /// prior are present. `reserved`: those that start from a measurement have their places.
  State InitialState(bool reserved = false) const;
  /// -1: there is none.
  int FindSensor(std::string_view name) const;

  StateLayout layout;
  std::vector<MotionBinding> motions;
  std::vector<SensorBinding> sensors;
  std::vector<Prior> priors;
  std::vector<StreamInfo> streams;           ///< that it reads, each once, as frames number them
  std::optional<double> initial_time_s;      ///< time of the priors; else the first frame's
  std::optional<LandmarkOptions> landmarks;  ///< there if a sensor measures landmarks
};

namespace internal {

/// The block of a position that landmarks are seen from; -1: there is none.
BlockId PositionBlockOf(const Problem& problem);

/// Adds the state SENSOR.ROLE of a sensor, with its process. Error kBadConfig for an initial value
/// that does not fit.
BlockId AddOwnedState(Problem& problem, const std::string& sensor, const Space& role,
                      OwnedState state);

/// The unit of a block, or else of a sensor's role that it fills.
std::string UnitOf(const Problem& problem, BlockId id);

}  // namespace internal

/// Directions of the initial state near the prior that no sensor can see, whatever the input,
/// from the rank of [H0; H1 F0; H2 F1 F0; ...] under changing ones [Hermann1977]: the block
/// elements each moves. With landmarks, `scale` is that of trajectory and map; exact priors are
/// seen.
std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem);

}  // namespace alidade
