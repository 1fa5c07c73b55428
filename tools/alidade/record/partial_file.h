// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/io/output_file.h"

namespace alidade::internal {

/// A video that exists only if it is complete: it grows as `NAME.partial.avi` next to its place.
class PartialFile {
 public:
  PartialFile(std::filesystem::path file, bool force)
      : file_(std::move(file)),
        partial_(file_.parent_path() / (file_.stem().string() + ".partial.avi")) {
    std::error_code ignored;
    for (const std::filesystem::path& place : {file_, partial_}) {
      if (force || !std::filesystem::exists(place, ignored)) continue;
      throw Error(ExitCode::kCannotCreate,
                  ErrorLine({place.string()}, {}, "is there; --force replaces it"));
    }
    OutputFile(partial_).Close();
  }
  ~PartialFile() {
    std::error_code ignored;
    std::filesystem::remove(partial_, ignored);
  }
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::filesystem::path& partial() const { return partial_; }
  /// Leaves no file if nothing was written.
  void Commit() const {
    std::error_code error;
    if (std::filesystem::file_size(partial_, error) == 0) return;
    std::filesystem::rename(partial_, file_, error);
    if (error) internal::FailCreate(file_.string(), error.value());
  }

 private:
  std::filesystem::path file_, partial_;
};

}  // namespace alidade::internal
