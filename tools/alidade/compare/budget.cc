// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/budget.h"

#include "alidade/compare/cpu_clock.h"

namespace alidade::internal {

double RunBudget::elapsed_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

void RunBudget::RecordRun(double run_s) {
  double longest = longest_s_.load();
  while (run_s > longest && !longest_s_.compare_exchange_weak(longest, run_s)) continue;
}

bool RunBudget::is_spent() const {
  const double longest = longest_s_.load();
  return limit_s_ && longest > 0.0 && elapsed_s() + longest > *limit_s_;
}

std::optional<PredictedCpuTime> PredictCpuTime(Experiment& experiment) {
  constexpr std::int64_t kFrames = 10;
  PredictedCpuTime prediction;
  prediction.total_frames = experiment.source->size();
  if (prediction.total_frames <= 0) return std::nullopt;
  std::vector<std::shared_ptr<CpuTime>> times;
  std::vector<bool> solves_each_frame;
  for (EstimatorSpec& spec : experiment.estimators) {
    solves_each_frame.push_back(spec.kind == EstimatorKind::kBatch && !spec.estimator->offline());
    times.push_back(std::make_shared<CpuTime>());
    spec.estimator = WithCpuClock(std::move(spec.estimator), times.back());
  }
  // Requests a stop only once. The first request ends the processing of frames; a second request
  // would also end the smoothing.
  bool stop_requested = false;
  RunOptions options;
  options.progress = [&](std::int64_t frames, std::int64_t) { prediction.frames = frames; };
  options.stop = [&] {
    return prediction.frames >= kFrames && !std::exchange(stop_requested, true);
  };
  const RunResult result = Run(experiment, options);
  if (result.frames == 0 || result.status == RunStatus::kFailed) return std::nullopt;
  prediction.frames = result.frames;
  const double growth =
      static_cast<double>(prediction.total_frames) / static_cast<double>(prediction.frames);
  for (std::size_t e = 0; e < times.size(); ++e) {
    const double solve_growth = solves_each_frame[e] ? growth : 1.0;
    prediction.cpu_s.push_back(growth *
                               (solve_growth * times[e]->frames_s + times[e]->smoothing_s));
  }
  return prediction;
}

}  // namespace alidade::internal
