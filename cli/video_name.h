// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace alidade::cli {

/// Validates an option for CLI11: returns "" for the name of an AVI file, else an error text.
inline std::string IsAvi(const std::string& name) {
  if (std::filesystem::path(name).extension() == ".avi") return {};
  return "'" + name + "' is not the name of an AVI file; expected a name such as video.avi";
}

}  // namespace alidade::cli
