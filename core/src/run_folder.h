// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "output_file.h"

namespace alidade::internal {

/// A folder that is there in full or not at all: it grows as `.NAME.partial-PID` beside its place,
/// and takes its name in Commit(). It is locked meanwhile, so that nobody else writes to that name,
/// and so that what a killed process left can be told from what a living one is writing.
class RunFolder {
 public:
  /// Creates the partial folder, and the folders above it where they are missing. Removes partial
  /// folders of dead processes. Errors: kCannotCreate where `target` exists without `force`, holds
  /// anything that its own `files.txt` does not list, or is being written by another process; kIo.
  RunFolder(const std::filesystem::path& target, bool force);
  /// Removes what was not committed, with the folders above it that were made for it.
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// Opens a new file; `name` may lie in a sub-folder, which is made. Errors: kCannotCreate, kIo.
  std::unique_ptr<OutputFile> Create(const std::string& name) const;
  void Write(const std::string& name, std::string_view text) const;
  /// Where the files are for now.
  const std::filesystem::path& partial() const { return partial_; }
  /// The path of `name` as messages give it: in the folder's place.
  std::string Shown(const std::string& name) const { return (shown_ / name).string(); }
  /// Lists all that was written in `files.txt`, syncs it and moves it to its place; an old folder
  /// goes. Errors: kCannotCreate, kIo.
  void Commit();

 private:
  void Discard();
  void CheckTarget() const;
  void MakeParents();
  void RemoveLeftovers() const;
  std::filesystem::path Sibling(const char* kind) const;
  void WriteList() const;
  void SyncAll() const;

  std::filesystem::path shown_;   ///< as given
  std::filesystem::path target_;  ///< absolute
  std::filesystem::path partial_;
  std::vector<std::filesystem::path> made_;  ///< parents, the outermost first
  bool force_;
  int lock_ = -1;  ///< of the partial folder
};

}  // namespace alidade::internal
