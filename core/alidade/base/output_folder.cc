// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/output_folder.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <climits>
#include <fstream>
#include <new>

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

constexpr const char* kList = "files.txt";
/// The file that marks a hidden folder as this program's; its first line names the process.
constexpr const char* kMarker = ".alidade";
/// The file in it that says that it is worth keeping.
constexpr const char* kKeep = ".keep";

std::string MarkerLine(std::string_view process) {
  return "alidade process " + std::string(process);
}

/// Holds the lock of a folder, where it can be had, until the end of its scope.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder)
      : fd_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    // This program holds it for milliseconds, but any other may for as long as it likes: it must
    // not hold up a run. Without the lock, which some file systems do not have either, the checks
    // race, the renames do not.
    constexpr int kTries = 100;
    constexpr useconds_t kPause_us = 10'000;
    for (int i = 0; fd_ >= 0 && i < kTries && ::flock(fd_, LOCK_EX | LOCK_NB) != 0; ++i) {
      if (errno != EWOULDBLOCK && errno != EINTR) break;
      ::usleep(kPause_us);
    }
  }
  ~FolderLock() {
    if (fd_ >= 0) ::close(fd_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

bool Exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

bool IsNumber(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == text.npos;
}

bool IsAlive(std::string_view process) {
  pid_t pid = 0;
  const char* const end = process.data() + process.size();
  const auto [rest, error] = std::from_chars(process.data(), end, pid);
  if (error != std::errc() || rest != end || pid <= 0) return false;
  return ::kill(pid, 0) == 0 || errno == EPERM;
}

/// True where this program made the folder, in `process`.
bool IsMarked(const fs::path& folder, std::string_view process) {
  std::error_code error;
  if (!fs::is_directory(fs::symlink_status(folder, error))) return false;
  if (!fs::is_regular_file(fs::symlink_status(folder / kMarker, error))) return false;
  std::ifstream stream(folder / kMarker);
  std::string line;
  return std::getline(stream, line) && line == MarkerLine(process);
}

/// True where `process` died before it could mark the folder that it had just made: it is empty, or
/// holds an empty marker alone.
bool IsBarelyMade(const fs::path& folder, std::string_view process) {
  std::error_code error;
  const bool is_folder = fs::is_directory(fs::symlink_status(folder, error));
  const bool own = process == std::to_string(::getpid());  // of one with the same number
  if (!is_folder || !IsNumber(process) || (IsAlive(process) && !own)) return false;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const bool marker = entry->path().filename() == kMarker && entry->is_regular_file(error) &&
                        fs::file_size(entry->path(), error) == 0;
    if (!marker) return false;
  }
  return !error;
}

/// True where a living process holds the folder, which `process` has made. On a file system
/// without locks it holds the folder as long as it lives.
bool IsHeld(const fs::path& folder, std::string_view process) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (fd < 0) return false;
  const bool locked = ::flock(fd, LOCK_EX | LOCK_NB) == 0;
  const int error = errno;
  ::close(fd);
  if (locked) return false;
  return error == EWOULDBLOCK || IsAlive(process);
}

[[noreturn]] void Refuse(const fs::path& path, std::string_view what,
                         std::string_view remedy = {}) {
  std::string text = ErrorLine(Place{path.string()}, {}, what);
  if (!remedy.empty()) text.append("; ").append(remedy);
  throw Error(ExitCode::kCannotCreate, text);
}

fs::path WithoutTrailingSlash(const fs::path& path) {
  std::error_code error;
  const fs::path normal = fs::absolute(path, error).lexically_normal();
  if (error == std::errc::not_enough_memory) throw std::bad_alloc();
  if (error) {
    Refuse(path, "the current folder is gone",
           "change to one that exists, or name the output by its full path");
  }
  constexpr std::size_t kRoom = 64;  // for `.partial-PID`, and the names of files
  if (normal.native().size() + kRoom >= PATH_MAX) FailCreate(path.string(), ENAMETOOLONG);
  return normal.has_filename() ? normal : normal.parent_path();
}

