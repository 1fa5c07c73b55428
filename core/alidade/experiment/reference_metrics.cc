// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/reference_metrics.h"

#include "alidade/base/all_finite.h"

namespace alidade::internal {
std::vector<std::vector<double>> ValuesOf(const State& state, std::size_t blocks) {
  std::vector<std::vector<double>> values(blocks);
  for (std::size_t i = 0; i < blocks; ++i) {
    const auto id = static_cast<BlockId>(i);
    const Block& block = state.layout()[id];
    if (!block.present) continue;
    const double* const x = state.value(id);
    values[i].assign(x, x + block.geometry().ambient);
  }
  return values;
}

std::vector<StreamInfo> BlocksOf(const Problem& problem) {
  std::vector<StreamInfo> blocks;
  for (const Block& block : problem.layout.blocks()) {
    blocks.push_back({block.name, block.geometry().ambient});
  }
  return blocks;
}

void AddDifferences(const std::vector<Estimate>& estimates, const std::vector<Estimate>& reference,
                    const std::vector<FrameWithSegments>& frames, Metrics& metrics) {
  std::vector<const Estimate*> reference_by_frame(frames.size(), nullptr);
  for (const Estimate& estimate : reference) reference_by_frame[estimate.frame] = &estimate;
  for (const Estimate& estimate : estimates) {
    if (reference_by_frame[estimate.frame] == nullptr) continue;
    const FrameWithSegments& frame = frames[estimate.frame];
    std::vector<std::vector<double>> reference_values = reference_by_frame[estimate.frame]->values;
    for (std::vector<double>& value : reference_values) {
      if (!AllFinite(value)) value.clear();
    }
    metrics.AddDifference(frame.frame.timestamp, reference_values, frame.in_segment,
                          estimate.values);
  }
}

}  // namespace alidade::internal
