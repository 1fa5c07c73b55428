// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace alidade {

namespace detail {
/// The slot of the call table, in a ModelInstance, of the model that this thread called last, or a
/// NamedCall that lasts. Another thread may read it.
#if defined(__ELF__)
[[gnu::tls_model("initial-exec")]]
#endif
extern constinit thread_local std::atomic<const void*>
    last_call;

/// One store, before each call.
inline void NoteCall(const void* slot) { last_call.store(slot, std::memory_order_relaxed); }
}  // namespace detail

/// `Predict of model 'scale_2d' of plugin /x/scale_2d.so`, of what a thread called last,
/// into `text` of `size` bytes, which it ends with a zero; "" where no model has been called, or
/// its instance is gone. Of a thread that hangs or has crashed, too: it allocates nothing, waits
/// for nobody, and may be called by a signal handler.
void DescribeCall(const void* slot, char* text, std::size_t size);

/// A call that creates or destroys something, say, in any thread.
struct LastingCall {
  const void* slot = nullptr;
  std::uint64_t number = 0;  ///< each has its own; 0: there is none
};
/// The oldest now, but for those of sources, which may wait for their data.
LastingCall OldestLastingCall();

}  // namespace alidade
