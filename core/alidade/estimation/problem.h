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

/// Treatment of the block in a role by an update.
enum class RoleMode {
  kEstimate,  ///< corrected
  kConsider,  ///< not corrected, but its uncertainty counts (Schmidt)
  kKnown,     ///< its value counts as exact: its Jacobian is zero
};

/// Value of a role at which the Jacobian of a sensor is evaluated: the prediction, or the value
/// that the measurement implies (Initialise of that role).
enum class JacobianAt { kPrediction, kMeasurement };

/// Block that fills a role of a sensor. A block alone is estimated.
struct RoleBinding {
  RoleBinding() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): a block converts to a binding
  RoleBinding(BlockId id, RoleMode role_mode = RoleMode::kEstimate,
              JacobianAt jacobian_value = JacobianAt::kPrediction)
      : block(id), mode(role_mode), jacobian_at(jacobian_value) {}

  BlockId block = -1;  ///< -1: an optional role without a block
  RoleMode mode = RoleMode::kEstimate;
  JacobianAt jacobian_at = JacobianAt::kPrediction;
};

/// Sensor of a problem: its stream, its model, and the blocks that fill the roles of the model. The
/// roles of a landmark come last and have no block.
struct SensorBinding {
  std::string name;
  std::string stream;
  SharedSensor model;
  std::vector<RoleBinding> roles;
  RobustLoss loss = {};  ///< on the Mahalanobis distance of the innovation
  /// Model of the same sensor for landmarks with the representation xyz. Set if `model` has another
  /// representation and landmarks are converted to xyz or start as xyz. Its other roles equal those
  /// of `model`.
  SharedSensor xyz = {};
  /// Outlier rejection among the matches of a frame; nullopt: only the gate.
  std::optional<OnePointRansac> outlier_rejection = {};
};

/// Control input of a motion model.
struct InputBinding {
  std::string stream;  ///< "" if the model has no control input
  /// Age from which on an input no longer acts.
  double timeout_s = std::numeric_limits<double>::infinity();
};

/// Motion model of a problem: the blocks that it moves, and its control input.
struct MotionBinding {
  std::string name;
  SharedMotion model;
  std::vector<BlockId> blocks;
  InputBinding input = {};
};

/// Prior of a block: a value with a covariance, or the first measurement of a sensor.
struct Prior {
  BlockId block = -1;
  std::vector<double> mean;
  Eigen::MatrixXd covariance;
  std::string sensor;  ///< the sensor that initialises the block; "": mean and covariance do
};

/// Initial value of a block of a state: a mean with standard deviations, or the first measurement
/// of a sensor.
struct InitialValue {
  /// `sigma` has one standard deviation for all elements of the tangent space, or one for each.
  InitialValue(std::string block, std::vector<double> mean, std::vector<double> sigma,
               BlockStatus status = BlockStatus::kEstimated);
  InitialValue(std::string block, std::vector<double> mean, double sigma,
               BlockStatus status = BlockStatus::kEstimated);
  InitialValue(std::string block, double mean, double sigma,
               BlockStatus status = BlockStatus::kEstimated);
  /// Returns an initial value with a covariance instead of standard deviations.
  static InitialValue WithCovariance(std::string block, std::vector<double> mean,
                                     Eigen::MatrixXd covariance,
                                     BlockStatus status = BlockStatus::kEstimated);
  /// Returns an initial value that is known exactly.
  static InitialValue Constant(std::string block, std::vector<double> value);
  /// Returns an initial value that the first measurement of `sensor` determines. The sensor needs
  /// an inverse measurement model of the block; otherwise the constructor of a filter throws an
  /// Error.
  static InitialValue FromMeasurement(std::string block, std::string sensor);

  std::string block;  ///< name of the block in the model
  std::string name;   ///< name of the block in the problem; empty: the same
  std::vector<double> mean, sigma;
  Eigen::MatrixXd covariance;  ///< empty: `sigma` counts
  BlockStatus status = BlockStatus::kEstimated;
  std::string sensor;  ///< empty: mean and sigma count
};

/// Model parameter state of a sensor, such as a bias: its initial value and process.
struct OwnedState {
  /// Converts the prior and dynamics that the model of a sensor provides for one of its roles.
  static OwnedState Of(const OwnedRole& owned);

