// SPDX-License-Identifier: Apache-2.0
#include <malloc.h>

#include <algorithm>
#include <cfenv>
#include <clocale>
#include <cmath>
#include <filesystem>
#include <limits>

#include "alidade/base/number_text.h"
#include "alidade/check/check_context.h"

#if defined(__SANITIZE_ADDRESS__)
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();
#endif

/// Checks of the rules that plugin_abi.h states for every call.
namespace alidade::internal {
namespace {

/// Calls `test(function, state)` for each function at each state. A noise function is tested only
/// at defined states. Returns the first failure, or "" if no test fails.
template <class Test>
std::string FirstFailure(Context& context, const Test& test) {
  for (const Function& f : context.model().functions) {
    for (const CheckedState& state : context.states()) {
      if (f.is_noise && !state.defined) continue;
      if (std::string failure = test(f, state); !failure.empty()) return failure;
    }
  }
  return {};
}

CheckResult ToFinding(const std::string& failure, const std::string& success_text) {
  return failure.empty() ? Ok(success_text) : Fail(failure);
}

std::string Count(Context& context) { return std::to_string(context.states().size()) + " states"; }

/// Describes an invalid return code of `f`. Returns "" if the code is valid.
std::string CodeDefect(const Context& context, const Function& f, std::int32_t code) {
  if (code == ALIDADE_ERROR) {
    const std::string text = [&] {
      const AlidadeInstance& c = context.model().instance->c();
      return c.error_text == nullptr ? std::string() : context.model().instance->error_text();
    }();
    return "the function failed: " + (text.empty() ? "the model does not set an error text" : text);
  }
  const bool may_refuse = f.name == "Valid" || f.name == "Initialise";
  if (code == ALIDADE_OK || (code == ALIDADE_INVALID && may_refuse)) return {};
  if (code == ALIDADE_OUT_OF_DOMAIN && f.name != "Valid") {
    return f.is_noise ? "the noise is undefined, although " + context.main().name + " is defined"
                      : "";
  }
  return "the function returned " + std::to_string(code) + ", which is not a valid status";
}

/// Settings of the process that determine how numbers are rounded and formatted.
struct NumberSettings {
  int rounding = std::fegetround();
  std::string locale = std::setlocale(LC_ALL, nullptr);
  locale_t thread_locale = uselocale(nullptr);
};

/// Describes the setting that has changed. Returns "" if no setting has changed.
std::string ChangeBetween(const NumberSettings& previous, const NumberSettings& current) {
  if (current.rounding != previous.rounding) return "changed the rounding mode";
  if (current.locale != previous.locale || current.thread_locale != previous.thread_locale) {
    return "changed the locale from '" + previous.locale + "' to '" + current.locale + "'";
  }
  return {};
}

/// Returns the number of allocated bytes on the heap.
double HeapBytes() {
#if defined(__SANITIZE_ADDRESS__)
  return static_cast<double>(__sanitizer_get_current_allocated_bytes());
#else
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
#endif
}

int OpenDescriptors() {
  int count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    ++count;
  }
  return count;
}

/// Describes the defect of one number that a model has returned. Returns "" if the number is valid.
std::string CellDefect(double cell) {
  if (Unwritten(cell)) return "is not written";
  return std::isfinite(cell) ? "" : "is " + NumberText(cell);
}

/// Describes the first defect of the values of an answer. Returns "" if the values are valid.
std::string ValueDefect(const Function& f, const Answer& answer) {
  for (std::size_t i = 0; i < f.outputs.size(); ++i) {
    const Space& space = f.outputs[i];
    const std::vector<std::string> names = ColumnNames(space.name, space);
    std::vector<double> dense;
    for (int c = 0; c < answer.outputs[i].columns(); ++c) {
      dense.push_back(answer.outputs[i](0, c));
      const std::string defect = CellDefect(dense.back());
      if (!defect.empty()) return names[static_cast<std::size_t>(c)] + ' ' + defect;
    }
    if (DistanceFrom(space.geometry, dense.data()) > 1e-9) {
      return space.name + " is not a " + space.geometry.name();
    }
  }
  return {};
}

/// Describes the first defect of the Jacobians of an answer. Returns "" if they are valid.
std::string JacobianDefect(const Function& f, const CheckedState& state, const Answer& answer) {
  for (std::size_t i = 0; i < answer.matrices.size(); ++i) {
    const Buffer& j = answer.matrices[i];
    if (f.jacobian_per_input() && state.values[static_cast<std::size_t>(f.slots[i])].empty()) {
      continue;  // an unbound role has no Jacobian
    }
    for (int cell = 0; cell < j.rows() * j.columns(); ++cell) {
      const int r = cell / j.columns(), c = cell % j.columns();
      const std::string defect = CellDefect(j(r, c));
      if (defect.empty()) continue;
      return "Jacobian " + std::to_string(i) + " entry (" + std::to_string(r) + ", " +
             std::to_string(c) + ") " + defect;
    }
  }
  return {};
}

}  // namespace

