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

/// Helpers that call plugins and read the structs of plugin_abi.h according to its rules.
namespace alidade::internal {

[[noreturn]] inline void Refuse(const std::filesystem::path& plugin, const std::string& reason) {
  throw Error(ExitCode::kPlugin, ErrorLine({plugin.string()}, {}, reason));
}

/// Returns a text, which may be null, as a string.
inline std::string Text(const char* text) { return text == nullptr ? "" : text; }

/// Returns the reason why `text` breaks the rules for texts, such as `is not UTF-8`; "" if it
/// breaks none.
std::string TextDefect(const char* text);

/// Returns at most the first ALIDADE_MAX_TEXT bytes of a plugin's text, for a message. Replaces
/// control characters and invalid bytes by `?`.
std::string PrintableText(const char* text);

/// Returns true if `name` has 1 to ALIDADE_MAX_NAME bytes of printable ASCII without blanks.
bool IsValidName(const char* name);

/// Returns true if all reserved members are zero, as plugin_abi.h requires.
template <class T, std::size_t N>
bool AllZero(const T (&reserved)[N]) {
  return std::all_of(reserved, reserved + N, [](const T& member) { return member == T{}; });
}

/// Returns the bits of `flags` that are in ALIDADE_MUST_UNDERSTAND but not in `known`, as a text
/// such as `0x20000`; "" if no such bit is set.
std::string UnknownBits(std::uint32_t flags, std::uint32_t known);

/// Copies a struct of plugin_abi.h up to the size that the struct states, but at most `limit`
/// bytes. Members of the copy beyond this size are zero. A pointer that lies only partly within the
/// size is also zero.
template <class T>
T ReadPrefix(const T* source, std::size_t limit = sizeof(T)) {
  T copy{};
  const std::size_t size = std::min({std::size_t{source->struct_size}, limit, sizeof(T)});
  std::memcpy(&copy, source, size - size % alignof(T));
  return copy;
}

/// Returns the i-th struct of an array with the given stride in bytes.
template <class T>
T ReadEntry(const T* first, std::uint32_t stride, std::size_t i) {
  const char* entry = reinterpret_cast<const char*>(first) + i * stride;
  return ReadPrefix(reinterpret_cast<const T*>(entry), stride);
}

/// Returns true if the structs of an array with this stride are aligned and not too large.
template <class T>
bool IsValidStride(std::uint32_t stride) {
  constexpr std::uint32_t kMax = 1 << 16;
  return stride >= 2 * sizeof(std::uint32_t) && stride <= kMax && stride % alignof(T) == 0;
}

/// Returns a measurement for a plugin. It consists of the values `z` and of the `known` numbers of
/// the measurement. `z` is null if only a prediction is requested.
inline AlidadeObservation MakeObservation(const double* z, const double* known) {
  AlidadeObservation observation{};
  observation.struct_size = sizeof(observation);
  observation.z = z;
  observation.known = known;
  return observation;
}

/// Runs `call`. Returns the text of the exception that `call` throws, or "" if it does not throw.
/// Functions of the plugin ABI must not throw, but they may be written in C++.
template <class Call>
std::string CatchExceptionText(const Call& call) {
  try {
    call();
    return {};
  } catch (const std::exception& e) {
    const std::string text = PrintableText(e.what());
    return text.empty() ? "an exception without a message" : text;
  } catch (...) {
    return "an exception of unknown type";
  }
}

}  // namespace alidade::internal
