// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace alidade {

/// Exit code of the program. The values from 65 to 78 follow sysexits.h.
enum class ExitCode : int {
  kOk = 0,
  kFound = 1,          ///< a command such as check, compare or run --strict found a defect
  kUsage = 2,          ///< the command line is wrong
  kBadData = 65,       ///< an input file contains an error
  kInputMissing = 66,  ///< an input file cannot be opened
  kPlugin = 69,        ///< a plugin is missing or was refused
  kInternal = 70,      ///< a defect of this program
  kCannotCreate = 73,  ///< an output cannot be created
  kIo = 74,            ///< a read or write failed
  kStopped = 75,       ///< stopped by a signal; the output is complete up to that time
  kNotTrusted = 77,    ///< someone else could have written a file or folder
  kBadConfig = 78,     ///< the config contains an error
  kDiverged = 79,      ///< the filter diverged under `on_divergence: fail`
};

/// Position of a value in a file. Lines and columns are numbered from 1; 0 means unknown.
struct Place {
  std::string file;
  int line = 0;
  int column = 0;
};

/// Returns `FILE:LINE:COL` without the parts that are zero or empty.
std::string ToString(const Place& place);

/// Set-up or input error. Its message is one or more lines of the form
/// `FILE:LINE:COL key: problem; expected ...; did you mean ...?`, without the word "error".
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

/// Failure that ends the program: exit code and message.
struct Failure {
  ExitCode code = ExitCode::kInternal;
  std::string reason;
};

/// Converts the exception that is being handled to a Failure. An Error provides its code and text.
/// Any other exception has the code kInternal. Call this function only in a catch block.
Failure CaughtFailure();

/// Composes an error message in the form that Error describes. Empty parts are omitted.
std::string ErrorLine(const Place& place, std::string_view key, std::string_view problem,
                      std::string_view expected = {}, std::string_view suggestion = {});

/// Returns the candidate that is most similar to `word` according to SpellingCost(). Returns "" if
/// no candidate is similar enough for a suggestion.
template <class Range>
std::string Nearest(std::string_view word, const Range& candidates);

/// Cost of two texts that are not similar.
inline constexpr int kNotSimilar = 1 << 20;
/// Returns the cost of reading `word` as `candidate`, without regard to the case of ASCII letters.
/// Typing errors cost less than an abbreviation: `sigma` or `sgm` of `sigma_px`, `depth` of
/// `target.depth`, or the reverse. The cost of any other pair is kNotSimilar.
int SpellingCost(std::string_view word, std::string_view candidate);

/// Returns the Damerau-Levenshtein distance. Swapping two adjacent letters counts as one edit.
int EditDistance(std::string_view a, std::string_view b);

/// Exception that ALIDADE_EXPECTS throws if a caller violates a precondition of the API.
class ContractViolation : public std::logic_error {
  using std::logic_error::logic_error;
};

/// Throws a ContractViolation that names the condition; ALIDADE_EXPECTS calls it.
[[noreturn]] void FailContract(const char* expression, const char* file, int line);

template <class Range>
std::string Nearest(std::string_view word, const Range& candidates) {
  std::string best;
  int best_cost = kNotSimilar;
  for (const auto& candidate : candidates) {
    const int cost = SpellingCost(word, candidate);
    if (cost < best_cost) {
      best_cost = cost;
      best = candidate;
    }
  }
  return best;
}

}  // namespace alidade

/// Checks a precondition of a public function. Throws ContractViolation if `condition` is false.
#define ALIDADE_EXPECTS(condition) \
  ((condition) ? static_cast<void>(0) : ::alidade::FailContract(#condition, __FILE__, __LINE__))
