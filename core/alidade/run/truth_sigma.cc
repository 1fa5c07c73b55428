// SPDX-License-Identifier: Apache-2.0
#include "alidade/run/truth_sigma.h"

#include <algorithm>
#include <limits>

#include "alidade/base/text_table.h"
#include "alidade/base/words.h"

namespace alidade::internal {

std::vector<double> ReadTruthSigmas(const Node& root, const std::vector<StreamInfo>& truths,
                                    bool is_reference) {
  const auto evaluate = root.Find("evaluate");
  const auto map = evaluate ? evaluate->Find("truth_sigma") : std::nullopt;
  if (!map) return {};
  if (!is_reference)
    map->Fail("without a use: the reference is an estimator", "'reference: truth'");
  std::vector<double> sigmas(truths.size(), 0.0);
  for (const auto& [name, entry] : map->Entries()) {
    const auto truth = std::ranges::find(truths, name, &StreamInfo::name);
    if (truth == truths.end()) {
      const std::vector<std::string> names = NamesOf(truths);
      entry.Fail("no truth '" + name + "'",
                 "a truth of the source" + (names.empty() ? "" : ": " + Join(names)),
                 Nearest(name, names));
    }
    sigmas[static_cast<std::size_t>(truth - truths.begin())] =
        entry.Number(0.0, std::numeric_limits<double>::max());
  }
  return sigmas;
}

}  // namespace alidade::internal
