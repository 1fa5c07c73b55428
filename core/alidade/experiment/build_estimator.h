// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/experiment.h"

namespace alidade::internal {

/// Returns the index of the stream that `sensor`, a config entry with `model`, names. Errors:
/// kBadConfig if the stream does not exist, or if its size differs from that of the model.
int FindStream(const Node& sensor, const SensorModel& model,
               const std::vector<StreamInfo>& streams);

/// Rejects a sensor or a control input whose stream the source does not have. Errors: kBadConfig.
void CheckStreams(const Node& root, const Problem& problem, const std::vector<StreamInfo>& streams);

/// Builds the entry `name` of `estimators:`. `streams` are those of the source, or null for the
/// streams that the entry names; `earlier_estimators` are those listed before it. Errors: those of
/// BuildExperiment.
EstimatorSpec BuildEstimator(const std::string& name, const Node& entry, const Config& config,
                             const PluginHost& host, const std::vector<StreamInfo>* streams,
                             const std::vector<EstimatorSpec>& earlier_estimators);

/// Builds the entry `name` of `estimators:` and appends it to the experiment; appends nothing if
/// that fails. `config` includes the calibration of the data. Errors: those of BuildExperiment.
void AddEstimator(const Config& config, const PluginHost& host, const std::string& name,
                  Experiment& experiment);

}  // namespace alidade::internal