/// Where a link to something leads; anything else as it is.
fs::path BehindLinks(const fs::path& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  const fs::path real = fs::canonical(path, error);
  return error ? path : real;
}

/// Makes a hidden folder that later processes know as one of this process. Errors: those of an
/// OutputFile called `shown`.
void MakeMarked(const fs::path& folder, const std::string& shown) {
  if (Exists(folder)) Refuse(folder, "is in the way", "move it elsewhere");
  if (::mkdir(folder.c_str(), 0777) != 0) FailCreate(shown, errno);
  try {
    OutputFile marker(folder / kMarker, shown);
    marker.Write(MarkerLine(std::to_string(::getpid())) +
                 "\nIf this process died, the next run to the same place removes this folder.\n");
    marker.Close();
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    throw;
  }
}

constexpr const char* kFailed = ".failed-";

/// `NAME.failed-PROCESS`; where that is taken, as in a container, whose processes have the same
/// numbers each time, `NAME.failed-PROCESS-2` and so on.
fs::path FailedName(const fs::path& target, const std::string& process) {
  const fs::path name = target.string() + kFailed + process;
  fs::path free = name;
  for (int n = 2; Exists(free); ++n) free = name.string() + '-' + std::to_string(n);
  return free;
}

/// Whether `text` is what stands behind `NAME.failed-`.
bool IsFailedSuffix(std::string_view text) {
  const std::size_t dash = std::min(text.find('-'), text.size());
  return IsNumber(text.substr(0, dash)) && (dash == text.size() || IsNumber(text.substr(dash + 1)));
}

/// Gives a hidden folder that is worth keeping a name that can be seen.
void MakeFailed(const fs::path& folder, const fs::path& to) {
  std::error_code error;
  if (Exists(to)) return;
  fs::rename(folder, to, error);
  if (!error) RemoveMarks(to);
}

/// The lines of the list in a run folder, sorted as they were written; none where there is no list.
std::vector<std::string> ReadList(const fs::path& folder, std::error_code& error) {
  std::ifstream stream(folder / kList);
  if (!stream && errno != ENOENT) error.assign(errno, std::generic_category());
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// What lies in the folder but not on its list; a folder stands for all that is in it.
std::vector<std::string> Unlisted(const fs::path& folder, std::error_code& error) {
  const std::vector<std::string> listed = ReadList(folder, error);
  std::vector<std::string> found;
  if (error) return found;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().lexically_relative(folder).string();
    // A process that died right after Commit's rename leaves its marker.
    if (name == kMarker || name == kKeep || std::binary_search(listed.begin(), listed.end(), name))
      continue;
    found.push_back(name);
    entry.disable_recursion_pending();
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// The first few of the names, for a message.
std::string Few(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) {
    text.append(i > 0 ? ", '" : "'").append(names[i]).append("'");
  }
  if (names.size() > kShown) text += " and " + std::to_string(names.size() - kShown) + " more";
  return text;
}

}  // namespace

OutputFolder::OutputFolder(const fs::path& target, bool force)
    : shown_(target), target_(BehindLinks(WithoutTrailingSlash(target))), force_(force) {
  if (target.empty() || !target_.has_filename()) Refuse(target, "is not a name for a run folder");
  try {
    MakeParents();
    const FolderLock lock(target_.parent_path());
    const Leftovers leftovers = FindLeftovers();
    CheckTarget(leftovers.lost);
    CleanUp(leftovers);
    const fs::path partial = Sibling("partial");
    MakeMarked(partial, shown_.string());
    partial_ = partial;
    lock_ = ::open(partial_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock_ >= 0) static_cast<void>(::flock(lock_, LOCK_EX | LOCK_NB));
  } catch (...) {
    Discard();
    throw;
  }
}

OutputFolder::~OutputFolder() { Discard(); }

