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

/// The checks of the rules that plugin_abi.h states for every call.
namespace alidade::internal {
namespace {

/// The first failure that `test(function, state)` finds ("" where there is none) among all
/// functions and states at which they are to be called.
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

Finding Verdict(const std::string& failure, const std::string& fine) {
  return failure.empty() ? Ok(fine) : Fail(failure);
}

std::string Count(Context& context) { return std::to_string(context.states().size()) + " states"; }

/// What a code says that it should not, or "".
std::string CodeDefect(const Context& context, const Function& f, std::int32_t code) {
  if (code == ALIDADE_ERROR) {
    const std::string text = [&] {
      const AlidadeInstance& c = context.model().instance->c();
      return c.error_text == nullptr ? std::string() : context.model().instance->error_text();
    }();
    return "failed: " + (text.empty() ? "it does not say why" : text);
  }
  const bool may_refuse = f.name == "Valid" || f.name == "Initialise";
  if (code == ALIDADE_OK || (code == ALIDADE_INVALID && may_refuse)) return {};
  if (code == ALIDADE_OUT_OF_DOMAIN && f.name != "Valid") {
    return f.is_noise ? "is out of domain where " + context.main().name + " is not" : "";
  }
  return "returned " + std::to_string(code) + ", which is not a status of its";
}

/// Settings of the process that decide how numbers are rounded and written.
struct NumberSettings {
  int rounding = std::fegetround();
  std::string locale = std::setlocale(LC_ALL, nullptr);
  locale_t thread_locale = uselocale(nullptr);
};

/// The setting that has changed, or "".
std::string ChangeBetween(const NumberSettings& before, const NumberSettings& now) {
  if (now.rounding != before.rounding) return "changed the rounding mode";
  if (now.locale != before.locale || now.thread_locale != before.thread_locale) {
    return "changed the locale from '" + before.locale + "' to '" + now.locale + "'";
  }
  return {};
}

/// Bytes on the heap.
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

/// What is wrong with one number that a model has to write, or "".
std::string CellDefect(double cell) {
  if (Unwritten(cell)) return "is not written";
  return std::isfinite(cell) ? "" : "is " + NumberText(cell);
}

/// What is wrong with the values of an answer, or "".
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
      return space.name + " is not a " + ToString(space.geometry.kind);
    }
  }
  return {};
}

/// What is wrong with the Jacobians of an answer, or "".
std::string JacobianDefect(const Function& f, const CheckedState& state, const Answer& answer) {
  for (std::size_t i = 0; i < answer.matrices.size(); ++i) {
    const Buffer& j = answer.matrices[i];
    if (f.jacobian_per_input() && state.values[static_cast<std::size_t>(f.slots[i])].empty()) {
      continue;  // by a role that is not bound
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

Finding CheckCreate(Context& context) {
  if (!context.options().other_keys) context.RejectUnread();
  for (int i = 0; i < 3; ++i) context.Destroy(context.Create());
  return Ok("created and destroyed");
}

Finding CheckCalls(Context& context) {
  int defined = 0;
  for (const CheckedState& state : context.states()) defined += state.defined ? 1 : 0;
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        const std::string defect = CodeDefect(context, f, context.Call(f, state).code);
        return defect.empty() ? defect : context.Where(f, state) + ": " + defect;
      });
  if (!failure.empty()) return Fail(failure);
  const std::string text =
      context.main().name + " is defined at " + std::to_string(defined) + " of " + Count(context);
  if (defined == 0) return Fail(text + ", so that nothing can be checked; more: --states N");
  return Ok(text);
}

Finding CheckBounds(Context& context) {
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        const Answer answer = context.Call(f, state);
        if (answer.written_input >= 0) {
          const int slot = f.slots[static_cast<std::size_t>(answer.written_input)];
          return context.Where(f, state) + ": writes to its input " +
                 context.model().slots[static_cast<std::size_t>(slot)].name;
        }
        for (const auto* buffers : {&answer.outputs, &answer.matrices}) {
          for (std::size_t i = 0; i < buffers->size(); ++i) {
            if ((*buffers)[i].GuardsWhole()) continue;
            const std::string what = buffers == &answer.outputs ? f.outputs[i].name
                                     : f.is_noise               ? "factor"
                                                                : "Jacobian " + std::to_string(i);
            return context.Where(f, state) + ": writes past its buffer of " + what;
          }
        }
        return std::string();
      });
  return Verdict(failure, "nothing written but the outputs");
}

