// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/estimator_capabilities.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/base/text.h"

namespace alidade {
namespace {

std::optional<ProblemDefect> FindUnsupportedBlock(const Problem& problem,
                                                  const EstimatorCapabilities& capabilities) {
  const std::vector<Block>& blocks = problem.layout.blocks();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b].status != BlockStatus::kConsider || capabilities.consider) continue;
    return ProblemDefect{"consider", "consider blocks", "a block that is estimated or constant",
                         static_cast<BlockId>(b)};
  }
  for (const Prior& prior : problem.priors) {
    if (prior.sensor.empty() || capabilities.from_measurement) continue;
    return ProblemDefect{"from_measurement", "blocks that start from a measurement",
                         "mean and sigma", prior.block};
  }
  if (problem.landmarks && !capabilities.landmarks) {
    return ProblemDefect{"landmarks", "landmarks", "`sensors` that do not measure landmarks"};
  }
  return std::nullopt;
}

std::optional<ProblemDefect> FindUnsupportedMode(const RoleBinding& role,
                                                 const EstimatorCapabilities& capabilities) {
  if (role.mode == RoleMode::kConsider && !capabilities.consider) {
    return ProblemDefect{"mode", "consider roles",
                         capabilities.known ? "estimate or known" : "estimate"};
  }
  if (role.mode == RoleMode::kKnown && !capabilities.known)
    return ProblemDefect{"mode", "known roles", "estimate"};
  if (role.jacobian_at == JacobianAt::kMeasurement && !capabilities.at_measurement) {
    return ProblemDefect{"jacobian_at", "jacobian_at: measurement", "prediction"};
  }
  return std::nullopt;
}

/// Returns the sensor from which a block starts, or null if the problem has no such sensor.
const SensorBinding* SensorOf(const Problem& problem, const Prior& prior) {
  const int index = problem.FindSensor(prior.sensor);
  return index < 0 ? nullptr : &problem.sensors[static_cast<std::size_t>(index)];
}

/// Returns the reason why a block cannot start from the sensor that its prior names, or nullopt.
std::optional<ProblemDefect> CheckStart(const Problem& problem, const Prior& prior) {
  const SensorBinding* const sensor = SensorOf(problem, prior);
  if (sensor == nullptr) {
    ProblemDefect defect{"from_measurement", "this estimator has no sensor '" + prior.sensor + "'",
                         "a sensor of this estimator", prior.block};
    defect.nearest = Nearest(prior.sensor, internal::NamesOf(problem.sensors));
    return defect;
  }
  const int role = sensor->model->inverse().role;
  if (role >= 0 && sensor->roles[static_cast<std::size_t>(role)].block == prior.block) return {};
  return ProblemDefect{
      "from_measurement", "sensor '" + prior.sensor + "' does not determine this block",
      "a sensor whose inverse measurement model determines this block", prior.block};
}

/// Searches the blocks that must have a value before the last block of `chain` can start. Returns
/// the first cycle among these blocks, or nullopt. Every sensor from which a block starts must
/// exist.
std::optional<ProblemDefect> FindCycle(const Problem& problem, std::vector<BlockId>& chain) {
  const BlockId last = chain.back();
  if (std::ranges::find(chain, last) != chain.end() - 1) {
    std::vector<std::string> names;
    for (const BlockId block : chain) names.push_back(problem.layout[block].name);
    return ProblemDefect{"from_measurement",
                         "the initialisation is cyclic: " + internal::Join(names, " <- "),
                         "a mean for one block of the cycle", last};
  }
  const auto prior = std::ranges::find(problem.priors, last, &Prior::block);
  if (prior == problem.priors.end() || prior->sensor.empty()) return {};
  for (const RoleBinding& role : SensorOf(problem, *prior)->roles) {
    if (role.block < 0 || role.block == last) continue;
    chain.push_back(role.block);
    if (auto cycle = FindCycle(problem, chain)) return cycle;
    chain.pop_back();
  }
  return {};
}

/// Returns the text of a defect, such as `consider blocks (block 'target.depth'); expected ...`.
std::string Describe(const ProblemDefect& defect, const Problem& problem) {
  std::string text = defect.description;
  if (defect.block >= 0) text += " (block '" + problem.layout[defect.block].name + "')";
  if (defect.sensor >= 0) {
    const SensorBinding& sensor = problem.sensors[static_cast<std::size_t>(defect.sensor)];
    text += " (sensor '" + sensor.name + "', role '" +
            sensor.model->roles()[static_cast<std::size_t>(defect.role)].name + "')";
  }
  text += "; expected " + defect.remedy;
  return defect.nearest.empty() ? text : text + "; did you mean '" + defect.nearest + "'?";
}

}  // namespace

const char* ToString(EstimatorKind kind) {
  constexpr const char* kNames[] = {"filter", "smoother", "batch", "sliding_window"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::optional<ProblemDefect> FindDefect(const Problem& problem) {
  for (const Prior& prior : problem.priors) {
    if (prior.sensor.empty()) continue;
    if (auto defect = CheckStart(problem, prior)) return defect;
  }
  for (const Prior& prior : problem.priors) {
    std::vector<BlockId> chain{prior.block};
    if (auto cycle = FindCycle(problem, chain)) return cycle;
  }
  for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
    const SensorBinding& sensor = problem.sensors[s];
    for (std::size_t r = 0; r < sensor.roles.size(); ++r) {
      const bool is_inverted = sensor.model->inverse().role == static_cast<int>(r);
      if (sensor.roles[r].jacobian_at != JacobianAt::kMeasurement || is_inverted) continue;
      return ProblemDefect{"jacobian_at",
                           "model '" + sensor.model->name() +
                               "' has no inverse measurement model of role '" +
                               sensor.model->roles()[r].name + "'",
                           "prediction",
                           -1,
                           static_cast<int>(s),
                           static_cast<int>(r)};
    }
  }
  return {};
}

std::optional<ProblemDefect> FindUnsupported(const Problem& problem,
                                             const EstimatorCapabilities& capabilities) {
  if (auto found = FindUnsupportedBlock(problem, capabilities)) return found;
  for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
    const SensorBinding& sensor = problem.sensors[s];
    for (std::size_t r = 0; r < sensor.roles.size(); ++r) {
      auto found = FindUnsupportedMode(sensor.roles[r], capabilities);
      if (!found) continue;
      found->sensor = static_cast<int>(s);
      found->role = static_cast<int>(r);
      return found;
    }
  }
  return std::nullopt;
}

Problem CheckedProblem(Problem problem, const char* estimator,
                       const EstimatorCapabilities& capabilities) {
  const std::string name = estimator;
  if (const auto defect = FindUnsupported(problem, capabilities)) {
    throw Error(ExitCode::kBadConfig,
                name + " does not support " + Describe(*defect, problem) + "; or use an Ekf");
  }
  if (const auto defect = FindDefect(problem)) {
    throw Error(ExitCode::kBadConfig,
                name + ": " + defect->key + ": " + Describe(*defect, problem));
  }
  return problem;
}

}  // namespace alidade
