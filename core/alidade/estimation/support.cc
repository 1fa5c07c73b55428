// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/support.h"

#include "alidade/base/error.h"

namespace alidade {
namespace {

std::optional<Unsupported> OfBlocks(const System& system, const Support& support) {
  const std::vector<Block>& blocks = system.layout.blocks();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b].status != BlockStatus::kConsider || support.consider) continue;
    return Unsupported{"consider blocks", "the block estimated or constant",
                       static_cast<BlockId>(b)};
  }
  for (const Prior& prior : system.priors) {
    if (prior.from.empty() || support.from_measurement) continue;
    return Unsupported{"blocks that start from a measurement", "mean and sigma", prior.block};
  }
  if (system.landmarks && !support.landmarks) {
    return Unsupported{"landmarks", "`sensors` that measure none"};
  }
  return std::nullopt;
}

std::optional<Unsupported> OfRole(const RoleBinding& role, const Support& support) {
  if (role.mode == RoleMode::kConsider && !support.consider) {
    return Unsupported{"consider roles", support.known ? "estimate or known" : "estimate"};
  }
  if (role.mode == RoleMode::kKnown && !support.known)
    return Unsupported{"known roles", "estimate"};
  if (role.jacobian_at == JacobianAt::kMeasurement && !support.at_measurement) {
    return Unsupported{"jacobian_at: measurement", "prediction"};
  }
  return std::nullopt;
}

}  // namespace

const char* ToString(EstimatorKind kind) {
  constexpr const char* kNames[] = {"filter", "smoother", "batch", "sliding_window"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::optional<Unsupported> FindUnsupported(const System& system, const Support& support) {
  if (auto found = OfBlocks(system, support)) return found;
  for (std::size_t s = 0; s < system.sensors.size(); ++s) {
    const SensorBinding& sensor = system.sensors[s];
    for (std::size_t r = 0; r < sensor.roles.size(); ++r) {
      auto found = OfRole(sensor.roles[r], support);
      if (!found) continue;
      found->sensor = static_cast<int>(s);
      found->role = static_cast<int>(r);
      return found;
    }
  }
  return std::nullopt;
}

void CheckSupported(const char* estimator, const System& system, const Support& support) {
  const auto asked = FindUnsupported(system, support);
  if (!asked) return;
  std::string where;
  if (asked->block >= 0) where = " (block '" + system.layout[asked->block].name + "')";
  if (asked->sensor >= 0) {
    const SensorBinding& sensor = system.sensors[static_cast<std::size_t>(asked->sensor)];
    where = " (sensor '" + sensor.name + "', role '" +
            sensor.model->roles()[static_cast<std::size_t>(asked->role)].name + "')";
  }
  throw Error(ExitCode::kBadConfig, std::string(estimator) + " does not support " + asked->what +
                                        where + "; expected " + asked->remedy + ", or an Ekf");
}

}  // namespace alidade
