// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <exception>
#include <string>

#include "alidade/host/abi_read.h"

/// Calls into a plugin beside those of a model's call table.
namespace alidade::internal {

/// What `f` threw, in words; "" where it returned. No call of the plugin ABI throws, but it may be
/// C++ behind it.
template <class F>
std::string ThrownBy(const F& f) {
  try {
    f();
    return {};
  } catch (const std::exception& e) {
    const std::string text = ShownText(e.what());
    return text.empty() ? "an exception without a text" : text;
  } catch (...) {
    return "an exception of unknown type";
  }
}

/// A call of this thread, as `Create` of the sensor `name`: DescribeCall names it while it lasts.
class NamedCall {
 public:
  /// All are kept as they are, not copied.
  NamedCall(const char* call, const char* kind, const std::string& name, const std::string& plugin);
  ~NamedCall();
  NamedCall(const NamedCall&) = delete;
  NamedCall& operator=(const NamedCall&) = delete;

  /// A signal handler may ask.
  const char *const call, *const kind, *const name, *const plugin;
  std::uint64_t number = 0;   ///< each has its own
  NamedCall* next = nullptr;  ///< of all threads

 private:
  const void* outer_;
};

/// Destroys what `instance` holds. An exception is a warning.
void Destroy(const AlidadeInstance& instance, const std::string& name,
             const std::string& plugin) noexcept;

}  // namespace alidade::internal
