// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/truth_match.h"

#include <algorithm>
#include <string_view>

#include "alidade/base/text.h"

namespace alidade::internal {
namespace {

std::string_view LastComponent(std::string_view name) {
  return name.substr(name.rfind('.') + 1);  // without a dot, npos + 1 is 0
}

}  // namespace

std::vector<int> MatchTruths(const StateLayout& layout, const std::vector<StreamInfo>& truths) {
  const std::vector<Block>& blocks = layout.blocks();
  std::vector<int> match(blocks.size(), -1);
  const auto fits = [&](std::size_t block, const StreamInfo& truth) {
    return match[block] < 0 && blocks[block].geometry().ambient == truth.size;
  };
  for (std::size_t t = 0; t < truths.size(); ++t) {
    const int block = layout.Find(truths[t].name);
    if (block >= 0 && fits(static_cast<std::size_t>(block), truths[t])) match[block] = int(t);
  }
  for (std::size_t t = 0; t < truths.size(); ++t) {
    if (layout.Find(truths[t].name) >= 0) continue;
    const auto has_name = [&](const Block& b) { return LastComponent(b.name) == truths[t].name; };
    const auto first = std::find_if(blocks.begin(), blocks.end(), has_name);
    if (first == blocks.end() || std::any_of(first + 1, blocks.end(), has_name)) continue;
    const auto block = static_cast<std::size_t>(first - blocks.begin());
    if (fits(block, truths[t])) match[block] = static_cast<int>(t);
  }
  return match;
}

std::string WhyNoBlock(const StateLayout& layout, const std::vector<StreamInfo>& truths,
                       std::size_t t) {
  const StreamInfo& truth = truths[t];
  const std::vector<int> match = MatchTruths(layout, truths);
  if (std::find(match.begin(), match.end(), static_cast<int>(t)) != match.end()) return {};
  std::vector<std::string> candidates;
  int size = 0;
  for (const Block& block : layout.blocks()) {
    if (block.name != truth.name && LastComponent(block.name) != truth.name) continue;
    candidates.push_back(block.name);
    size = block.geometry().ambient;
  }
  if (candidates.empty()) return "no block has this name";
  if (candidates.size() > 1) return "the name could mean " + Join(candidates, " or ");
  if (size == truth.size) return candidates[0] + " already has a truth with its full name";
  return candidates[0] + " has size " + std::to_string(size) + ", but the truth has size " +
         std::to_string(truth.size);
}

}  // namespace alidade::internal
