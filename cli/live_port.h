// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace alidade::cli {

/// Returns the port that `text` names. `text` satisfies IsLivePort().
inline std::uint16_t PortOf(const std::string& text) {
  return static_cast<std::uint16_t>(std::stoul(text));
}

/// Validates the option --live for CLI11: returns "" for a port, else an error text. An address is
/// refused, because the page is served to this computer only.
inline std::string IsLivePort(const std::string& text) {
  const bool is_number = text.find_first_not_of("0123456789") == text.npos;
  if (is_number && !text.empty() && text.size() <= 5 && std::stoul(text) <= 65535) return {};
  if (is_number) return "'" + text + "' is not a port; expected a number from 0 to 65535";
  return "'" + text +
         "' is not a port; expected a number from 0 to 65535, without an address: the page is "
         "served at 127.0.0.1 only; from another computer, forward the port with `ssh -L "
         "8080:127.0.0.1:8080 HOST`";
}

}  // namespace alidade::cli
