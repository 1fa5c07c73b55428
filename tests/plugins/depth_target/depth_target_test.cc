// SPDX-License-Identifier: Apache-2.0
#include "plugins/depth_target/depth_target.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace alidade {
namespace {

enum Stream { kDisparity, kDisparityAll, kInverseScale, kInverseScaleSeeing, kInverseScaleBlind };
constexpr double kBfPxM = 400.0 * 0.065;

using Values = std::map<std::string, double>;

/// Host that provides the parameters of a source: those in `values`, and defaults for the others.
/// The value of a choice is its index.
class Host {
 public:
  explicit Host(Values values = {}) : values_(std::move(values)) {
    host_.struct_size = sizeof host_;
    host_.context = this;
    host_.read = [](void* context, const AlidadeParam* p, double* to, std::int32_t) {
      auto* self = static_cast<Host*>(context);
      self->units_[p->key] = p->unit;
      const auto found = self->values_.find(p->key);
      if (found != self->values_.end()) {
        to[0] = found->second;
      } else if (p->fallback != nullptr) {
        to[0] = p->fallback[0];
      } else {
        self->failed_ = std::string("no default: ") + p->key;
      }
      return std::int32_t{1};
    };
    host_.fail = [](void* context, const char* key, const char*) {
      static_cast<Host*>(context)->failed_ = key;
    };
  }
  std::unique_ptr<Source> Make(std::uint64_t seed = 1) {
    static const Config kNoKeys = Config::FromText("{}", "run.yaml");
    Params params(&host_);
    return CreateDepthTarget({kNoKeys.root(), params, seed, {}});
  }
  const std::string& failed() const { return failed_; }
  const std::map<std::string, std::string>& units() const { return units_; }

 private:
  Values values_;
  AlidadeHost host_{};
  std::map<std::string, std::string> units_;
  std::string failed_;
};

std::vector<SourceFrame> AllFrames(const Values& values, std::uint64_t seed = 1) {
  const auto source = Host(values).Make(seed);
  std::vector<SourceFrame> frames;
  for (SourceFrame frame; source->Next(frame);) frames.push_back(frame);
  return frames;
}

std::optional<double> Value(const Frame& frame, Stream stream) {
  for (const Measurement& measurement : frame.measurements) {
    if (measurement.stream == stream) return measurement.values.at(0);
  }
  return std::nullopt;
}

std::vector<double> Series(const Values& values, Stream stream, std::uint64_t seed = 1) {
  std::vector<double> series;
  for (const SourceFrame& frame : AllFrames(values, seed)) {
    if (const auto value = Value(frame, stream)) series.push_back(*value);
  }
  return series;
}

/// Noise samples, recovered with the formulas of the source. All samples are N(0, 1).
struct Noise {
  std::vector<double> disparity, scale;
};

Noise NoiseOf(const std::vector<SourceFrame>& frames, double sigma_d, double sigma_e) {
  Noise noise;
  for (const SourceFrame& frame : frames) {
    const double depth_m = frame.truth[0][0];
    const double scale = 0.3 / depth_m;  // Z0 / Z; Z0 = 0.3 m, w = 300 px
    noise.disparity.push_back((*Value(frame, kDisparityAll) - kBfPxM / depth_m) / sigma_d);
    noise.scale.push_back((1.0 / *Value(frame, kInverseScale) - scale) * scale * 300.0 /
                          (2.0 * sigma_e));
  }
  return noise;
}

double Mean(const std::vector<double>& a) {
  double sum = 0.0;
  for (const double x : a) sum += x;
  return sum / static_cast<double>(a.size());
}

double MeanProduct(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum / static_cast<double>(a.size());
}

TEST(DepthTarget, DefaultsAreTheScenarioOf2017) {
  // The times are t = 0, 33 ms, ... <= 5 s. The last time is 151 * 33 ms = 4.983 s.
  const std::vector<SourceFrame> frames = AllFrames({});
  ASSERT_EQ(frames.size(), 152u);
  EXPECT_EQ(Host().Make()->size(), 152);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double t_s = 0.033 * static_cast<double>(k);
    const double omega = 2.0 * std::numbers::pi * 0.4;
    EXPECT_EQ(frames[k].timestamp, static_cast<Timestamp>(33'000'000 * k));
    EXPECT_NEAR(frames[k].truth[0][0], 0.3 + 0.1 * std::sin(omega * t_s), 1e-15);
    EXPECT_NEAR(frames[k].truth[1][0], 0.1 * omega * std::cos(omega * t_s), 1e-15);
    EXPECT_EQ(frames[k].truth[2][0], 1.0 / 0.3);
    for (const Measurement& m : frames[k].measurements) EXPECT_EQ(m.timestamp, frames[k].timestamp);
  }
}

