// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/output_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <set>
#include <vector>

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

constexpr const char* kList = "files.txt";

[[noreturn]] void Refuse(const fs::path& path, const std::string& problem,
                         const std::string& remedy) {
  throw Error(ExitCode::kCannotCreate,
              ErrorLine(Place{path.string()}, {}, problem) + "; " + remedy);
}

bool Exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

/// Returns `target` without a trailing slash. If the last part is a link, `.` or `..`, returns the
/// folder to which it refers.
fs::path Normalised(const fs::path& target) {
  fs::path path = target.lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  std::error_code error;
  if (path.filename() == "." || path.filename() == ".." || fs::is_symlink(path, error)) {
    const fs::path real = fs::canonical(path, error);
    if (!error) path = real;
  }
  if (path.has_filename()) return path;
  throw Error(ExitCode::kCannotCreate,
              ErrorLine(Place{target.string()}, {}, "is not a valid folder name", "PATH/NAME"));
}

/// Returns the sorted names of all files and folders in `folder`, at any depth. Error: kIo.
std::set<std::string> Contents(const fs::path& folder) {
  std::set<std::string> names;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (const fs::recursive_directory_iterator end; !error && entry != end; entry.increment(error)) {
    names.insert(entry->path().lexically_relative(folder).string());
  }
  if (error) FailIo(folder.string(), "read", error.value());
  return names;
}

/// Returns the names in `folder` that `files.txt` does not list. If the name of a folder is
/// returned, the names of its contents are omitted.
std::vector<std::string> UnlistedNames(const fs::path& folder) {
  std::set<std::string> listed = {kList};
  std::vector<std::string> listed_folders;  // folders whose contents count as listed
  std::ifstream stream(folder / kList);
  for (std::string line; std::getline(stream, line);) {
    if (line.ends_with('/')) listed_folders.push_back(line);
    listed.insert(std::move(line));
  }
  std::vector<std::string> unlisted;
  for (const std::string& name : Contents(folder)) {
    const auto contains_name = [&](const std::string& parent) { return name.starts_with(parent); };
    if (listed.contains(name) || std::ranges::any_of(listed_folders, contains_name)) continue;
    if (unlisted.empty() || !name.starts_with(unlisted.back() + '/')) unlisted.push_back(name);
  }
  return unlisted;
}

/// Returns the first few names in quotes, for a message.
std::string FirstNames(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) {
    text.append(i > 0 ? ", '" : "'").append(names[i]).append("'");
  }
  if (names.size() > kShown) text += " and " + std::to_string(names.size() - kShown) + " more";
  return text;
}

/// Refuses to replace a folder that contains files that `files.txt` does not list.
void CheckListed(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) {
    Refuse(folder, "is a link to a missing file", "remove it, or choose another folder");
  }
  if (!fs::is_directory(folder, error)) Refuse(folder, "is a file", "choose another folder");
  const std::vector<std::string> foreign = UnlistedNames(folder);
  if (foreign.empty()) return;
  if (!Exists(folder / kList)) {
    Refuse(folder, std::string("is not a run folder (it does not contain ") + kList + ')',
           "--force replaces only run folders; remove this folder, or choose another folder");
  }
  Refuse(folder, "contains files that alidade did not write: " + FirstNames(foreign),
         "move them, or choose another folder");
}

}  // namespace

fs::path PartialOf(const fs::path& target) { return Normalised(target) += ".partial"; }

OutputFolder::OutputFolder(const fs::path& target, bool force, bool resume)
    : target_(Normalised(target)), partial_(fs::path(target_) += ".partial"), force_(force) {
  CheckTarget();
  std::error_code error;
  if (Exists(partial_)) {
    if (!force && !resume) {
      Refuse(partial_,
             "exists already: another command ended before it completed this folder, or is still "
             "running",
             "add --force to replace this folder, or remove it");
    }
    CheckListed(partial_);
    is_retained_ = resume;
    if (resume) {
      Open();
      return;
    }
    fs::remove_all(partial_, error);
  }
  if (!error && partial_.has_parent_path()) fs::create_directories(partial_.parent_path(), error);
  if (error) FailCreate(partial_.string(), error.value());
  if (::mkdir(partial_.c_str(), 0777) != 0) FailCreate(partial_.string(), errno);
  Open();
}

void OutputFolder::Open() {
  descriptor_ = ::open(partial_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0) FailCreate(partial_.string(), errno);
}

bool OutputFolder::exists() const {
  struct stat status {};
  return ::fstat(descriptor_, &status) == 0 && status.st_nlink > 0;
}

void OutputFolder::CheckTarget() const {
  if (!Exists(target_)) return;
  if (!force_) Refuse(target_, "exists already", "add --force to replace it");
  CheckListed(target_);
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (!is_retained_ && exists()) fs::remove_all(partial_, ignored);
  if (descriptor_ >= 0) ::close(descriptor_);
}

fs::path OutputFolder::Add(const std::string& name) const {
  const fs::path path = partial_ / name;
  OutputFile list(partial_ / kList, OutputFile::Mode::kAppend);
  for (fs::path parent = fs::path(name).parent_path(); !parent.empty();
       parent = parent.parent_path()) {
    list.Write(parent.string() + '\n');
  }
  list.Write(name + '\n');
  list.Close();  // closed first, so that a killed process leaves no unlisted file
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error) FailCreate(path.parent_path().string(), error.value());
  return path.has_filename() ? path : path.parent_path();
}

std::unique_ptr<OutputFile> OutputFolder::Create(const std::string& name) const {
  return std::make_unique<OutputFile>(Add(name), OutputFile::Mode::kReplace, max_delay_);
}

std::unique_ptr<OutputFile> OutputFolder::Append(const std::string& name) const {
  return std::make_unique<OutputFile>(Add(name), OutputFile::Mode::kAppend);
}

void OutputFolder::Write(const std::string& name, std::string_view text) const {
  const std::unique_ptr<OutputFile> file = Create(name);
  file->Write(text);
  file->Close();
}

void OutputFolder::Remove(const std::string& name) const {
  std::error_code ignored;
  fs::remove_all(partial_ / name, ignored);
}

void OutputFolder::Commit() {
  is_retained_ = true;
  if (!exists()) {
    Refuse(partial_, "was replaced by another command while this one wrote it",
           "write to another folder");
  }
  std::set<std::string> names = Contents(partial_);
  for (const std::string& foreign : UnlistedNames(partial_)) {
    std::erase_if(names, [&](const std::string& name) {
      return name == foreign || name.starts_with(foreign + '/');
    });
  }
  names.insert(kList);
  std::string list;
  for (const std::string& name : names) list += name + '\n';
  constexpr const char* kNewList = "files.txt.new";  // if the disk is full, the old list remains
  Write(kNewList, list);
  std::error_code error;
  fs::rename(partial_ / kNewList, partial_ / kList, error);
  if (error) FailIo((partial_ / kList).string(), "write", error.value());
  try {
    CheckTarget();
    fs::remove_all(target_, error);
    if (!error) fs::rename(partial_, target_, error);
    if (error) FailIo(target_.string(), "replace", error.value());
  } catch (const Error& e) {
    throw Error(e.code(), std::string(e.what()) + "; the new folder is " + partial_.string());
  }
}

}  // namespace alidade::internal
