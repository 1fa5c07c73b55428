// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/io/json.h"

namespace alidade::internal {

/// Sentence about the results of a command. The terminal, the JSON file and the page show the same
/// sentence.
struct Conclusion {
  enum class Tone { kGood, kNeutral, kWarning, kBad };

  Tone tone = Tone::kNeutral;
  std::string text;     ///< one or more sentences, with a full stop
  std::string details;  ///< numbers behind the text; may be empty
};

/// Returns a list of objects with the keys `tone`, `text` and `details`. `tone` is `good`,
/// `neutral`, `warning` or `bad`.
Json ConclusionsJson(const std::vector<Conclusion>& conclusions);

/// Returns a line for each conclusion: the text, and the details in parentheses.
std::vector<std::string> ConclusionLines(const std::vector<Conclusion>& conclusions);

/// Returns a share in per cent with two significant digits, such as `0.37 %`.
std::string PercentText(double share);

/// Returns `[low, high]` with three significant digits.
std::string IntervalText(double low, double high);

/// Joins names to `a`, `a and b` or `a, b and c`.
std::string JoinNames(const std::vector<std::string>& names);

}  // namespace alidade::internal
