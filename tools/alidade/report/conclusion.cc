// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/conclusion.h"

#include <nlohmann/json.hpp>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"

namespace alidade::internal {
namespace {

const char* ToString(Conclusion::Tone tone) {
  switch (tone) {
    case Conclusion::Tone::kGood:
      return "good";
    case Conclusion::Tone::kWarning:
      return "warning";
    case Conclusion::Tone::kBad:
      return "bad";
    case Conclusion::Tone::kNeutral:
      break;
  }
  return "neutral";
}

}  // namespace

Json ConclusionsJson(const std::vector<Conclusion>& conclusions) {
  Json list = Json::array();
  for (const Conclusion& conclusion : conclusions) {
    list.push_back({{"tone", ToString(conclusion.tone)},
                    {"text", conclusion.text},
                    {"details", conclusion.details}});
  }
  return list;
}

std::vector<std::string> ConclusionLines(const std::vector<Conclusion>& conclusions) {
  std::vector<std::string> lines;
  for (const Conclusion& conclusion : conclusions) {
    const bool has_details = !conclusion.details.empty();
    lines.push_back(conclusion.text + (has_details ? " (" + conclusion.details + ')' : ""));
  }
  return lines;
}

std::string PercentText(double share) { return RoundedText(100.0 * share, 2) + " %"; }

std::string IntervalText(double low, double high) {
  return '[' + RoundedText(low, 3) + ", " + RoundedText(high, 3) + ']';
}

std::string JoinNames(const std::vector<std::string>& names) {
  if (names.size() < 2) return Join(names);
  return Join({names.begin(), names.end() - 1}) + " and " + names.back();
}

}  // namespace alidade::internal
