// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/error.h"

#include <algorithm>
#include <new>
#include <numeric>
#include <vector>

#include "alidade/base/text.h"

namespace alidade {
namespace {

/// Returns true if the letters of `part` occur in `whole` in this order.
bool HasLetters(std::string_view whole, std::string_view part) {
  std::size_t found = 0;
  for (const char c : whole) {
    if (found < part.size() && c == part[found]) ++found;
  }
  return found == part.size();
}

/// Returns true if `candidate` is `word` with a unit, such as `wz [deg/s]` for `wz`.
bool HasUnitAfter(std::string_view candidate, std::string_view word) {
  return !word.empty() && candidate.size() > word.size() && candidate.starts_with(word) &&
         std::string_view(" [(").find(candidate[word.size()]) != std::string_view::npos;
}

/// Returns true if `part` abbreviates `whole`: its letters occur in `whole` in the same order, from
/// the start of one of the words that `_` and `.` separate.
bool Abbreviates(std::string_view part, std::string_view whole) {
  constexpr std::size_t kMinSize = 3;
  if (part.size() < kMinSize || part.size() >= whole.size()) return false;
  for (std::size_t start = 0; start < whole.size(); ++start) {
    const bool is_word_start = start == 0 || whole[start - 1] == '_' || whole[start - 1] == '.';
    if (!is_word_start || whole[start] != part[0]) continue;
    if (HasLetters(whole.substr(start), part)) return true;
  }
  return false;
}

}  // namespace

std::string ToString(const Place& place) {
  std::string text = place.file;
  for (const int number : {place.line, place.column}) {
    if (number <= 0) break;
    if (!text.empty()) text += ':';
    text += std::to_string(number);
  }
  return text;
}

std::string ErrorLine(const Place& place, std::string_view key, std::string_view problem,
                      std::string_view expected, std::string_view suggestion) {
  std::string line = ToString(place);
  if (!key.empty()) {
    if (!line.empty()) line += ' ';
    line += key;
  }
  if (!line.empty() && !problem.empty()) line += ": ";
  line += problem;
  if (!expected.empty()) {
    line += expected.starts_with("expected") ? "; " : "; expected ";
    line += expected;
  }
  if (!suggestion.empty()) line.append("; did you mean '").append(suggestion).append("'?");
  return line;
}

Failure CaughtFailure() {
  try {
    throw;
  } catch (const Error& error) {
    return {error.code(), error.what()};
  } catch (const std::bad_alloc&) {
    return {ExitCode::kInternal, "out of memory"};
  } catch (const std::exception& error) {
    return {ExitCode::kInternal, std::string("internal: ") + error.what()};
  } catch (...) {
    return {ExitCode::kInternal, "internal: an exception of unknown type"};
  }
}

int SpellingCost(std::string_view word, std::string_view candidate) {
  constexpr int kAbbreviationCost = 1000;  // above the distance of any typing error
  const std::string a = internal::LowerCase(word), b = internal::LowerCase(candidate);
  if (HasUnitAfter(b, a)) return 0;
  const int distance = EditDistance(a, b);
  if (distance < static_cast<int>(a.size()) / 3 + 2) return distance;
  return Abbreviates(a, b) || Abbreviates(b, a) ? kAbbreviationCost + distance : kNotSimilar;
}

int EditDistance(std::string_view a, std::string_view b) {
  std::vector<int> second_last, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], second_last[j - 2] + 1);
      }
    }
    second_last = last;
    last.swap(row);
  }
  return last[b.size()];
}

void FailContract(const char* expression, const char* file, int line) {
  throw ContractViolation(
      ErrorLine(Place{file, line, 0}, {}, std::string("violated precondition: ") + expression));
}

}  // namespace alidade
