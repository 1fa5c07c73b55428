// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "alidade/check/check.h"
#include "alidade/check/child_process.h"
#include "alidade/check/model_under_test.h"

/// Checks of `alidade check`: one function for each check.
namespace alidade::internal {

/// Tested state: the values of all slots of a model. If Predict is defined, the measurement slot of
/// a sensor contains the result of Predict.
struct CheckedState {
  Values values;
  bool defined = false;  ///< true: Predict or Step is defined at the state
};

/// Context of a check in the child process: the model under test and the tested states.
class Context {
 public:
  Context(const ModelCreator& creator, const CheckOptions& options, CallRecord& record);
  /// Records the destruction of the model as a call.
  ~Context() {
    if (model_) record_.Enter("destroy");
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const ModelUnderTest& model() const { return *model_; }
  const CheckOptions& options() const { return options_; }
  const std::vector<CheckedState>& states();
  /// Returns Predict of a sensor or Step of a motion model.
  const Function& main() const { return model_->functions.front(); }

  /// Creates another instance with the same parameters.
  std::unique_ptr<ModelUnderTest> Create() const;
  /// Destroys `model` and records the destruction as a call. Error: kPlugin if the destruction
  /// throws.
  void Destroy(std::unique_ptr<ModelUnderTest> model) const;
  /// Returns the inputs of `f` at a state.
  static Values Inputs(const Function& f, const CheckedState& state);
  Answer Call(const Function& f, const CheckedState& state, int matrices = kAllMatrices) const;
  Answer CallWith(const Function& f, const Values& inputs, int matrices) const;
  /// Describes a call, as in `Predict at depth = 0.3`.
  std::string CallText(const Function& f, const Values& inputs) const;
  std::string CallText(const Function& f, const CheckedState& state) const {
    return CallText(f, Inputs(f, state));
  }
  /// Destroys the model. Do not call another function afterwards.
  void Close();

 private:
  std::vector<Space> InputSpaces(const Function& f) const;

  const ModelCreator& creator_;
  const CheckOptions& options_;
  CallRecord& record_;
  std::unique_ptr<ModelUnderTest> model_;
  std::vector<CheckedState> states_;
};

inline CheckResult Ok(std::string text) { return {CheckResult::Verdict::kOk, "", std::move(text)}; }
inline CheckResult Fail(std::string text) {
  return {CheckResult::Verdict::kFail, "", std::move(text)};
}
inline CheckResult Skip(std::string text) {
  return {CheckResult::Verdict::kSkipped, "", std::move(text)};
}

inline CheckResult Warn(std::string text) {
  return {CheckResult::Verdict::kWarning, "", std::move(text)};
}

struct Check {
  const char* name;
  CheckResult (*run)(Context&);
  bool needed;  ///< true: if this check fails, all later checks are skipped
};

// Checks of the rules of the plugin ABI.
CheckResult CheckCreate(Context& context);
CheckResult CheckCalls(Context& context);
CheckResult CheckBounds(Context& context);
CheckResult CheckEnvironment(Context& context);
CheckResult CheckDeterministic(Context& context);
CheckResult CheckPure(Context& context);
CheckResult CheckOutputs(Context& context);
CheckResult CheckFailure(Context& context);
CheckResult CheckLeaks(Context& context);
// Checks of the mathematics.
CheckResult CheckSameValue(Context& context);
CheckResult CheckJacobian(Context& context);
CheckResult CheckNoise(Context& context);
CheckResult CheckDoubleCover(Context& context);
CheckResult CheckInitialise(Context& context);
CheckResult CheckStep(Context& context);
CheckResult CheckNoiseKind(Context& context);
CheckResult CheckAngles(Context& context);

inline constexpr Check kChecks[] = {
    {"create", CheckCreate, true},
    {"calls", CheckCalls, true},
    {"bounds", CheckBounds, true},
    {"environment", CheckEnvironment, true},
    {"deterministic", CheckDeterministic, true},
    {"pure", CheckPure, true},
    {"outputs", CheckOutputs, true},
    {"failure", CheckFailure, false},
    {"same_value", CheckSameValue, false},
    {"jacobian", CheckJacobian, false},
    {"noise", CheckNoise, false},
    {"double_cover", CheckDoubleCover, false},
    {"initialise", CheckInitialise, false},
    {"step", CheckStep, false},
    {"noise_kind", CheckNoiseKind, false},
    {"angles", CheckAngles, false},
    {"leaks", CheckLeaks, false},
};

}  // namespace alidade::internal
