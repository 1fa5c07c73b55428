// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/experiment.h"
#include "alidade/io/text_table.h"

namespace alidade::internal {

/// Table of an explanation, with its header, and sentences about the table.
struct ExplainedTable {
  std::string title;
  std::vector<TextRow> rows;
  std::vector<std::string> notes = {};

  bool operator==(const ExplainedTable&) const = default;
};

/// Estimators whose problems have the same explanation.
struct ExplainedProblem {
  std::vector<const EstimatorSpec*> estimators;  ///< at least one
  std::vector<ExplainedTable> tables;            ///< state, motion, sensors, landmarks, effects
  std::vector<std::string> observability;        ///< sentences
};

/// Explains the problems of all estimators. Noise is given for a step of `step_s`.
std::vector<ExplainedProblem> ExplainProblems(const Experiment& experiment, double step_s);

/// Returns the time step for which process noise is explained: that of the rate of the source, or
/// 0.1 s if the config does not contain the rate.
double NominalStep(const Config& config);

/// Returns the standard deviations of R of a sensor at the prior, such as `0.5 px`, or a reason why
/// they are unknown.
std::string MeasurementNoise(const Problem& problem, const SensorBinding& sensor);
/// Returns the standard deviations of Q of each block of a motion model, for a step of `step_s` at
/// the prior. An item is, for example, `target.depth 0.01 m`. The list is empty if the model has no
/// process noise.
std::vector<std::string> ProcessNoise(const Problem& problem, const MotionBinding& motion,
                                      double step_s);

/// Formats rounded values as a list. A single value, and equal values, are formatted as a number.
std::string RoundedList(const std::vector<double>& values);
/// Returns the standard deviations of a covariance as RoundedList().
std::string SigmasText(const Eigen::MatrixXd& covariance);
/// Returns the effect of a sensor on the block of a role: `corrects`, `considers` or `knows`.
const char* EffectText(const Block& block, RoleMode mode);
/// Returns `estimated`, `consider` or `constant`.
const char* StatusText(BlockStatus status);
/// Returns the initial value of a block, such as `0.3 +- 0.1`.
std::string PriorText(const Prior& prior, const Block& block);

/// Returns the text of a scalar or of a list of scalars.
std::string ValueText(const Node& value);
/// Describes the source of an experiment: its streams, keys and truth.
std::string ExplainSource(const Config& config, const Experiment& experiment);
/// Returns the sensors and the control inputs that use a stream.
std::vector<std::string> UsersOf(const Config& config, const std::string& stream);

/// Returns rows that describe how landmarks are initialised, converted and pruned. Requires
/// problem.landmarks.
std::vector<TextRow> LandmarkRows(const Problem& problem);

/// Returns a row with key and value for each option of an estimator.
std::vector<TextRow> OptionRows(const Node& entry, const EstimatorSpec& spec);

/// Returns the features that a type of estimator supports, as lines; "" for an unknown type.
std::string CapabilitiesText(const std::string& type);

}  // namespace alidade::internal
