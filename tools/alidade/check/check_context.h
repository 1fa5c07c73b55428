// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "alidade/check/check.h"
#include "alidade/check/child_process.h"
#include "alidade/check/model_under_test.h"

/// The checks that `alidade check` makes of a model, one function each.
namespace alidade::internal {

/// Values of all slots of a model. `defined`: Predict or Step is defined there; then the slot of a
/// sensor's measurement holds what Predict gave.
struct CheckedState {
  Values values;
  bool defined = false;
};

/// What a check works with, in the child process.
class Context {
 public:
  Context(const PluginEntry& entry, const Node& parameters, const CheckOptions& options,
          CallRecord& record);
  /// The destruction of the model is noted as a call.
  ~Context() {
    if (model_) record_.Enter("destroy");
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const ModelUnderTest& model() const { return *model_; }
  const CheckOptions& options() const { return options_; }
  const std::vector<CheckedState>& states();
  /// Sensor: Predict. Motion: Step.
  const Function& main() const { return model_->functions.front(); }

  /// Error kBadConfig where a parameter is given that the model does not read.
  void RejectUnread() const { parameters_.RejectUnread(); }
  /// Another instance with the same parameters.
  std::unique_ptr<ModelUnderTest> Create() const;
  /// Destroys `model`, which is written down as a call. Error: kPlugin where that throws.
  void Destroy(std::unique_ptr<ModelUnderTest> model) const;
  /// The inputs of `f` at a state.
  static Values Inputs(const Function& f, const CheckedState& state);
  Answer Call(const Function& f, const CheckedState& state, int matrices = kAllMatrices) const;
  Answer CallWith(const Function& f, const Values& inputs, int matrices) const;
  /// `Predict at depth = 0.3`
  std::string Where(const Function& f, const Values& inputs) const;
  std::string Where(const Function& f, const CheckedState& state) const {
    return Where(f, Inputs(f, state));
  }
  /// Destroys the model; nothing else may be called after it.
  void Close();

 private:
  std::vector<Space> InputSpaces(const Function& f) const;

  const PluginEntry& entry_;
  const Node& parameters_;
  const CheckOptions& options_;
  CallRecord& record_;
  std::unique_ptr<ModelUnderTest> model_;
  std::vector<CheckedState> states_;
};

inline Finding Ok(std::string words) { return {Finding::Verdict::kOk, "", std::move(words)}; }
inline Finding Fail(std::string words) { return {Finding::Verdict::kFail, "", std::move(words)}; }
inline Finding Skip(std::string words) {
  return {Finding::Verdict::kSkipped, "", std::move(words)};
}

struct Check {
  const char* name;
  Finding (*run)(Context&);
  bool needed;  ///< by all that follow
};

// Of the rules of the plugin ABI.
Finding CheckCreate(Context& context);
Finding CheckCalls(Context& context);
Finding CheckBounds(Context& context);
Finding CheckEnvironment(Context& context);
Finding CheckDeterministic(Context& context);
Finding CheckPure(Context& context);
Finding CheckOutputs(Context& context);
Finding CheckFailure(Context& context);
Finding CheckLeaks(Context& context);
// Of the mathematics.
Finding CheckSameValue(Context& context);
Finding CheckJacobian(Context& context);
Finding CheckNoise(Context& context);
Finding CheckDoubleCover(Context& context);
Finding CheckInitialise(Context& context);
Finding CheckStep(Context& context);
Finding CheckNoiseKind(Context& context);

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
    {"leaks", CheckLeaks, false},
};

}  // namespace alidade::internal