TEST(DepthTarget, NamesItsStreamsAndTruths) {
  const auto source = Host().Make();
  std::string names;
  for (const StreamInfo& info : source->streams()) names += info.name + " ";
  names += "| ";
  for (const StreamInfo& info : source->truths()) names += info.name + " ";
  EXPECT_EQ(names,
            "disparity disparity_all inverse_scale inverse_scale_seeing inverse_scale_blind | "
            "depth depth_rate inverse_distance ");
}

TEST(DepthTarget, LastSampleSurvivesRounding) {
  // In double precision 0.3 / 0.1 is 2.9999999999999996. The times are still 0, 0.1, 0.2 and 0.3 s.
  EXPECT_EQ(AllFrames({{"duration_s", 0.3}, {"rate_hz", 10.0}}).size(), 4u);
  EXPECT_EQ(AllFrames({{"duration_s", 0.299999}, {"rate_hz", 10.0}}).size(), 3u);
  EXPECT_EQ(AllFrames({{"duration_s", 0.0}}).size(), 1u);
}

TEST(DepthTarget, WithoutNoiseGivesTheFormulas) {
  // The samples are at quarter periods of 0.5 Hz: Z = 0.3, 0.4, 0.3, 0.2 m. d = 26 px m / Z;
  // 1/scale = Z / 0.3 m.
  const std::vector<SourceFrame> frames = AllFrames({{"frequency_hz", 0.5},
                                                     {"rate_hz", 2.0},
                                                     {"duration_s", 1.5},
                                                     {"sigma_disparity_px", 0.0},
                                                     {"sigma_edge_px", 0.0}});
  const double disparity_px[] = {26.0 / 0.3, 65.0, 26.0 / 0.3, 130.0};
  const double inverse_scale[] = {1.0, 4.0 / 3.0, 1.0, 2.0 / 3.0};
  ASSERT_EQ(frames.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    const bool sees = k < 3;  // 0.3 m is not below the limit of 0.3 m
    EXPECT_NEAR(*Value(frames[k], kDisparityAll), disparity_px[k], 1e-12);
    EXPECT_NEAR(*Value(frames[k], kInverseScale), inverse_scale[k], 1e-15);
    EXPECT_EQ(Value(frames[k], kDisparity).has_value(), sees);
    EXPECT_EQ(Value(frames[k], kInverseScaleSeeing).has_value(), sees);
    EXPECT_EQ(Value(frames[k], kInverseScaleBlind).has_value(), !sees);
  }
}

TEST(DepthTarget, TemplateDepthScalesTheImage) {
  // The target is at Z = 0.3 m and the template was recorded at 0.6 m. The target looks twice as
  // large. The true inverse distance is 1 / 0.6 m.
  const std::vector<SourceFrame> frames =
      AllFrames({{"template_depth_m", 0.6}, {"duration_s", 0.0}, {"sigma_edge_px", 0.0}});
  EXPECT_NEAR(*Value(frames[0], kInverseScale), 0.5, 1e-15);
  EXPECT_NEAR(frames[0].truth[2][0], 1.0 / 0.6, 1e-15);
}

TEST(DepthTarget, SplitStreamsRepeatTheWholeOnes) {
  for (const SourceFrame& frame : AllFrames({})) {
    const auto disparity = Value(frame, kDisparity);
    const auto seeing = Value(frame, kInverseScaleSeeing), blind = Value(frame, kInverseScaleBlind);
    EXPECT_EQ(disparity.value_or(*Value(frame, kDisparityAll)), *Value(frame, kDisparityAll));
    EXPECT_EQ(disparity.has_value(), seeing.has_value());
    ASSERT_NE(seeing.has_value(), blind.has_value());
    EXPECT_EQ(seeing ? *seeing : *blind, *Value(frame, kInverseScale));
  }
}

