// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/cpu_clock.h"

#include <time.h>

#include <algorithm>
#include <utility>

namespace alidade::internal {
namespace {

/// Returns the minimum time between two consecutive readings of the clock, s.
double ReadingSeconds() {
  double minimum_s = 1.0;
  for (int i = 0; i < 50; ++i) {
    const double first = ThreadCpuSeconds();
    minimum_s = std::min(minimum_s, ThreadCpuSeconds() - first);
  }
  return minimum_s;
}

class EstimatorWithCpuClock : public Estimator {
 public:
  EstimatorWithCpuClock(std::unique_ptr<Estimator> estimator, std::shared_ptr<CpuTime> time)
      : estimator_(std::move(estimator)), time_(std::move(time)), reading_s_(ReadingSeconds()) {}

  void Start(Timestamp timestamp) override { estimator_->Start(timestamp); }
  const UpdateReport& Process(const Frame& frame) override {
    const double start = ThreadCpuSeconds();
    const UpdateReport& report = estimator_->Process(frame);
    time_->frames_s += SecondsSince(start);
    return report;
  }
  bool offline() const override { return estimator_->offline(); }
  void Smooth(const Emit& emit) override {
    double segment_start = ThreadCpuSeconds();
    const auto forward = [&](std::size_t index, const State& state, const UpdateReport& report) {
      time_->smoothing_s += SecondsSince(segment_start);
      emit(index, state, report);
      segment_start = ThreadCpuSeconds();
    };
    estimator_->Smooth(forward);
    time_->smoothing_s += SecondsSince(segment_start);
  }
  void StopWhen(const std::function<bool()>& stop) override { estimator_->StopWhen(stop); }
  std::unique_ptr<Estimator> Clone() const override { return estimator_->Clone(); }
  const State& state() const override { return estimator_->state(); }
  std::vector<LandmarkEstimate> landmarks() const override { return estimator_->landmarks(); }
  Timestamp timestamp() const override { return estimator_->timestamp(); }
  bool diverged() const override { return estimator_->diverged(); }
  bool failed() const override { return estimator_->failed(); }

 private:
  double SecondsSince(double start) const {
    return std::max(0.0, ThreadCpuSeconds() - start - reading_s_);
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
  return std::make_unique<EstimatorWithCpuClock>(std::move(estimator), std::move(time));
}

}  // namespace alidade::internal
