// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/io/output_file.h"

namespace alidade::internal {

/// Video file that has the name `NAME.partial.avi` until it is complete. It is then renamed to its
/// final name in the same folder.
class PartialFile {
 public:
  PartialFile(std::filesystem::path file, bool force)
      : file_(std::move(file)),
        partial_(file_.parent_path() / (file_.stem().string() + ".partial.avi")) {
    std::error_code ignored;
    for (const std::filesystem::path& path : {file_, partial_}) {
      if (force || !std::filesystem::exists(path, ignored)) continue;
      throw Error(ExitCode::kCannotCreate,
                  ErrorLine({path.string()}, {}, "the file exists; --force replaces it"));
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
  /// Renames the file to its final name. An empty file is removed.
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