TEST(DepthTarget, NearOnMeasuredComparesTheNoisyDisparity) {
  int unlike_truth = 0;
  for (const SourceFrame& frame : AllFrames({{"blind_test", 0}, {"rate_hz", 1000.0}})) {
    const bool sees = Value(frame, kDisparity).has_value();
    EXPECT_EQ(sees, *Value(frame, kDisparityAll) <= kBfPxM / 0.3);
    unlike_truth += sees != (frame.truth[0][0] >= 0.3) ? 1 : 0;
  }
  EXPECT_GT(unlike_truth, 0);
}

TEST(DepthTarget, NearOnTrueComparesTheExactDisparity) {
  for (const SourceFrame& frame : AllFrames({{"blind_test", 1}, {"rate_hz", 1000.0}})) {
    EXPECT_EQ(Value(frame, kDisparity).has_value(), kBfPxM / frame.truth[0][0] <= kBfPxM / 0.3);
  }
}

TEST(DepthTarget, ThresholdOnTheNoisyDisparitySelects) {
  // The target is at rest at the limit. Only the lower half of N(0, 1) passes, with the mean
  // -sqrt(2/pi) and the variance 1 - 2/pi. All samples pass if the exact disparity is compared with
  // the limit. Tolerances are 5 sigma.
  Values values{{"frequency_hz", 0.0}, {"rate_hz", 1000.0}, {"duration_s", 20.0}};
  const std::vector<double> measured = Series(values, kDisparity);
  values["blind_test"] = 1;
  const std::vector<double> exact = Series(values, kDisparity);
  EXPECT_EQ(exact.size(), 20001u);
  EXPECT_NEAR(static_cast<double>(measured.size()), 10000.5, 5.0 * std::sqrt(20001 * 0.25));
  EXPECT_NEAR(Mean(measured) - kBfPxM / 0.3, -std::sqrt(2.0 / std::numbers::pi),
              5.0 * std::sqrt((1.0 - 2.0 / std::numbers::pi) / 9500.0));
  EXPECT_NEAR(Mean(exact) - kBfPxM / 0.3, 0.0, 5.0 / std::sqrt(20001.0));
}

TEST(DepthTarget, NearZeroIsNeverBlind) {
  EXPECT_EQ(Series({{"min_range_m", 0.0}}, kDisparity).size(), 152u);
  EXPECT_TRUE(Series({{"min_range_m", 0.0}}, kInverseScaleBlind).empty());
}

TEST(DepthTarget, NoiseIsAsItsFormulasSay) {
  // Both recovered noises are N(0, 1) at every depth. In each half of the depths, the noises have
  // mean 0 and variance 1, and are not correlated. Tolerances are 5 sigma of n samples.
  const std::vector<SourceFrame> frames = AllFrames({{"rate_hz", 10000.0},
                                                     {"duration_s", 5.0},
                                                     {"sigma_disparity_px", 0.5},
                                                     {"sigma_edge_px", 0.7}});
  std::vector<SourceFrame> near, far;
  for (const SourceFrame& frame : frames) (frame.truth[0][0] < 0.3 ? near : far).push_back(frame);
  for (const std::vector<SourceFrame>* part : {&near, &far}) {
    const Noise noise = NoiseOf(*part, 0.5, 0.7);
    const double n = static_cast<double>(part->size());
    ASSERT_GT(n, 20000.0);
    for (const std::vector<double>* samples : {&noise.disparity, &noise.scale}) {
      EXPECT_NEAR(Mean(*samples), 0.0, 5.0 / std::sqrt(n));
      EXPECT_NEAR(MeanProduct(*samples, *samples), 1.0, 5.0 * std::sqrt(2.0 / n));
    }
    EXPECT_NEAR(MeanProduct(noise.disparity, noise.scale), 0.0, 5.0 / std::sqrt(n));
  }
}