Finding CheckEnvironment(Context& context) {
  const NumberSettings before;
  const auto changed = [&](const std::string& call) {
    const std::string change = ChangeBetween(before, NumberSettings());
    return change.empty() ? change : call + ' ' + change;
  };
  std::unique_ptr<ModelUnderTest> other = context.Create();
  std::string failure = changed("create");
  context.Destroy(std::move(other));
  if (failure.empty()) failure = changed("destroy");
  if (failure.empty()) {
    failure = FirstFailure(context, [&](const Function& f, const CheckedState& state) {
      static_cast<void>(context.Call(f, state));
      return changed(f.name);
    });
  }
  return Verdict(failure, "rounding mode and locale stay");
}

Finding CheckDeterministic(Context& context) {
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        static_cast<void>(context.Call(f, state));
        const Answer second = context.Call(f, state), third = context.Call(f, state);
        return second == third ? "" : context.Where(f, state) + ": two calls in a row differ";
      });
  return Verdict(failure, "calls in a row give the same bits");
}

Finding CheckPure(Context& context) {
  std::vector<Answer> first;
  const auto remember = [&](const Function& f, const CheckedState& state) {
    first.push_back(context.Call(f, state));
    return std::string();
  };
  static_cast<void>(FirstFailure(context, remember));
  // The same in the opposite order, first by an instance that has not been called before.
  std::unique_ptr<ModelUnderTest> other = context.Create();
  std::string failure;
  for (const ModelUnderTest* model :
       {const_cast<const ModelUnderTest*>(other.get()), &context.model()}) {
    std::size_t k = first.size();
    for (std::size_t i = model->functions.size(); i-- > 0 && failure.empty();) {
      const Function& f = model->functions[i];
      for (std::size_t s = context.states().size(); s-- > 0 && failure.empty();) {
        const CheckedState& state = context.states()[s];
        if (f.is_noise && !state.defined) continue;
        if (context.Call(f, state) == first[--k]) continue;
        failure = context.Where(f, state) + ": depends on what was called before";
      }
    }
  }
  context.Destroy(std::move(other));
  return Verdict(failure, "earlier calls and other instances change nothing");
}

Finding CheckOutputs(Context& context) {
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        if (f.is_noise) return std::string();  // of `noise`
        const Answer with = context.Call(f, state), without = context.Call(f, state, kNoMatrix);
        std::string defect;
        if (without.ok()) defect = ValueDefect(f, without);
        if (defect.empty() && with.ok()) defect = ValueDefect(f, with);
        if (defect.empty() && with.ok()) defect = JacobianDefect(f, state, with);
        return defect.empty() ? defect : context.Where(f, state) + ": " + defect;
      });
  return Verdict(failure, "all written, finite and on their geometries");
}

Finding CheckFailure(Context& context) {
  int failed = 0;
  const std::string failure =
      FirstFailure(context, [&](const Function& f, const CheckedState& state) {
        const Answer answer = context.Call(f, state);
        if (answer.ok()) return std::string();
        ++failed;
        for (const auto* buffers : {&answer.outputs, &answer.matrices}) {
          for (const Buffer& buffer : *buffers) {
            if (!buffer.Untouched())
              return context.Where(f, state) + ": fails, but wrote an output";
          }
        }
        return std::string();
      });
  if (failure.empty() && failed == 0) return Skip("no call failed");
  return Verdict(failure, std::to_string(failed) + " failed calls left their outputs alone");
}

Finding CheckLeaks(Context& context) {
  // The allocator keeps some of what is freed, but only so much: a leak grows in every part.
  constexpr int kWarmUp = 5, kRounds = 100, kParts = 10;
  const auto grown = [&](const char* what, const auto& round) -> std::string {
    for (int i = 0; i < kWarmUp; ++i) round();
    const int descriptors = OpenDescriptors();
    double growth = std::numeric_limits<double>::infinity();
    for (int part = 0; part < kParts && growth >= 1.0; ++part) {
      const double start = HeapBytes();
      for (int i = 0; i < kRounds; ++i) round();
      growth = std::min(growth, (HeapBytes() - start) / kRounds);
    }
    if (OpenDescriptors() - descriptors >= kRounds) return std::string(what) + " leaves files open";
    if (growth < 1.0) return {};
    return std::string(what) + " loses " + RoundedText(growth, 4) + " bytes each time";
  };
  std::string failure = grown("create and destroy", [&] { context.Destroy(context.Create()); });
  const auto& states = context.states();
  const auto defined = std::find_if(states.begin(), states.end(),
                                    [](const CheckedState& state) { return state.defined; });
  for (const Function& f : context.model().functions) {
    if (!failure.empty() || defined == states.end()) break;
    failure = grown(f.name.c_str(), [&] { static_cast<void>(context.Call(f, *defined)); });
  }
  return Verdict(failure, "memory and open files do not grow");
}

}  // namespace alidade::internal
