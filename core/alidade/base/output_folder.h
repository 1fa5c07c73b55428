// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/output_file.h"

namespace alidade::internal {

/// A folder that is there in full or not at all: it grows as `.NAME.partial-PID` next to its place,
/// and takes its name in Commit(). What is worth keeping of one that is never committed is
/// `NAME.failed-PID` in the end. It is locked meanwhile, so that nobody else writes to that name,
/// and so that what a killed process left can be told from what a living one is writing. A marker
/// file tells the hidden folders of this class from those of others, which it never touches.
class OutputFolder {
 public:
  /// Creates the partial folder, and the folders above it where they are missing. A link to a
  /// folder stands for that folder. Then removes the marked folders of dead processes, or renames
  /// those that are worth keeping, and puts back what one of them was replacing; an error leaves
  /// them as they are. Errors: kCannotCreate where `target` exists without `force`, holds anything
  /// that its own `files.txt` does not list, or is being written by another process; kIo.
  OutputFolder(const std::filesystem::path& target, bool force);
  /// Removes what was not committed, with the folders above it that were made for it; or calls it
  /// failed().
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Opens a new file; `name` may lie in a sub-folder, which is made. Errors: kCannotCreate, kIo.
  std::unique_ptr<OutputFile> Create(const std::string& name) const;
  void Write(const std::string& name, std::string_view text) const;
  /// Removes a file or sub-folder, where it is there.
  void Remove(const std::string& name) const;
  /// From now on what is in it is worth keeping, if it is not committed. Errors: kCannotCreate,
  /// kIo.
  void Keep();
  /// It is not any more.
  void Forget();
  bool kept() const { return keep_; }
  /// Where it then will be; "" where nothing is.
  std::filesystem::path failed() const;
  /// Gives it the name failed() at once, as it is; false where that cannot be done. Of another
  /// thread than the one that writes, which must not go on.
  bool Abandon() const;
  /// Where the files are for now.
  const std::filesystem::path& partial() const { return partial_; }
  /// The path of `name` as messages give it: in the folder's place.
  std::string Shown(const std::string& name) const { return (shown_ / name).string(); }
  /// Lists all that was written in `files.txt`, syncs it and moves it to its place; an old folder
  /// goes. The file `scratch`, of use to what is not committed alone, is not listed and goes last;
  /// "": there is none. Errors: kCannotCreate, kIo.
  void Commit(const std::string& scratch = {});

 private:
  /// Marked folders of dead processes.
  struct Leftovers {
    std::vector<std::filesystem::path> folders;
    std::filesystem::path lost;  ///< in one of them: what stood at the target; "": nothing did
  };

  void Discard();
  Leftovers FindLeftovers() const;
  void CleanUp(const Leftovers& leftovers) const;
  /// Refuses to replace what is at the target, or `lost`, which was.
  void CheckTarget(const std::filesystem::path& lost) const;
  /// Moves the old folder into a marked one, and returns that.
  std::filesystem::path MoveAway() const;
  void MakeParents();
  std::filesystem::path Sibling(const char* kind) const;
  /// The files and folders in it, at any depth, but for its marks and `scratch`.
  std::vector<std::string> Contents(const std::string& scratch) const;
  /// Writes the list of `names`, and syncs them with it.
  void ListAndSync(std::vector<std::string> names) const;

  std::filesystem::path shown_;   ///< as given
  std::filesystem::path target_;  ///< absolute, behind links
  std::filesystem::path partial_;
  std::vector<std::filesystem::path> made_;  ///< parents, the outermost first
  bool force_, keep_ = false;
  int lock_ = -1;  ///< of the partial folder
};

/// The folders `NAME.failed-PID` that runs to `target` left next to it, by name.
std::vector<std::filesystem::path> FailedFolders(const std::filesystem::path& target);

/// Removes the marks of a process that died right after `folder` had taken its name.
void RemoveMarks(const std::filesystem::path& folder);

}  // namespace alidade::internal