  InitialValue initial;
  /// Only the dynamics, density and time constant are used. A Gauss-Markov process returns to the
  /// mean of `initial`.
  OwnedRole process;
};

/// State of a problem: the ids of its blocks by name.
struct StateHandle {
  /// Returns the id of a block. Error kBadConfig for an unknown name.
  BlockId operator[](std::string_view block) const;

  std::string name;
  std::map<std::string, BlockId, std::less<>> blocks;
  int input = -1;  ///< the stream of its control input; -1: no control input
};

/// Sensor of a problem.
struct SensorHandle {
  int index = -1;   ///< into Problem::sensors
  int stream = -1;  ///< into Problem::streams
};

/// Options of a sensor besides its model and roles.
struct SensorOptions {
  std::string stream = {};  ///< empty: the stream with the name of the sensor
  RobustLoss loss = {};
  SharedSensor xyz = {};  ///< as in SensorBinding
  std::optional<OnePointRansac> outlier_rejection = {};
  /// Model parameter states by role, which replace the prior and dynamics of the model.
  std::map<std::size_t, OwnedState> owned = {};
};

/// Estimation problem, the input of every estimator: blocks with their motion models, sensors and
/// priors. AddState and AddSensor check their arguments; if one is invalid they throw Error
/// kBadConfig with the reason, and the problem is unchanged.
struct Problem {
  /// Adds a state with the blocks of the model and their initial values. A block with the flag
  /// ALIDADE_ROLE_OWNED and without an initial value is constant at the neutral element. `input` is
  /// for a model with a control input; its default stream is NAME.INPUT.
  StateHandle AddState(const std::string& name, SharedMotion model,
                       const std::vector<InitialValue>& initial, const InputBinding& input = {});
  template <MotionStruct Model>
  StateHandle AddState(const std::string& name, Model model,
                       const std::vector<InitialValue>& initial, const InputBinding& input = {}) {
    return AddState(name, MakeMotion(std::move(model), name), initial, input);
  }
  /// Adds a sensor. `roles` are the blocks of its roles, in their order, without the roles of a
  /// landmark, which each measurement names. Optional roles at the end may be omitted.
  SensorHandle AddSensor(const std::string& name, SharedSensor model,
                         std::vector<RoleBinding> roles, const SensorOptions& options = {});
  template <SensorStruct Model>
  SensorHandle AddSensor(const std::string& name, Model model, std::vector<RoleBinding> roles,
                         const SensorOptions& options = {}) {
    return AddSensor(name, MakeSensor(std::move(model), name), std::move(roles), options);
  }

  /// Returns the state before the first measurement, in the order of the layout. All blocks with a
  /// mean are present. `reserved`: blocks that start from a measurement have offsets too.
  State InitialState(bool reserved = false) const;
  /// Returns the index of a sensor, or -1 for an unknown name.
  int FindSensor(std::string_view name) const;

  StateLayout layout;
  std::vector<MotionBinding> motions;
  std::vector<SensorBinding> sensors;
  std::vector<Prior> priors;
  std::vector<StreamInfo> streams;           ///< all streams, in the order of Measurement::stream
  std::optional<double> initial_time_s;      ///< time of the priors; nullopt: the first frame's
  std::optional<LandmarkOptions> landmarks;  ///< set if a sensor measures landmarks
};

namespace internal {

/// Returns the block of the position from which landmarks are observed, or -1.
BlockId PositionBlockOf(const Problem& problem);

/// Adds the state SENSOR.ROLE of a sensor, with its process. Error kBadConfig for an invalid
/// initial value.
BlockId AddOwnedState(Problem& problem, const std::string& sensor, const Space& role,
                      OwnedState state);

/// Returns the unit of a block, or else of the sensor role that it fills.
std::string UnitOf(const Problem& problem, BlockId id);

}  // namespace internal

/// Returns the directions of the initial state near the prior that are unobservable for any control
/// input. Each direction is the list of the block elements that it changes. They follow from the
/// rank of [H0; H1 F0; H2 F1 F0; ...] with changing inputs [Hermann1977]. With landmarks, `scale`
/// is the scale of trajectory and map. Blocks with an exact prior count as observed.
std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem);

}  // namespace alidade
