// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/cpu_clock.h"

#include <time.h>

#include <algorithm>
#include <utility>

namespace alidade::internal {
namespace {

/// What two readings in a row are apart at least, s.
double ReadingSeconds() {
  double least = 1.0;
  for (int i = 0; i < 50; ++i) {
    const double first = ThreadCpuSeconds();
    least = std::min(least, ThreadCpuSeconds() - first);
  }
  return least;
}

class ClockedEstimator : public Estimator {
 public:
  ClockedEstimator(std::unique_ptr<Estimator> estimator, std::shared_ptr<CpuTime> time)
      : estimator_(std::move(estimator)), time_(std::move(time)), reading_s_(ReadingSeconds()) {}

  void Start(Timestamp timestamp) override { estimator_->Start(timestamp); }
  const UpdateReport& Process(const Frame& frame) override {
    const double started = ThreadCpuSeconds();
    const UpdateReport& report = estimator_->Process(frame);
    time_->frames_s += Since(started);
    return report;
  }
  bool offline() const override { return estimator_->offline(); }
  void Smooth(const Emit& emit) override {
    double works_since = ThreadCpuSeconds();
    const auto take = [&](std::size_t index, const State& state, const UpdateReport& report) {
      time_->smoothing_s += Since(works_since);
      emit(index, state, report);
      works_since = ThreadCpuSeconds();
    };
    estimator_->Smooth(take);
    time_->smoothing_s += Since(works_since);
  }
  void StopWhen(const std::function<bool()>& stop) override { estimator_->StopWhen(stop); }
  std::unique_ptr<Estimator> Clone() const override { return estimator_->Clone(); }
  const State& state() const override { return estimator_->state(); }
  std::vector<LandmarkEstimate> landmarks() const override { return estimator_->landmarks(); }
  Timestamp timestamp() const override { return estimator_->timestamp(); }
  bool diverged() const override { return estimator_->diverged(); }
  bool failed() const override { return estimator_->failed(); }

 private:
  double Since(double started) const {
    return std::max(0.0, ThreadCpuSeconds() - started - reading_s_);
  }

  std::unique_ptr<Estimator> estimator_;
  std::shared_ptr<CpuTime> time_;
  double reading_s_;
};

}  // namespace

double ThreadCpuSeconds() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::unique_ptr<Estimator> WithCpuClock(std::unique_ptr<Estimator> estimator,
                                        std::shared_ptr<CpuTime> time) {
  return std::make_unique<ClockedEstimator>(std::move(estimator), std::move(time));
}

}  // namespace alidade::internal
