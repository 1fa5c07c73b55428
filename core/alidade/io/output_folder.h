// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "alidade/io/output_file.h"

namespace alidade::internal {

/// Output folder `NAME` that appears atomically. Files are written to the adjacent `NAME.partial`,
/// which Commit() renames. `files.txt` lists the files of the folder; no other file is ever
/// removed.
class OutputFolder {
 public:
  /// Creates `NAME.partial`, and its parent folders. If `target` is a link to a folder, NAME is
  /// that folder. With `force`, an existing `NAME.partial` is replaced now, and an existing NAME is
  /// replaced in Commit().
  /// With `resume`, an existing `NAME.partial` is continued. Errors: kIo; kCannotCreate if one of
  /// the two folders exists without the option that permits it, or contains a file that its
  /// `files.txt` does not list.
  OutputFolder(const std::filesystem::path& target, bool force, bool resume = false);
  /// Removes `NAME.partial` unless it was committed or Retain() was called.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Adds `name` to the list, for a file that other code will write. A name that ends in `/` means
  /// a folder and all its future contents. Creates the parent folders. Returns the path of the
  /// file. Errors: kCannotCreate, kIo.
  std::filesystem::path Add(const std::string& name) const;
  /// Sets the longest time after which a written row reaches a file that is created later.
  void SetMaxDelay(std::chrono::milliseconds max_delay) { max_delay_ = max_delay; }
  /// Creates or replaces a file. Errors: kCannotCreate, kIo.
  std::unique_ptr<OutputFile> Create(const std::string& name) const;
  /// Opens a file to append to it. Errors: kCannotCreate, kIo.
  std::unique_ptr<OutputFile> Append(const std::string& name) const;
  /// Writes a whole file. Errors: kCannotCreate, kIo.
  void Write(const std::string& name, std::string_view text) const;
  /// Removes a file or folder, if it exists.
  void Remove(const std::string& name) const;
  /// Declares that `NAME.partial` contains results. The destructor then retains the folder.
  void Retain() { is_retained_ = true; }
  /// Returns the path of `NAME.partial`.
  const std::filesystem::path& partial() const { return partial_; }
  /// Lists all files in `files.txt`, removes an existing NAME and renames the folder. Errors:
  /// kCannotCreate, kIo; `NAME.partial` is then retained.
  void Commit();

 private:
  /// Fails if NAME exists and must not be replaced.
  void CheckTarget() const;
  /// Opens a descriptor of `NAME.partial`. exists() uses the descriptor to detect that another
  /// command has removed the folder.
  void Open();
  bool exists() const;

  std::filesystem::path target_, partial_;
  int descriptor_ = -1;  ///< descriptor of `NAME.partial`
  bool force_, is_retained_ = false;
  std::chrono::milliseconds max_delay_ = OutputFile::kMaxDelay;
};

/// Returns the path of an incomplete folder: `NAME.partial`.
std::filesystem::path PartialOf(const std::filesystem::path& target);

}  // namespace alidade::internal
