// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string>

#include "alidade/base/error.h"
#include "alidade/model/plugin_abi.h"

/// Calls plugins and reads the structs of plugin_abi.h by its rules.
namespace alidade::internal {

[[noreturn]] inline void Refuse(const std::filesystem::path& plugin, const std::string& why) {
  throw Error(ExitCode::kPlugin, ErrorLine({plugin.string()}, {}, why));
}

/// A text that may be null.
inline std::string Text(const char* text) { return text == nullptr ? "" : text; }

/// What breaks the rules of texts, as in `is not UTF-8`, or "".
std::string TextDefect(const char* text);

/// A text of a plugin as it goes into a message, whatever is in it: UTF-8 without control
/// characters, in place of which is `?`, of at most ALIDADE_MAX_TEXT bytes.
std::string ShownText(const char* text);

/// Printable ASCII without blanks, of 1 to ALIDADE_MAX_NAME bytes.
bool GoodName(const char* name);

/// Whether reserved members are as they have to be.
template <class T, std::size_t N>
bool AllZero(const T (&reserved)[N]) {
  return std::all_of(reserved, reserved + N, [](const T& one) { return one == T{}; });
}

/// The bits of `flags` that have to be understood and are not among `known`, as in `0x20000`; "".
std::string UnknownBits(std::uint32_t flags, std::uint32_t known);

/// A copy of a struct of plugin_abi.h, as far as its own size says, but no part of a pointer; zero
/// beyond. `limit`: bytes that it may claim at most.
template <class T>
T ReadPrefix(const T* from, std::size_t limit = sizeof(T)) {
  T copy{};
  const std::size_t size = std::min({std::size_t{from->struct_size}, limit, sizeof(T)});
  std::memcpy(&copy, from, size - size % alignof(T));
  return copy;
}

/// The i-th struct of a table that states its own stride.
template <class T>
T ReadEntry(const T* first, std::uint32_t stride, std::size_t i) {
  const char* at = reinterpret_cast<const char*>(first) + i * stride;
  return ReadPrefix(reinterpret_cast<const T*>(at), stride);
}

/// Strides of a table must hold its structs aligned.
template <class T>
bool GoodStride(std::uint32_t stride) {
  constexpr std::uint32_t kMax = 1 << 16;
  return stride >= 2 * sizeof(std::uint32_t) && stride <= kMax && stride % alignof(T) == 0;
}

/// A measurement as a plugin is shown it: its values, null if a prediction alone is asked for, and
/// the numbers that are known with it.
inline AlidadeObservation Shown(const double* z, const double* known) {
  AlidadeObservation shown{};
  shown.struct_size = sizeof(shown);
  shown.z = z;
  shown.known = known;
  return shown;
}

/// The text of the exception that `call` throws; "" if it returns. No call of the plugin ABI may
/// throw, but the code behind it may be C++.
template <class Call>
std::string ThrownBy(const Call& call) {
  try {
    call();
    return {};
  } catch (const std::exception& e) {
    const std::string text = ShownText(e.what());
    return text.empty() ? "an exception without a text" : text;
  } catch (...) {
    return "an exception of unknown type";
  }
}

}  // namespace alidade::internal
