// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/column_tables.h"

#include "alidade/experiment/truth_match.h"

namespace alidade::internal {

std::vector<BlockLayout> BlockLayoutsOf(const Problem& problem,
                                        const std::vector<StreamInfo>& truths) {
  const std::vector<int> truth_of = MatchTruths(problem.layout, truths);
  std::vector<BlockLayout> layouts;
  for (BlockId id = 0; id < static_cast<int>(problem.layout.blocks().size()); ++id) {
    const Block& block = problem.layout[id];
    const int truth = truth_of[static_cast<std::size_t>(id)];
    const double truth_sigma = truth < 0 ? 0.0 : truths[static_cast<std::size_t>(truth)].sigma;
    layouts.push_back({id, block.space, block.name, UnitOf(problem, id), truth,
                       truth_sigma * truth_sigma, LargestPriorSigma(problem, id)});
  }
  return layouts;
}

}  // namespace alidade::internal
