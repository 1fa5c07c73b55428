// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/output_file.h"

namespace alidade::internal {

/// A video that exists only if it is complete: it grows as `NAME.partial.avi` next to its place.
class PartialFile {
 public:
  PartialFile(std::filesystem::path file, bool force)
      : file_(std::move(file)),
        partial_(file_.parent_path() / (file_.stem().string() + ".partial.avi")) {
    std::error_code ignored;
    if (!force && std::filesystem::exists(file_, ignored)) {
      throw Error(ExitCode::kCannotCreate,
                  ErrorLine({file_.string()}, {}, "is there; --force replaces it"));
    }
    errno = 0;
    if (!std::ofstream(partial_)) internal::FailCreate(file_.string(), errno);
  }
  ~PartialFile() {
    std::error_code ignored;
    std::filesystem::remove(partial_, ignored);
  }
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::filesystem::path& partial() const { return partial_; }
  void Commit() const {
    std::error_code error;
    std::filesystem::rename(partial_, file_, error);
    if (error) internal::FailCreate(file_.string(), error.value());
  }

 private:
  std::filesystem::path file_, partial_;
};

}  // namespace alidade::internal