CheckResult CheckCreate(Context& context) {
  for (int i = 0; i < 3; ++i) context.Destroy(context.Create());
  return Ok("created and destroyed");
}

CheckResult CheckCalls(Context& context) {
  int defined = 0;
  for (const CheckedState& state : context.states()) defined += state.defined ? 1 : 0;
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        const std::string defect = CodeDefect(context, f, context.Call(f, state).code);
        return defect.empty() ? defect : context.CallText(f, state) + ": " + defect;
      });
  if (!failure.empty()) return Fail(failure);
  const std::string text =
      context.main().name + " is defined at " + std::to_string(defined) + " of " + Count(context);
  if (defined == 0)
    return Fail(text + ", so the model cannot be checked; use --states N to test more states");
  return Ok(text);
}

CheckResult CheckBounds(Context& context) {
  const std::string failure = FirstFailure(context, [&](const Function& f,
                                                        const CheckedState& state) {
    const Answer answer = context.Call(f, state);
    if (answer.written_input >= 0) {
      const int slot = f.slots[static_cast<std::size_t>(answer.written_input)];
      return context.CallText(f, state) + ": the function writes to the input " +
             context.model().slots[static_cast<std::size_t>(slot)].name;
    }
    for (const auto* buffers : {&answer.outputs, &answer.matrices}) {
      for (std::size_t i = 0; i < buffers->size(); ++i) {
        if ((*buffers)[i].GuardsIntact()) continue;
        const std::string output = buffers == &answer.outputs ? f.outputs[i].name
                                   : f.is_noise               ? "factor"
                                                              : "Jacobian " + std::to_string(i);
        return context.CallText(f, state) + ": the function writes outside the buffer of " + output;
      }
    }
    return std::string();
  });
  return ToFinding(failure, "each function writes only to its outputs");
}

CheckResult CheckEnvironment(Context& context) {
  const NumberSettings previous;
  const auto changed = [&](const std::string& call) {
    const std::string change = ChangeBetween(previous, NumberSettings());
    return change.empty() ? change : call + ' ' + change;
  };
  std::unique_ptr<ModelUnderTest> second_instance = context.Create();
  std::string failure = changed("create");
  context.Destroy(std::move(second_instance));
  if (failure.empty()) failure = changed("destroy");
  if (failure.empty()) {
    failure = FirstFailure(context, [&](const Function& f, const CheckedState& state) {
      static_cast<void>(context.Call(f, state));
      return changed(f.name);
    });
  }
  return ToFinding(failure, "rounding mode and locale are unchanged");
}

CheckResult CheckDeterministic(Context& context) {
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        static_cast<void>(context.Call(f, state));
        const Answer second = context.Call(f, state), third = context.Call(f, state);
        return second == third ? ""
                               : context.CallText(f, state) +
                                     ": two consecutive calls return different results";
      });
  return ToFinding(failure, "consecutive calls return the same bits");
}

