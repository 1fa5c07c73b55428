// SPDX-License-Identifier: Apache-2.0
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "alidade/base/follow_links.h"
#include "alidade/host/needed_libraries.h"
#include "alidade/host/plugin_host.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

class TrustCheck {
 public:
  /// Of `file`. A library that a plugin needs is `subject`'s, as `because` says, and may not be
  /// there: then nobody else may put it there.
  explicit TrustCheck(const fs::path& file) : TrustCheck(file, file, "", false) {}
  TrustCheck(const fs::path& file, fs::path subject, std::string because, bool may_lack)
      : file_(file),
        subject_(std::move(subject)),
        because_(std::move(because)),
        may_lack_(may_lack) {
    owners_ = {0, geteuid()};
    struct stat program;
    if (stat("/proc/self/exe", &program) == 0) owners_.push_back(program.st_uid);
  }

  /// Walks from / to the file, checking each folder, link and at last the file itself.
  void Run() {
    bool lacks = false;
    const auto visit = [&](const fs::path& folder, const fs::path& entry, bool last) {
      if (lacks) return;
      std::error_code error;
      lacks = may_lack_ && !fs::exists(fs::symlink_status(entry, error));
      CheckFolder(folder, last || lacks);
      if (!lacks) CheckOwner(entry, Status(entry));
    };
    const fs::path end = internal::FollowLinks(file_, visit);
    if (lacks) return;
    if (end.empty()) {
      Fail(file_, "behind a symbolic link that cannot be read, or more than 40 of them");
    }
    CheckMode(end, Status(end), false);
  }

 private:
  [[noreturn]] void Fail(const fs::path& where, const std::string& why) const {
    const std::string what = where == subject_ ? "it is " : "'" + where.string() + "' is ";
    throw Error(ExitCode::kNotTrusted,
                ErrorLine({subject_.string()}, {}, "not trusted: " + because_ + what + why));
  }
  struct stat Status(const fs::path& path) const {
    struct stat status;
    if (lstat(path.c_str(), &status) != 0) {
      const ExitCode code = errno == EACCES ? ExitCode::kNotTrusted : ExitCode::kPlugin;
      throw Error(code, ErrorLine({path.string()}, {}, std::strerror(errno)));
    }
    return status;
  }
  void CheckOwner(const fs::path& path, const struct stat& status) const {
    if (std::find(owners_.begin(), owners_.end(), status.st_uid) != owners_.end()) return;
    const passwd* owner = getpwuid(status.st_uid);
    Fail(path, "owned by " +
                   (owner != nullptr ? std::string(owner->pw_name)
                                     : "user " + std::to_string(status.st_uid)) +
                   ", not by root, you or the owner of this program");
  }
  void CheckMode(const fs::path& path, const struct stat& status, bool sticky_allowed) const {
    if (sticky_allowed && (status.st_mode & S_ISVTX) != 0) return;
    const char* who = (status.st_mode & S_IWOTH) != 0   ? "everyone"
                      : (status.st_mode & S_IWGRP) != 0 ? "its group"
                                                        : nullptr;
    if (who != nullptr) {
      Fail(path, std::string("writable for ") + who + "; chmod go-w " + path.string());
    }
  }
  void CheckFolder(const fs::path& folder, bool holds_the_file) const {
    const struct stat status = Status(folder);
    CheckOwner(folder, status);
    CheckMode(folder, status, !holds_the_file);
  }

  fs::path file_, subject_;
  std::string because_;
  bool may_lack_;
  std::vector<uid_t> owners_;
};

}  // namespace

void internal::CheckTrustedNeed(const fs::path& plugin, const std::string& name,
                                const fs::path& place) {
  const std::string because = "it needs the library '" + name + "', and ";
  if (!place.is_absolute()) {
    // CMake ends the RUNPATH of a build tree with a colon: the current folder, mostly for nothing.
    std::error_code error;
    if (!fs::exists(place, error)) return;
    throw Error(ExitCode::kNotTrusted,
                ErrorLine({plugin.string()}, {},
                          "not trusted: " + because + "takes it from the current folder, '" +
                              place.string() + "'",
                          "an absolute path or $ORIGIN in its RUNPATH"));
  }
  TrustCheck(place, plugin, because, true).Run();
}

void CheckTrusted(const fs::path& file) {
  if (!file.is_absolute()) {
    throw Error(ExitCode::kNotTrusted,
                ErrorLine({file.string()}, {}, "not trusted: a relative path", "an absolute one"));
  }
  TrustCheck(file).Run();
}

}  // namespace alidade
