// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/follower.h"

#include <nlohmann/json.hpp>

#include "alidade/experiment/experiment.h"
#include "alidade/io/json.h"
#include "alidade/state/element_names.h"

namespace alidade {

void Follower::Begin(const Experiment& experiment) {
  for (const EstimatorSpec& spec : experiment.estimators) {
    estimators_.push_back({spec.name, spec.problem.layout});
  }
}

void Follower::OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                          const UpdateReport& /*report*/) {
  const FollowedEstimator& followed = estimators_[static_cast<std::size_t>(estimator)];
  internal::Json line;
  line["t_s"] = Seconds(frame.timestamp);
  line["estimator"] = followed.name;
  for (std::size_t i = 0; i < followed.layout.blocks().size(); ++i) {
    const auto id = static_cast<BlockId>(i);
    const Block& block = state.layout()[id];
    if (!block.present) continue;
    const double* value = state.value(id);
    for (const std::string& name : internal::AmbientNames(block.name, block.space)) {
      line[name] = *value++;
    }
    if (!block.has_covariance()) continue;
    int element = 0;
    for (const std::string& name : internal::TangentNames(block.name, block.space)) {
      line["sigma:" + name] = state.sigma(id, element++);
    }
  }
  write_(line.dump() + '\n');
}

}  // namespace alidade
