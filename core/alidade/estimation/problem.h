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

/// Mode of a role: the treatment of its block by an update.
enum class RoleMode {
  kEstimate,  ///< corrected
  kConsider,  ///< not corrected, but its uncertainty is included in S (Schmidt)
  kKnown,     ///< not corrected and treated as exact, so that its Jacobian is zero
};

/// Value of a role at which the Jacobian of a sensor is evaluated: the prediction, or the value
/// that the measurement implies (SensorModel::Initialise).
enum class JacobianAt { kPrediction, kMeasurement };

/// Block that fills a role of a sensor. By default, the block is estimated.
struct RoleBinding {
  RoleBinding() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): implicit conversion of a block to a binding
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
  RobustLoss loss = {};  ///< function of the Mahalanobis distance of the innovation
  /// Model of the same sensor for landmarks with the representation xyz. If `model` has another
  /// representation, `xyz` is required for landmarks that are converted to xyz or start as xyz. The
  /// roles before the landmark roles must equal those of `model`.
  SharedSensor xyz = {};
  /// Outlier rejection for the matches of a frame. nullopt: only the gate rejects measurements.
  std::optional<OnePointRansac> outlier_rejection = {};
};

/// Control input of a motion model.
struct InputBinding {
  std::string stream;  ///< "" if the model has no control input
  /// Age at which an input stops acting.
  double timeout_s = std::numeric_limits<double>::infinity();
};

/// Motion model of a problem, with its blocks and its control input.
struct MotionBinding {
  std::string name;
  SharedMotion model;
  std::vector<BlockId> blocks;
  InputBinding input = {};
};

/// Prior of a block: a mean with a covariance, or the first measurement of a sensor.
struct Prior {
  BlockId block = -1;
  std::vector<double> mean;
  Eigen::MatrixXd covariance;
  /// Sensor that initialises the block. "": the block starts from mean and covariance.
  std::string sensor;
};

/// Initial value of a block of a state: a mean with standard deviations, or the first measurement
/// of a sensor.
struct InitialValue {
  /// `sigma` contains one standard deviation for all tangent elements, or one for each element.
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
  /// Returns an initial value that the first measurement of `sensor` determines. The sensor must
  /// have an inverse measurement model for the block. Otherwise the constructor of a filter throws
  /// an Error.
  static InitialValue FromMeasurement(std::string block, std::string sensor);

  std::string block;  ///< name of the block in the model
  std::string name;   ///< name of the block in the problem; empty: equal to `block`
  std::vector<double> mean, sigma;
  Eigen::MatrixXd covariance;  ///< empty: `sigma` is used
  BlockStatus status = BlockStatus::kEstimated;
  /// Sensor that initialises the block. Empty: the block starts from `mean` and `sigma`.
  std::string sensor;
};

/// Initial value and process of a model parameter state of a sensor, such as a bias.
struct OwnedState {
  /// Converts the prior and dynamics that a sensor model defines for one of its roles.
  static OwnedState Of(const OwnedRole& owned);

  InitialValue initial;
  /// Process of the state. Only the dynamics, density and time constant are used. A Gauss-Markov
  /// process decays to the mean of `initial`.
  OwnedRole process;
};

/// State of a problem, with the ids of its blocks. Problem::AddState returns it.
struct StateHandle {
  /// Returns the id of a block. Throws Error kBadConfig if the name is unknown.
  BlockId operator[](std::string_view block) const;

  std::string name;
  std::map<std::string, BlockId, std::less<>> blocks;
  int input = -1;  ///< stream of the control input; -1: no control input
};

/// Sensor of a problem. Problem::AddSensor returns it.
struct SensorHandle {
  int index = -1;   ///< index into Problem::sensors
  int stream = -1;  ///< index into Problem::streams
};

/// Optional properties of a sensor.
struct SensorOptions {
  std::string stream = {};  ///< name of the stream; empty: equal to the name of the sensor
  RobustLoss loss = {};
  SharedSensor xyz = {};  ///< see SensorBinding::xyz
  std::optional<OnePointRansac> outlier_rejection = {};
  /// By role: model parameter state that replaces the prior and dynamics that the model defines.
  std::map<std::size_t, OwnedState> owned = {};
};

/// Estimation problem, the input of every estimator: blocks with their priors, motion models, and
/// sensors. AddState and AddSensor check their arguments. If an argument is invalid, they throw
/// Error kBadConfig with the reason and leave the problem unchanged.
struct Problem {
  /// Adds a state with the blocks of the model and their initial values. A block with the flag
  /// ALIDADE_ROLE_OWNED and without an initial value is constant at the neutral element. `input`
  /// describes the control input, if the model has one. Its default stream is NAME.INPUT.
  StateHandle AddState(const std::string& name, SharedMotion model,
                       const std::vector<InitialValue>& initial, const InputBinding& input = {});
  template <MotionStruct Model>
  StateHandle AddState(const std::string& name, Model model,
                       const std::vector<InitialValue>& initial, const InputBinding& input = {}) {
    return AddState(name, MakeMotion(std::move(model), name), initial, input);
  }
  /// Adds a sensor. `roles` are the blocks that fill the roles of the model, in the order of the
  /// roles. Optional roles at the end may be omitted. Roles of a landmark must be omitted, because
  /// each measurement names its landmark.
  SensorHandle AddSensor(const std::string& name, SharedSensor model,
                         std::vector<RoleBinding> roles, const SensorOptions& options = {});
  template <SensorStruct Model>
  SensorHandle AddSensor(const std::string& name, Model model, std::vector<RoleBinding> roles,
                         const SensorOptions& options = {}) {
    return AddSensor(name, MakeSensor(std::move(model), name), std::move(roles), options);
  }

  /// Returns the state before the first measurement, in the order of the layout. All blocks with a
  /// mean are present. If `reserved` is true, blocks that start from a measurement also have
  /// offsets in x and P.
  State InitialState(bool reserved = false) const;
  /// Returns the index of a sensor, or -1 for an unknown name.
  int FindSensor(std::string_view name) const;

  StateLayout layout;
  std::vector<MotionBinding> motions;
  std::vector<SensorBinding> sensors;
  std::vector<Prior> priors;
  std::vector<StreamInfo> streams;       ///< all streams, in the order of Measurement::stream
  std::optional<double> initial_time_s;  ///< time of the priors; nullopt: time of the first frame
  std::optional<LandmarkOptions> landmarks;  ///< set if a sensor measures landmarks
};

namespace internal {

/// Returns the block of the position from which landmarks are observed, or -1 if the problem has no
/// such block.
BlockId PositionBlockOf(const Problem& problem);

/// Adds the model parameter state SENSOR.ROLE of a sensor, with its process. Throws Error
/// kBadConfig if the initial value is invalid.
BlockId AddOwnedState(Problem& problem, const std::string& sensor, const Space& role,
                      OwnedState state);

/// Returns the unit of a block. If the block has no unit, returns the unit of a sensor role that
/// the block fills.
std::string UnitOf(const Problem& problem, BlockId id);

}  // namespace internal

/// Returns the directions of the initial state that no control input makes observable near the
/// prior. Each direction is the list of the block elements that it changes. The directions span the
/// null space of [H0; H1 F0; H2 F1 F0; ...] with changing inputs [Hermann1977]. If the problem has
/// landmarks, the direction `scale` is the common scale of trajectory and map. Blocks with an exact
/// prior are treated as observed.
std::vector<std::vector<std::string>> UnobservableDirections(const Problem& problem);

}  // namespace alidade
