// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace alidade {

/// What a process that ends with this error returns (sysexits where one fits).
enum class ExitCode : int {
  kOk = 0,
  kFound = 1,          ///< ran, and found something wrong (check, compare)
  kUsage = 2,          ///< the command line
  kBadData = 65,       ///< a measurement file
  kInputMissing = 66,  ///< a file that cannot be opened
  kPlugin = 69,        ///< a plugin missing or refused
  kInternal = 70,      ///< a defect of this program
  kCannotCreate = 73,  ///< an output that cannot be created
  kIo = 74,            ///< a read or write that failed half-way
  kStopped = 75,       ///< stopped by a signal; complete up to there
  kNotTrusted = 77,    ///< a file or folder that someone else could have written
  kBadConfig = 78,     ///< the config
  kDiverged = 79,      ///< the filter diverged under `on_divergence: fail`
};

/// Where a value was written: 1-based line and column, 0 where there is none.
struct Place {
  std::string file;
  int line = 0;
  int column = 0;
};

/// `FILE:LINE:COL`, leaving out what is zero or empty.
std::string ToString(const Place& place);

/// A set-up or input error: what() is one or more lines of the form
/// `FILE:LINE:COL key: what; expected; did you mean ...?`, without the word "error".
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

/// An exception as an end of the program: its exit code, and what to say.
struct Failure {
  ExitCode code = ExitCode::kInternal;
  std::string reason;
};

/// Of the exception that is being handled: an Error's own code and text; anything else is internal.
/// Call it in a catch block only.
Failure CaughtFailure();

/// Composes the one message form of the project; empty parts are left out.
std::string ErrorLine(const Place& place, std::string_view key, std::string_view what,
                      std::string_view expected = {}, std::string_view suggestion = {});

/// The candidate nearest to `word` by edit distance, or "" where none is near enough to suggest.
template <class Range>
std::string Nearest(std::string_view word, const Range& candidates);

/// Damerau-Levenshtein distance (adjacent transpositions count one).
int EditDistance(std::string_view a, std::string_view b);

/// Thrown by ALIDADE_EXPECTS: a programmer's misuse of the API.
class ContractViolation : public std::logic_error {
  using std::logic_error::logic_error;
};

/// Throws ContractViolation; called by ALIDADE_EXPECTS.
[[noreturn]] void FailContract(const char* expression, const char* file, int line);

template <class Range>
std::string Nearest(std::string_view word, const Range& candidates) {
  std::string best;
  int best_distance = static_cast<int>(word.size()) / 3 + 2;
  for (const auto& candidate : candidates) {
    const int distance = EditDistance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

}  // namespace alidade

/// Checks a precondition of a public function; throws ContractViolation.
#define ALIDADE_EXPECTS(condition) \
  ((condition) ? static_cast<void>(0) : ::alidade::FailContract(#condition, __FILE__, __LINE__))
