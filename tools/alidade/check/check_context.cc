// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/check_context.h"

#include <cmath>

#include "alidade/io/log.h"

namespace alidade::internal {
namespace {

constexpr double kLarge = 1e6;  // largest element of an edge state, see RandomStates()

/// Returns true if an output is infinite at a state with a large element. This overflow is not an
/// error of the model.
bool Overflows(const CheckedState& state, const Answer& answer) {
  bool large = false, infinite = false;
  for (const auto& value : state.values) {
    for (const double element : value) large = large || std::abs(element) >= kLarge;
  }
  for (const Buffer& value : answer.outputs) {
    for (int i = 0; i < value.columns(); ++i) infinite = infinite || std::isinf(value(0, i));
  }
  return large && infinite;
}

}  // namespace

Context::Context(const ModelCreator& creator, const CheckOptions& options, CallRecord& record)
    : creator_(creator), options_(options), record_(record) {
  model_ = Create();
}

const std::vector<CheckedState>& Context::states() {
  if (!states_.empty()) return states_;
  for (Values& values : RandomStates(*model_, options_.states, options_.seed)) {
    CheckedState state{std::move(values), false};
    const Answer answer = Call(main(), state, kNoMatrix);
    if (answer.ok() && Overflows(state, answer)) continue;
    state.defined = answer.ok();
    if (state.defined && model_->is_sensor()) {
      const Buffer& z = answer.outputs[0];
      std::vector<double>& slot =
          state.values[static_cast<std::size_t>(model_->measurement_slot())];
      for (int i = 0; i < z.columns(); ++i) slot[static_cast<std::size_t>(i)] = z(0, i);
    }
    states_.push_back(std::move(state));
  }
  return states_;
}

std::unique_ptr<ModelUnderTest> Context::Create() const {
  record_.Enter("create");
  auto instance = creator_.create();
  record_.Enter("destroy");  // of an instance with an unread parameter
  creator_.reject_unread();
  return std::make_unique<ModelUnderTest>(std::move(instance));
}

void Context::Destroy(std::unique_ptr<ModelUnderTest> model) const {
  std::string thrown;  // text of an exception; the host logs it as a warning
  record_.Enter("destroy");
  {
    const auto record_text = [&](LogLevel, std::string_view text) { thrown = text; };
    const LogSubscription warnings(LogLevel::kWarning, record_text);
    model.reset();
  }
  record_.Enter("");
  if (!thrown.empty()) throw Error(ExitCode::kPlugin, thrown);
}

void Context::Close() { Destroy(std::move(model_)); }

Values Context::Inputs(const Function& f, const CheckedState& state) {
  Values inputs;
  for (const int slot : f.slots) inputs.push_back(state.values[static_cast<std::size_t>(slot)]);
  return inputs;
}

std::vector<Space> Context::InputSpaces(const Function& f) const {
  std::vector<Space> spaces;
  for (const int slot : f.slots) spaces.push_back(model_->slots[static_cast<std::size_t>(slot)]);
  return spaces;
}

Answer Context::Call(const Function& f, const CheckedState& state, int matrices) const {
  return CallWith(f, Inputs(f, state), matrices);
}

Answer Context::CallWith(const Function& f, const Values& inputs, int matrices) const {
  record_.Enter(f.name.c_str(), StateText(InputSpaces(f), inputs));
  Answer answer = CallFunction(f, inputs, matrices);
  record_.Enter("");
  return answer;
}

std::string Context::CallText(const Function& f, const Values& inputs) const {
  return f.name + " at " + StateText(InputSpaces(f), inputs);
}

}  // namespace alidade::internal
