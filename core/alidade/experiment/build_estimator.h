// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/experiment.h"

namespace alidade::internal {

/// Index of the stream that `sensor`, an entry of the config with that model, names. Errors:
/// kBadConfig for a stream that is not there, or of another size than the model measures.
int FindStream(const Node& sensor, const SensorModel& model,
               const std::vector<StreamInfo>& streams);

/// Refuses a sensor or a control input whose stream the source does not have. Errors: kBadConfig.
void CheckStreams(const Node& root, const Problem& problem, const std::vector<StreamInfo>& streams);

/// The entry `name` of the config's `estimators:`, given the streams of its source (null: those
/// that it takes) and the estimators before it. Errors: those of BuildExperiment.
EstimatorSpec BuildEstimator(const std::string& name, const Node& entry, const Config& config,
                             const PluginHost& host, const std::vector<StreamInfo>* streams,
                             const std::vector<EstimatorSpec>& before);

/// Makes the entry `name` of the `estimators:` of a config that has the calibration of the data,
/// and puts it behind those that the experiment has; nothing is added where that fails. Errors:
/// those of BuildExperiment.
void AddEstimator(const Config& config, const PluginHost& host, const std::string& name,
                  Experiment& experiment);

}  // namespace alidade::internal