void OutputFolder::Discard() {
  std::error_code ignored;
  if (keep_ && !partial_.empty()) {
    try {
      MakeFailed(partial_, failed());
    } catch (const std::bad_alloc&) {
      // It stays as it is; the next run to this place gives it its name.
    }
    made_.clear();
  } else if (!partial_.empty()) {
    fs::remove_all(partial_, ignored);
  }
  partial_.clear();
  for (; !made_.empty(); made_.pop_back()) ::rmdir(made_.back().c_str());
  if (lock_ >= 0) ::close(lock_);
  lock_ = -1;
}

void OutputFolder::Keep() {
  OutputFile(partial_ / kKeep, shown_.string()).Close();
  keep_ = true;
}

void OutputFolder::Forget() {
  keep_ = false;
  std::error_code ignored;
  fs::remove(partial_ / kKeep, ignored);
}

fs::path OutputFolder::failed() const {
  if (!keep_ || partial_.empty()) return {};
  return FailedName(target_, std::to_string(::getpid()));
}

bool OutputFolder::Abandon() const {
  const fs::path name = failed();
  if (name.empty()) return false;
  MakeFailed(partial_, name);
  return Exists(name);
}

fs::path OutputFolder::Sibling(const char* kind) const {
  return target_.parent_path() /
         ('.' + target_.filename().string() + '.' + kind + '-' + std::to_string(::getpid()));
}

void OutputFolder::MakeParents() {
  std::vector<fs::path> missing;
  for (fs::path p = target_.parent_path(); !Exists(p) && p.has_relative_path();
       p = p.parent_path()) {
    missing.push_back(p);
  }
  for (; !missing.empty(); missing.pop_back()) {
    if (::mkdir(missing.back().c_str(), 0777) == 0) {
      made_.push_back(missing.back());
    } else if (errno != EEXIST) {
      FailCreate(missing.back().string(), errno);
    }
  }
}

OutputFolder::Leftovers OutputFolder::FindLeftovers() const {
  const std::string partial = '.' + target_.filename().string() + ".partial-";
  const std::string old = '.' + target_.filename().string() + ".old-";
  Leftovers found;
  std::error_code error;
  for (fs::directory_iterator entry(target_.parent_path(), error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const bool replaced = name.starts_with(old);
    if (!replaced && !name.starts_with(partial)) continue;
    const std::string process = name.substr((replaced ? old : partial).size());
    if (!IsMarked(entry->path(), process) && !IsBarelyMade(entry->path(), process)) continue;
    if (IsHeld(entry->path(), process)) {
      Refuse(shown_, "process " + process + " is writing it now",
             "wait for it or choose another folder");
    }
    const fs::path whole = entry->path() / target_.filename();
    if (replaced && found.lost.empty() && !Exists(target_) && Exists(whole)) found.lost = whole;
    found.folders.push_back(entry->path());
  }
  return found;
}

void OutputFolder::CleanUp(const Leftovers& leftovers) const {
  if (!leftovers.lost.empty() && ::rename(leftovers.lost.c_str(), target_.c_str()) != 0) {
    FailIo(shown_.string(), "restore", errno);
  }
  std::error_code ignored;
  for (const fs::path& folder : leftovers.folders) {
    const std::string name = folder.filename().string();
    if (Exists(folder / kKeep)) {
      const std::string process = name.substr(name.rfind('-') + 1);
      MakeFailed(folder, FailedName(target_, process));
    } else {
      fs::remove_all(folder, ignored);
    }
  }
}

void OutputFolder::CheckTarget(const fs::path& lost) const {
  if (!lost.empty() && !force_) {
    Refuse(shown_,
           "a process died while it replaced it: the old folder is '" + lost.string() + '\'',
           "move that back, or add --force to replace it");
  }
  const fs::path there = lost.empty() ? target_ : lost;
  if (!Exists(there)) return;
  std::error_code error;
  if (!fs::exists(there, error)) {
    Refuse(shown_, "is a link to what does not exist", "remove it, or choose another folder");
  }
  if (!force_) Refuse(shown_, "exists already", "add --force to replace it");
  if (!fs::is_directory(there, error)) Refuse(shown_, "is a file", "choose another folder");
  const std::vector<std::string> foreign = Unlisted(there, error);
  if (error) Refuse(shown_, "cannot be read: " + error.message(), "choose another folder");
  if (foreign.empty()) return;
  if (!Exists(there / kList)) {
    Refuse(shown_, std::string("is not a run folder (it has no ") + kList + ')',
           "--force replaces run folders only; remove it yourself, or choose another folder");
  }
  Refuse(shown_, "holds what was not written with it: " + Few(foreign),
         "move that elsewhere, or choose another folder");
}

std::unique_ptr<OutputFile> OutputFolder::Create(const std::string& name) const {
  const fs::path file = partial_ / name;
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error) FailCreate(Shown(fs::path(name).parent_path().string()), error.value());
  return std::make_unique<OutputFile>(file, Shown(name));
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

std::vector<std::string> OutputFolder::Contents(const std::string& scratch) const {
  std::vector<std::string> names;
  std::error_code error;
  fs::recursive_directory_iterator entry(partial_, error);
  for (const fs::recursive_directory_iterator end; !error && entry != end; entry.increment(error)) {
    std::string name = entry->path().lexically_relative(partial_).string();
    if (name != kMarker && name != kKeep && name != scratch) names.push_back(std::move(name));
  }
  if (error) FailIo(shown_.string(), "read", error.value());
  return names;
}

void OutputFolder::ListAndSync(std::vector<std::string> names) const {
  names.push_back(kList);
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& name : names) text += name + '\n';
  Write(kList, text);
  for (const std::string& name : names) Sync(partial_ / name, Shown(name));
  Sync(partial_, shown_.string());
}

