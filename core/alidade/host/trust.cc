// SPDX-License-Identifier: Apache-2.0
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "alidade/base/follow_links.h"
#include "alidade/host/plugin_host.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

class TrustCheck {
 public:
  explicit TrustCheck(const fs::path& file) : file_(file) {
    owners_ = {0, geteuid()};
    struct stat program;
    if (stat("/proc/self/exe", &program) == 0) owners_.push_back(program.st_uid);
  }

  /// Walks from / to the file, checking each folder, link and at last the file itself.
  void Run() {
    const auto visit = [this](const fs::path& folder, const fs::path& entry, bool last) {
      CheckFolder(folder, last);
      CheckOwner(entry, Status(entry));
    };
    const fs::path end = internal::FollowLinks(file_, visit);
    if (end.empty()) {
      Fail(file_, "behind a symbolic link that cannot be read, or more than 40 of them");
    }
    CheckMode(end, Status(end), false);
  }

 private:
  [[noreturn]] void Fail(const fs::path& where, const std::string& why) const {
    const std::string what = where == file_ ? "it is " : "'" + where.string() + "' is ";
    throw Error(ExitCode::kNotTrusted,
                ErrorLine({file_.string()}, {}, "not trusted: " + what + why));
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

  fs::path file_;
  std::vector<uid_t> owners_;
};

}  // namespace

void CheckTrusted(const fs::path& file) {
  if (!file.is_absolute()) {
    throw Error(ExitCode::kNotTrusted,
                ErrorLine({file.string()}, {}, "not trusted: a relative path", "an absolute one"));
  }
  TrustCheck(file).Run();
}

}  // namespace alidade
