// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/check/explain_parts.h"

namespace alidade::internal {

std::vector<TextRow> LandmarkRows(const Problem& problem) {
  const LandmarkOptions& options = *problem.landmarks;
  const auto has_landmark = [](const SensorBinding& sensor) {
    return sensor.model->has_landmark();
  };
  const auto sensor = std::ranges::find_if(problem.sensors, has_landmark);
  const auto representation = RepresentationOf(sensor->model->roles());
  std::vector<TextRow> rows = {
      {"representation", representation ? ToString(*representation) : "specific to the sensor"}};
  const auto add = [&rows](const std::string& key, const std::string& text) {
    rows.push_back({key, text});
  };
  if (options.prior) {
    std::string prior = "inverse distance " + NumberText(options.prior->inverse_distance) + " +- " +
                        NumberText(options.prior->sigma) + " 1/m";
    if (const int n = options.prior->adapt_after; n > 0) {
      prior += "; if a frame measures " + std::to_string(n) +
               " or more converged landmarks, their median replaces the prior";
    }
    if (const int n = options.prior->min_observations; n > 0) {
      prior += "; used from observation " + std::to_string(n);
    }
    add("prior", prior);
  }
  std::string initialise = options.min_observations == 1
                               ? "at the first observation"
                               : "at observation " + std::to_string(options.min_observations);
  if (options.max_per_frame < LandmarkOptions::kUnlimited) {
    initialise += ", if the frame measures fewer than " + std::to_string(options.max_per_frame) +
                  " landmarks";
  }
  add("initialise", initialise);
  std::vector<std::string> prune;
  if (options.max_missed_frames > 0) {
    prune.push_back("not seen for " + std::to_string(options.max_missed_frames) + " frames");
  }
  if (options.min_match_ratio > 0.0) {
    prune.push_back("accepted fraction below " + NumberText(options.min_match_ratio) +
                    " after at least " + std::to_string(options.min_attempts) + " measurements");
  }
  if (options.negative_depth == LandmarkOptions::NegativeDepth::kDelete) {
    prune.emplace_back("inverse distance not positive");
  }
  add("prune", prune.empty() ? "none" : Join(prune, "; "));
  add("convert to xyz",
      options.max_linearity_index > 0.0
          ? "if the linearity index is below " + NumberText(options.max_linearity_index)
          : "none");
  if (!options.known.empty()) add("known", std::to_string(options.known.size()));
  return rows;
}

}  // namespace alidade::internal
