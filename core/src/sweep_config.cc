// SPDX-License-Identifier: Apache-2.0
#include "sweep_config.h"

#include <filesystem>
#include <optional>
#include <system_error>

namespace alidade::internal {

Config Copy(const Config& config) { return config.Merged(Config::FromText("{}", "sweep").root()); }

void CheckReadableAgain(const Config& config) {
  const Config copy = Copy(config);
  const auto source = copy.root().Find("source");
  const auto path = source && source->is_map() ? source->Find("path") : std::nullopt;
  if (!path || path->kind() != Node::Kind::kScalar) return;
  std::error_code error;
  const auto status = std::filesystem::status(config.folder() / path->Text(), error);
  const bool file =
      !std::filesystem::exists(status) || is_regular_file(status) || is_directory(status);
  if (path->Text() != "-" && file) return;
  path->Fail("'" + path->Text() + "' can be read once, but a sweep reads it for every run",
             "a regular file");
}

}  // namespace alidade::internal
