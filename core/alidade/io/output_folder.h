// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "alidade/io/output_file.h"

namespace alidade::internal {

/// A folder `NAME` that exists only if it is complete: its files are written to `NAME.partial` next
/// to it, which Commit() renames. `files.txt` lists the files of the folder; no other file is ever
/// removed.
class OutputFolder {
 public:
  /// Creates `NAME.partial`, and the folders above it. If `target` is a link to a folder, NAME is
  /// that folder. With `force`, an existing `NAME.partial` is replaced now and NAME in Commit();
  /// with `resume`, an existing `NAME.partial` stays as it is. Errors: kCannotCreate if one of them
  /// exists otherwise, or holds a file that its `files.txt` does not list; kIo.
  OutputFolder(const std::filesystem::path& target, bool force, bool resume = false);
  /// Removes `NAME.partial` unless it was committed or Keep() was called.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Lists a file that something else writes, or a folder, whose name ends in `/`, with all that it
  /// will hold. Creates the folders above it and returns its path. Errors: kCannotCreate, kIo.
  std::filesystem::path Add(const std::string& name) const;
  /// Opens a new file, or one to be replaced. Errors: kCannotCreate, kIo.
  std::unique_ptr<OutputFile> Create(const std::string& name) const;
  /// Opens a file at its end. Errors: kCannotCreate, kIo.
  std::unique_ptr<OutputFile> Append(const std::string& name) const;
  /// Errors: kCannotCreate, kIo.
  void Write(const std::string& name, std::string_view text) const;
  /// Removes a file or folder, if it exists.
  void Remove(const std::string& name) const;
  /// From now on `NAME.partial` stays even if it is not committed, because it holds results.
  void Keep() { keep_ = true; }
  /// `NAME.partial`
  const std::filesystem::path& partial() const { return partial_; }
  /// Lists all files in `files.txt` and renames the folder; an existing NAME is removed before.
  /// Errors: kCannotCreate, kIo, and `NAME.partial` stays.
  void Commit();

 private:
  /// Refuses to replace NAME.
  void CheckTarget() const;
  /// Keeps a descriptor of `NAME.partial`, which knows if another command removes the folder.
  void Open();
  bool exists() const;

  std::filesystem::path target_, partial_;
  int descriptor_ = -1;  ///< of `NAME.partial`
  bool force_, keep_ = false;
};

/// The place of a folder until it is complete: `NAME.partial`.
std::filesystem::path PartialOf(const std::filesystem::path& target);

}  // namespace alidade::internal
