// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace alidade {

/// Exit code of a process that ends with an error. The values follow sysexits.h if a code applies.
enum class ExitCode : int {
  kOk = 0,
  kFound = 1,          ///< the command succeeded and found a defect (check, compare)
  kUsage = 2,          ///< the command line
  kBadData = 65,       ///< a measurement file
  kInputMissing = 66,  ///< a file that cannot be opened
  kPlugin = 69,        ///< a plugin is missing or was refused
  kInternal = 70,      ///< a defect of this program
  kCannotCreate = 73,  ///< an output that cannot be created
  kIo = 74,            ///< a read or write that failed before its end
  kStopped = 75,       ///< stopped by a signal; the output is complete up to that time
  kNotTrusted = 77,    ///< a file or folder that someone else could have written
  kBadConfig = 78,     ///< the config
  kDiverged = 79,      ///< the filter diverged under `on_divergence: fail`
};

/// Position of a value in a file: line and column count from 1; 0 means unknown.
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

/// Reason for which the program ends: its exit code and message.
struct Failure {
  ExitCode code = ExitCode::kInternal;
  std::string reason;
};

/// Returns the failure of the exception that is being handled: the code and text of an Error;
/// kInternal for any other exception. Call it only in a catch block.
Failure CaughtFailure();

/// Composes an error message in the form that all messages have. Empty parts are omitted.
std::string ErrorLine(const Place& place, std::string_view key, std::string_view problem,
                      std::string_view expected = {}, std::string_view suggestion = {});

/// Returns the candidate with the smallest edit distance to `word`, or "" if it is too large for a
/// suggestion.
template <class Range>
std::string Nearest(std::string_view word, const Range& candidates);

/// Returns the Damerau-Levenshtein distance (an adjacent transposition counts one).
int EditDistance(std::string_view a, std::string_view b);

/// Programmer's misuse of the API, thrown by ALIDADE_EXPECTS.
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
