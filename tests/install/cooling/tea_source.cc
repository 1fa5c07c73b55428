// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <memory>
#include <random>

#include "alidade/experiment/source_plugin.h"

namespace {

/// A cup of tea at 80 degC cools in a room at 20 degC. The temperature of the tea is read once a
/// second.
class Tea : public alidade::Source {
 public:
  explicit Tea(const alidade::SourceArguments& arguments)
      : frames_(arguments.params.Integer("frames", "readings in all", 1, 1'000'000, 60)),
        sigma_(arguments.params.Positive("sigma_degc", "degC", "noise of a reading, 1 sigma", 1.0)),
        random_(arguments.seed) {}

  const std::vector<alidade::StreamInfo>& streams() const override { return streams_; }
  const std::vector<alidade::StreamInfo>& truths() const override { return truths_; }
  std::int64_t size() const override { return frames_; }

  bool Next(alidade::SourceFrame& frame) override {
    if (at_ == frames_) return false;
    const double truth = 20.0 + 60.0 * std::exp(-at_ / 300.0);
    frame.timestamp = alidade::TimestampFromSeconds(at_++);
    frame.measurements = {{frame.timestamp, 0, -1, {truth + sigma_ * normal_(random_)}, {}}};
    frame.truth = {{truth}};
    return true;
  }

 private:
  std::vector<alidade::StreamInfo> streams_{{"reading"}};
  std::vector<alidade::StreamInfo> truths_{{"tea.temperature"}};
  int frames_, at_ = 0;
  double sigma_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

std::unique_ptr<alidade::Source> Create(const alidade::SourceArguments& arguments) {
  return std::make_unique<Tea>(arguments);
}

}  // namespace

ALIDADE_SOURCE_PLUGIN({"tea", "simulator: a cup of tea cools, read once a second", "", &Create})