void OutputFolder::Commit(const std::string& scratch) {
  ListAndSync(Contents(scratch));
  const FolderLock lock(target_.parent_path());
  CheckTarget({});
  const fs::path old = Exists(target_) ? MoveAway() : fs::path();
  if (!scratch.empty()) Remove(scratch);
  std::error_code ignored;
  if (::rename(partial_.c_str(), target_.c_str()) != 0) {
    const int error = errno;
    if (!old.empty() && ::rename((old / target_.filename()).c_str(), target_.c_str()) == 0) {
      fs::remove_all(old, ignored);
    }
    FailIo(shown_.string(), "move to its place", error);
  }
  partial_.clear();
  made_.clear();
  RemoveMarks(target_);
  Sync(target_.parent_path(), shown_.string());
  if (!old.empty()) fs::remove_all(old, ignored);
}

fs::path OutputFolder::MoveAway() const {
  const fs::path old = Sibling("old");
  MakeMarked(old, shown_.string());
  if (::rename(target_.c_str(), (old / target_.filename()).c_str()) != 0) {
    const int error = errno;
    std::error_code ignored;
    fs::remove_all(old, ignored);
    FailIo(shown_.string(), "replace", error);
  }
  return old;
}

std::vector<fs::path> FailedFolders(const fs::path& target) {
  const fs::path place = BehindLinks(WithoutTrailingSlash(target));
  const std::string start = place.filename().string() + kFailed;
  std::vector<fs::path> folders;
  std::error_code error;
  for (fs::directory_iterator entry(place.parent_path(), error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(start) || !IsFailedSuffix(std::string_view(name).substr(start.size())))
      continue;
    std::error_code ignored;
    if (fs::is_directory(entry->symlink_status(ignored))) folders.push_back(entry->path());
  }
  std::ranges::sort(folders);
  return folders;
}

void RemoveMarks(const fs::path& folder) {
  std::error_code ignored;
  fs::remove(folder / kMarker, ignored);
  fs::remove(folder / kKeep, ignored);
}

}  // namespace alidade::internal
