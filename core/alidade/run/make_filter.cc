// SPDX-License-Identifier: Apache-2.0
#include "alidade/run/make_filter.h"

#include <algorithm>
#include <utility>

#include "alidade/run/named_estimator.h"

namespace alidade {
namespace {

/// What the sensors and control inputs of a system take, each stream once.
std::vector<StreamInfo> StreamsOf(const System& system) {
  std::vector<StreamInfo> streams;
  const auto add = [&](const std::string& name, int size) {
    if (std::ranges::find(streams, name, &StreamInfo::name) == streams.end()) {
      streams.push_back({name, size});
    }
  };
  for (const SensorBinding& sensor : system.sensors) {
    add(sensor.stream, sensor.model.measurement().geometry.ambient);
  }
  for (const MotionBinding& motion : system.motions) {
    if (motion.model.has_input()) add(motion.input.stream, motion.model.input().geometry.ambient);
  }
  return streams;
}

}  // namespace

std::unique_ptr<Filter> MakeFilter(const Config& config, const PluginHost& host,
                                   const std::string& name) {
  const Node entry = config.root().At("estimators", "a filter").At(name, "MakeFilter");
  const std::vector<StreamInfo> streams = StreamsOf(BuildSystem(config.root(), host, {}));
  NamedEstimator named = internal::BuildEstimator(name, entry, config, host, streams, {});
  auto* const filter = dynamic_cast<Filter*>(named.estimator.get());
  if (filter == nullptr) {
    entry.At("type").Fail("'" + named.type + "' is no recursive filter",
                          "ekf, iekf, square_root_ekf or ukf");
  }
  named.estimator.release();  // NOLINT(bugprone-unused-return-value): filter is the same
  return std::unique_ptr<Filter>(filter);
}

}  // namespace alidade
