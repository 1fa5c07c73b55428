// SPDX-License-Identifier: Apache-2.0
//
// Time of a step of one of many small filters, each of a target of its own: one after the other as
// StaticEkf, compiled as all of this program for the baseline, and as a StaticEkfArray with packs
// of each width that this processor runs. The work is that of depth_step.h.
#include <CLI/CLI.hpp>

#include "alidade/base/statistics.h"
#include "alidade/filter/static_ekf_array.h"
#include "bench/speed/depth_step.h"
#include "bench/speed/interleaved.h"
#include "motion_models/constant.h"
#include "motion_models/constant_velocity.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"

namespace alidade::bench {
namespace {

using Velocity = ConstantVelocity<1, false>;
using Single = StaticEkf<Velocity, Constant<1>>;
using Array = StaticEkfArray<Velocity, Constant<1>>;

/// Begins where the first disparity says.
template <class Filter, class... Index>
void SetUp(Filter& filter, double disparity, Index... index) {
  filter.template Set<0>(index..., kBf / disparity, 0.1);
  filter.template Set<1>(index..., 0.0, 0.5);
  filter.template Set<2>(index..., 3.3, 0.5);
}

/// Targets that swing alike, each some frames behind the one before.
struct Targets {
  explicit Targets(int count) {
    const Swing swing;
    for (int k = 0; k < Swing::kPeriod; ++k) {
      for (int i = 0; i < count; ++i) {
        const auto at = static_cast<std::size_t>((k + 5 * (i % 16)) % Swing::kPeriod);
        disparity.push_back(swing.disparity[at]);
        inverse_scale.push_back(swing.inverse_scale[at]);
      }
    }
  }
  std::vector<double> disparity, inverse_scale;  ///< frame by frame
};

const StereoDisparity kStereo(400.0, 0.065, 1.0);
const Scale2d kScale = Scale2d::FromPixels(300.0, 1.0);

struct OneByOne {
  OneByOne(int count, const Targets& targets) {
    for (int i = 0; i < count; ++i) {
      filters.emplace_back(Velocity(kAcceleration), Constant<1>(1));
      SetUp(filters.back(), targets.disparity[static_cast<std::size_t>(i)]);
    }
  }
  void Step(const double* disparity, const double* inverse_scale, double gate) {
    for (std::size_t i = 0; i < filters.size(); ++i) {
      static_cast<void>(filters[i].Predict(kDt));
      filters[i].Update<0>(kStereo, disparity + i, gate);
      filters[i].Update<0, 2>(kScale, inverse_scale + i, gate);
    }
  }
  double depth(int i) const { return *filters[static_cast<std::size_t>(i)].value<0>(); }

  std::vector<Single> filters;
};

struct Together {
  Together(int count, const Targets& targets, int lanes)
      : array(count, Velocity(kAcceleration), Constant<1>(1)) {
    array.set_lanes(lanes);
    for (int i = 0; i < count; ++i) {
      SetUp(array, targets.disparity[static_cast<std::size_t>(i)], i);
    }
  }
  void Step(const double* disparity, const double* inverse_scale, double gate) {
    array.Step(kDt, ArrayUpdate<StereoDisparity, 0>{kStereo, disparity, gate},
               ArrayUpdate<Scale2d, 0, 2>{kScale, inverse_scale, gate});
  }
  double depth(int i) const { return array.value<0>(i); }

  Array array;
};

/// A contender of which a chunk takes about 0.4 ms, with its depths at the end of one period.
template <class Filters>
Contender Enter(const std::string& name, std::shared_ptr<Filters> filters, const Targets& targets,
                int count, std::vector<double>& depths) {
  const double gate = ChiSquareQuantile(0.999, 1);
  const auto steps = [filters, &targets, count, gate, at = 0](int frames) mutable {
    for (int k = 0; k < frames; ++k) {
      const auto first = static_cast<std::size_t>(at) * static_cast<std::size_t>(count);
      filters->Step(&targets.disparity[first], &targets.inverse_scale[first], gate);
      at = (at + 1) % Swing::kPeriod;
    }
  };
  auto run = std::make_shared<std::decay_t<decltype(steps)>>(steps);
  (*run)(Swing::kPeriod);
  for (int i = 0; i < count; ++i) depths.push_back(filters->depth(i));
  const double start = CpuNs();
  (*run)(Swing::kPeriod);
  const int frames = std::max(1, static_cast<int>(4e5 * Swing::kPeriod / (CpuNs() - start)));
  return {name, [run, frames] { (*run)(frames); }, static_cast<double>(frames) * count, {}};
}

int Main(int rounds, int count) {
  const Targets targets(count);
  std::vector<double> expected;
  std::vector<Contender> all;
  all.push_back(Enter("StaticEkf, one by one", std::make_shared<OneByOne>(count, targets), targets,
                      count, expected));
  std::vector<int> widths;
  for (const int lanes : {2, 4, 16}) {
    if (!internal::HasLanes(lanes)) continue;
    const std::string name = "StaticEkfArray, " + std::to_string(lanes) + " lanes";
    std::vector<double> depths;
    all.push_back(
        Enter(name, std::make_shared<Together>(count, targets, lanes), targets, count, depths));
    widths.push_back(lanes);
    for (std::size_t i = 0; i < depths.size(); ++i) {
      if (std::abs(depths[i] - expected[i]) < 1e-12) continue;
      std::fprintf(stderr, "error: %s ends at a depth of %.15f m, the filter alone at %.15f m\n",
                   name.c_str(), depths[i], expected[i]);
      return 1;
    }
  }
  Interleave(all, rounds);
  PrintTable(all);
  for (const Contender& one : all) {
    std::printf("ns %s %.2f\n", one.name.c_str(), one.Quantile(0.01));
  }
  for (std::size_t i = 0; i < widths.size(); ++i) {
    PrintRatio("static/array_" + std::to_string(widths[i]), all[0], all[i + 1]);
  }
  return 0;
}

}  // namespace
}  // namespace alidade::bench

int main(int argc, char** argv) {
  CLI::App app{"Time of a step of one of many small filters, one by one and as an array."};
  int rounds = 300, count = 256;
  app.add_option("--rounds", rounds, "Chunks of 0.4 ms for each contender")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--filters", count, "How many")->check(CLI::PositiveNumber)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return alidade::bench::Main(rounds, count);
}