TEST(DepthTarget, SameSeedGivesTheSameBytes) {
  for (const Stream stream : {kDisparity, kDisparityAll, kInverseScale}) {
    EXPECT_EQ(Series({}, stream, 7), Series({}, stream, 7));
    EXPECT_NE(Series({}, stream, 7), Series({}, stream, 8));
  }
}

TEST(DepthTarget, OneNoiseNeverShiftsTheOther) {
  const std::vector<double> disparity = Series({}, kDisparityAll);
  EXPECT_EQ(Series({{"sigma_edge_px", 0.0}}, kDisparityAll), disparity);
  EXPECT_EQ(Series({{"min_range_m", 0.0}}, kDisparityAll), disparity);
  const std::vector<double> scale = Series({}, kInverseScale);
  EXPECT_EQ(Series({{"sigma_disparity_px", 0.0}}, kInverseScale), scale);
  EXPECT_EQ(Series({{"min_range_m", 0.35}, {"blind_test", 1}}, kInverseScale), scale);
}

TEST(DepthTarget, RefusesADepthThatReachesTheCamera) {
  for (const double amplitude_m : {0.3, 0.5}) {
    Host host({{"amplitude_m", amplitude_m}});
    host.Make();
    EXPECT_EQ(host.failed(), "amplitude_m");
  }
  Host host({{"amplitude_m", 0.299}});
  host.Make();
  EXPECT_EQ(host.failed(), "");
}

TEST(DepthTarget, PoorTextureLosesDisparitiesOrMakesThemAnything) {
  const Values still{{"amplitude_m", 0.0}, {"depth_mean_m", 0.5}, {"duration_s", 165.0}};
  const auto with = [&](const char* key, double value) {
    Values values = still;
    values[key] = value;
    return AllFrames(values);
  };
  // Stream 1, disparity_all, is 52 px with a noise of 1 px. The largest disparity of the search is
  // 52 px.
  const auto disparities = [](const std::vector<SourceFrame>& frames) {
    std::vector<double> found;
    for (const SourceFrame& frame : frames) {
      for (const Measurement& one : frame.measurements) {
        if (one.stream == 1) found.push_back(one.values[0]);
      }
    }
    return found;
  };
  const std::vector<double> all = disparities(AllFrames(still));
  ASSERT_EQ(all.size(), 5001u);
  const double share = static_cast<double>(disparities(with("missing", 0.3)).size()) / 5001.0;
  EXPECT_NEAR(share, 0.7, 4.0 * std::sqrt(0.21 / 5001.0));
  const std::vector<double> wrong = disparities(with("outliers.share", 0.2));
  ASSERT_EQ(wrong.size(), all.size());
  int changed = 0;
  double sum = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (wrong[i] == all[i]) continue;
    ++changed;
    sum += wrong[i];
    largest = std::max(largest, wrong[i]);
  }
  EXPECT_NEAR(changed / 5001.0, 0.2, 4.0 * std::sqrt(0.16 / 5001.0));
  EXPECT_NEAR(sum / changed, 26.0, 4.0 * 52.0 / std::sqrt(12.0 * changed));
  EXPECT_LT(largest, 52.0);
  EXPECT_GT(largest, 51.0);
}

TEST(DepthTarget, EveryParameterHasAUnitAndADefault) {
  Host host;
  host.Make();
  EXPECT_EQ(host.failed(), "");
  const std::map<std::string, std::string> expected{
      {"depth_mean_m", "m"},     {"amplitude_m", "m"},
      {"frequency_hz", "Hz"},    {"rate_hz", "Hz"},
      {"duration_s", "s"},       {"focal_px", "px"},
      {"baseline_m", "m"},       {"min_range_m", "m"},
      {"blind_test", ""},        {"sigma_disparity_px", "px"},
      {"sigma_edge_px", "px"},   {"template_px", "px"},
      {"template_depth_m", "m"}, {"image.width", ""},
      {"image.height", ""},      {"image.noise_grey", "1"},
      {"image.wall_m", "m"},     {"missing", "1"},
      {"outliers.share", "1"}};
  EXPECT_EQ(host.units(), expected);
}

}  // namespace
}  // namespace alidade
