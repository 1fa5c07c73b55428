// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/filter_state.h"

#include <numeric>
#include <span>
#include <utility>

#include "alidade/base/number_text.h"

namespace alidade::internal {
FilterState::FilterState(std::shared_ptr<const ProblemIndex> index, bool uses_first_estimates)
    : problem_index(std::move(index)),
      state(problem_index->initial),
      motions(*problem_index),
      first_estimates(problem_index->problem.layout.blocks().size()),
      uses_first_estimates_(uses_first_estimates) {
  health.out_of_domain.assign(problem_index->sensor_places.size(), 0);
  health.digits_lost.assign(problem_index->sensor_places.size(), 0);
  Activate();
}

void FilterState::Activate() {
  const std::size_t count = problem_index->problem.layout.blocks().size();
  blocks.has_missing = blocks.has_consider = false;
  blocks.gain_rows.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const Block& block = state.layout()[static_cast<BlockId>(i)];
    blocks.has_missing |= !block.present;
    blocks.has_consider |= block.present && block.status == BlockStatus::kConsider;
    for (int k = 0; block.has_covariance() && k < block.geometry().tangent; ++k) {
      blocks.gain_rows.push_back(block.tangent_offset + k);
    }
  }
  motions.Activate(state.layout());
  if (uses_first_estimates_) StoreFirstEstimates();
}

/// Stores the values of stationary blocks that have no first estimate yet.
void FilterState::StoreFirstEstimates() {
  for (const MotionBinding& motion : problem_index->problem.motions) {
    if (!motion.model->stationary()) continue;
    for (const BlockId id : motion.blocks) {
      const Block& block = state.layout()[id];
      std::vector<double>& first = first_estimates[static_cast<std::size_t>(id)];
      if (!block.has_covariance() || !first.empty()) continue;
      first.assign(state.value(id), state.value(id) + block.geometry().ambient);
    }
  }
}

[[gnu::noinline]] Event& AddEvent(FilterState& f, EventKind kind, std::string text) {
  f.report.events.push_back({f.timestamp, kind, std::move(text)});
  return f.report.events.back();
}

std::string Describe(const State& state, std::span<const BlockId> blocks) {
  std::string text;
  for (const BlockId id : blocks) {
    if (id < 0 || !state.layout()[id].present) continue;
    const Block& block = state.layout()[id];
    text += (text.empty() ? "" : ", ") + block.name + " =";
    for (int i = 0; i < block.geometry().ambient; ++i) {
      text += ' ' + RoundedText(state.value(id)[i], 6);
    }
  }
  return text;
}

void AddDivergenceEvent(FilterState& f, EventKind kind, std::string text) {
  f.health.diverged = true;
  AddEvent(f, kind, std::move(text)).divergence = true;
}

[[gnu::noinline]] void End(FilterState& f, EventKind kind, const std::string& reason) {
  f.health.ended = true;
  std::vector<BlockId> blocks(f.problem_index->problem.layout.blocks().size());
  std::iota(blocks.begin(), blocks.end(), 0);
  std::string text = reason + "; last good state at " + SecondsText(f.timestamp) + ": " +
                     Describe(f.state, blocks);
  if (f.health.last_used.sensor >= 0) {
    text +=
        "; last measurement used: sensor '" +
        f.problem_index->problem.sensors[static_cast<std::size_t>(f.health.last_used.sensor)].name +
        "' at " + SecondsText(f.health.last_used.timestamp) + ", z =";
    for (const double z : f.health.last_used.z) text += ' ' + RoundedText(z, 6);
  }
  AddDivergenceEvent(f, kind, std::move(text));
}

}  // namespace alidade::internal
