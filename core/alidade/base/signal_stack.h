// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csignal>
#include <memory>
#include <new>

namespace alidade::internal {

/// A stack of its own for the handlers of signals (SA_ONSTACK) of this thread, for a recursion may
/// have used up the other. One that the thread has already stays; without memory there is none.
class SignalStack {
 public:
  SignalStack() noexcept {
    constexpr std::size_t kSize = 1 << 16;
    stack_t before{};
    if (::sigaltstack(nullptr, &before) != 0 || (before.ss_flags & SS_DISABLE) == 0) return;
    memory_.reset(new (std::nothrow) char[kSize]);
    const stack_t aside{memory_.get(), 0, kSize};
    if (memory_ != nullptr && ::sigaltstack(&aside, nullptr) != 0) memory_.reset();
  }
  ~SignalStack() {
    if (memory_ == nullptr) return;
    stack_t none{};
    none.ss_flags = SS_DISABLE;
    ::sigaltstack(&none, nullptr);
  }
  SignalStack(const SignalStack&) = delete;
  SignalStack& operator=(const SignalStack&) = delete;

 private:
  std::unique_ptr<char[]> memory_;
};

}  // namespace alidade::internal
