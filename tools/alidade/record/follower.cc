// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/follower.h"

#include <nlohmann/json.hpp>

#include "alidade/experiment/experiment.h"
#include "alidade/io/json.h"

namespace alidade {

void Follower::Begin(const Experiment& experiment) {
  for (const EstimatorSpec& spec : experiment.estimators) {
    estimators_.push_back({spec.name, internal::BlockLayoutsOf(spec.problem, {})});
  }
}

void Follower::OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                          const UpdateReport& /*report*/) {
  const FollowedEstimator& followed = estimators_[static_cast<std::size_t>(estimator)];
  internal::Json line;
  line["t_s"] = Seconds(frame.timestamp);
  line["estimator"] = followed.name;
  for (const internal::BlockLayout& block : followed.blocks) {
    const internal::BlockRow row{frame, state};
    for (const auto& info : internal::kEstimateColumns) {
      const std::vector<double> numbers = info.numbers(block, row);
      if (numbers.empty()) continue;
      const std::vector<internal::Column> columns = info.columns(block);
      for (std::size_t i = 0; i < columns.size(); ++i) line[columns[i].name] = numbers[i];
    }
  }
  write_(line.dump() + '\n');
}

}  // namespace alidade