CheckResult CheckPure(Context& context) {
  std::vector<Answer> first;
  const auto record_answer = [&](const Function& f, const CheckedState& state) {
    first.push_back(context.Call(f, state));
    return std::string();
  };
  static_cast<void>(FirstFailure(context, record_answer));
  // Repeat the calls in reverse order, first with a new instance, then with the same instance.
  std::unique_ptr<ModelUnderTest> second_instance = context.Create();
  std::string failure;
  for (const ModelUnderTest* model :
       {const_cast<const ModelUnderTest*>(second_instance.get()), &context.model()}) {
    std::size_t k = first.size();
    for (std::size_t i = model->functions.size(); i-- > 0 && failure.empty();) {
      const Function& f = model->functions[i];
      for (std::size_t s = context.states().size(); s-- > 0 && failure.empty();) {
        const CheckedState& state = context.states()[s];
        if (f.is_noise && !state.defined) continue;
        if (context.Call(f, state) == first[--k]) continue;
        failure = context.CallText(f, state) + ": the result depends on earlier calls";
      }
    }
  }
  context.Destroy(std::move(second_instance));
  return ToFinding(failure, "results do not depend on earlier calls or other instances");
}

CheckResult CheckOutputs(Context& context) {
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        if (f.is_noise) return std::string();  // the check `noise` tests these functions
        const Answer full = context.Call(f, state), value = context.Call(f, state, kNoMatrix);
        std::string defect;
        if (value.ok()) defect = ValueDefect(f, value);
        if (defect.empty() && full.ok()) defect = ValueDefect(f, full);
        if (defect.empty() && full.ok()) defect = JacobianDefect(f, state, full);
        return defect.empty() ? defect : context.CallText(f, state) + ": " + defect;
      });
  return ToFinding(failure, "all outputs are written, finite and valid points of their geometry");
}

CheckResult CheckFailure(Context& context) {
  int failed = 0;
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        const Answer answer = context.Call(f, state);
        if (answer.ok()) return std::string();
        ++failed;
        for (const auto* buffers : {&answer.outputs, &answer.matrices}) {
          for (const Buffer& buffer : *buffers) {
            if (!buffer.Untouched())
              return context.CallText(f, state) + ": the function fails, but writes an output";
          }
        }
        return std::string();
      });
  if (failure.empty() && failed == 0) return Skip("no call failed");
  return ToFinding(failure, std::to_string(failed) + " failed calls left their outputs unchanged");
}

CheckResult CheckLeaks(Context& context) {
  // The allocator retains a limited amount of freed memory, so the heap grows in some parts of the
  // test without a leak. With a leak, it grows in every part.
  constexpr int kWarmUp = 5, kRounds = 100, kParts = 10;
  const auto find_leak = [&](const std::string& call, const auto& round) -> std::string {
    for (int i = 0; i < kWarmUp; ++i) round();
    const int descriptors = OpenDescriptors();
    double growth = std::numeric_limits<double>::infinity();
    for (int part = 0; part < kParts && growth >= 1.0; ++part) {
      const double start = HeapBytes();
      for (int i = 0; i < kRounds; ++i) round();
      growth = std::min(growth, (HeapBytes() - start) / kRounds);
    }
    if (OpenDescriptors() - descriptors >= kRounds) return call + " leaves files open";
    if (growth < 1.0) return {};
    return call + " leaks " + RoundedText(growth, 4) + " bytes per call";
  };
  std::string failure = find_leak("create and destroy", [&] { context.Destroy(context.Create()); });
  const auto& states = context.states();
  const auto defined = std::find_if(states.begin(), states.end(),
                                    [](const CheckedState& state) { return state.defined; });
  for (const Function& f : context.model().functions) {
    if (!failure.empty() || defined == states.end()) break;
    failure = find_leak(f.name, [&] { static_cast<void>(context.Call(f, *defined)); });
  }
  return ToFinding(failure, "allocated memory and number of open files do not grow");
}

}  // namespace alidade::internal
