// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/experiment/run.h"

namespace alidade {

/// Describes `experiment` without running it. `config` is its config with expanded short forms
/// (Experiment::config). The text lists the values that were filled in. For each estimator
/// the text lists the blocks and their initial values, the motion models and the sensors. It also
/// lists the unobservable directions of the state, the options and the capabilities.
std::string Explain(const Config& config, const Experiment& experiment);

/// Returns the explanation as a page: one HTML file that needs no network. It also contains a
/// drawing of streams, sensors, blocks and motion models, and the meaning of each key.
/// `host` provides the models of the experiment.
std::string ExplainPage(const Config& config, const Experiment& experiment, const PluginHost& host);

}  // namespace alidade
