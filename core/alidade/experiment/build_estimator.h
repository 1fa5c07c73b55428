// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/experiment.h"

namespace alidade::internal {

/// Returns the index of the stream that the config entry `sensor` names. `model` is the model of
/// the sensor. Errors: kBadConfig if the stream does not exist, or if its size differs from that of
/// the model.
int FindStream(const Node& sensor, const SensorModel& model,
               const std::vector<StreamInfo>& streams);

/// Rejects a sensor or a control input whose stream the source does not provide. Errors:
/// kBadConfig.
void CheckStreams(const Node& root, const Problem& problem, const std::vector<StreamInfo>& streams);

/// Builds the entry `name` of `estimators:`. `streams` are the streams of the source; null means
/// the streams that the entry names. `earlier_estimators` are the estimators that precede the entry
/// in the config. Errors: those of BuildExperiment.
EstimatorSpec BuildEstimator(const std::string& name, const Node& entry, const Config& config,
                             const PluginHost& host, const std::vector<StreamInfo>* streams,
                             const std::vector<EstimatorSpec>& earlier_estimators);

/// Builds the entry `name` of `estimators:` and appends the estimator to the experiment. Appends
/// nothing if building fails. `config` includes the calibration of the data. Errors: those of
/// BuildExperiment.
void AddEstimator(const Config& config, const PluginHost& host, const std::string& name,
                  Experiment& experiment);

}  // namespace alidade::internal
