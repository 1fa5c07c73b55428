// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace alidade::cli {

/// A validator of CLI11: it is the name of a video that can be written.
inline std::string IsAvi(const std::string& name) {
  if (std::filesystem::path(name).extension() == ".avi") return {};
  return "'" + name + "' is not a video that can be written; expected a name like video.avi";
}

}  // namespace alidade::cli
