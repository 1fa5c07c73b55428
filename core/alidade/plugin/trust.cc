// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/trust.h"

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/io/follow_links.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

class TrustCheck {
 public:
  explicit TrustCheck(const fs::path& file) : file_(file), owners_{0, geteuid()} {
    struct stat program;
    if (stat("/proc/self/exe", &program) == 0) owners_.push_back(program.st_uid);
  }

  /// Follows the path from the root folder. Checks each folder and link, and finally the file
  /// itself.
  void Run() {
    const auto visit = [&](const fs::path& folder, const fs::path& entry, bool is_last) {
      const struct stat status = Status(folder);
      CheckOwner(folder, status);
      CheckMode(folder, status, !is_last);
      CheckOwner(entry, Status(entry));
    };
    const fs::path target = internal::FollowLinks(file_, visit);
    if (target.empty()) {
      Fail(file_, "behind a symbolic link that cannot be read, or behind more than 40 links");
    }
    CheckMode(target, Status(target), false);
  }

 private:
  [[noreturn]] void Fail(const fs::path& path, const std::string& reason) const {
    const std::string subject = path == file_ ? "it is " : "'" + path.string() + "' is ";
    throw Error(ExitCode::kNotTrusted,
                ErrorLine({file_.string()}, {}, "not trusted: " + subject + reason));
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
    if (std::ranges::find(owners_, status.st_uid) != owners_.end()) return;
    const passwd* owner = getpwuid(status.st_uid);
    Fail(path, "owned by " +
                   (owner != nullptr ? std::string(owner->pw_name)
                                     : "user " + std::to_string(status.st_uid)) +
                   ", not by root, you or the owner of this program");
  }
  /// Returns true for the private group of the user: a primary group with the user's name and
  /// without other members. The group of root is not private, because in a container any user may
  /// belong to it.
  static bool IsPrivateGroup(gid_t id) {
    const uid_t user_id = geteuid();
    const passwd* const user = getpwuid(user_id);
    if (id == 0 || user == nullptr || user->pw_gid != id) return false;
    const std::string name = user->pw_name;
    const group* const entry = getgrgid(id);
    if (entry == nullptr || name != entry->gr_name) return false;
    for (char** member = entry->gr_mem; *member != nullptr; ++member) {
      if (name != *member) return false;
    }
    bool is_shared = false;  // true if another user has this primary group
    setpwent();
    while (const passwd* const other = getpwent()) {
      is_shared = is_shared || (other->pw_gid == id && other->pw_uid != user_id);
    }
    endpwent();
    return !is_shared;
  }
  void CheckMode(const fs::path& path, const struct stat& status, bool allows_sticky) const {
    if (allows_sticky && (status.st_mode & S_ISVTX) != 0) return;
    const char* writer = nullptr;
    if ((status.st_mode & S_IWOTH) != 0) {
      writer = "everyone";
    } else if ((status.st_mode & S_IWGRP) != 0 && !IsPrivateGroup(status.st_gid)) {
      writer = "its group";
    }
    if (writer == nullptr) return;
    Fail(path, std::string("writable by ") + writer + "; run 'chmod go-w " + path.string() + "'");
  }

  fs::path file_;
  std::vector<uid_t> owners_;
};

}  // namespace

void CheckTrusted(const fs::path& file) {
  if (!file.is_absolute()) {
    throw Error(ExitCode::kNotTrusted,
                ErrorLine({file.string()}, {}, "not trusted: a relative path", "an absolute path"));
  }
  TrustCheck(file).Run();
}

}  // namespace alidade
