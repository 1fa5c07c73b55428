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

  /// Walks from / to the file, checking each folder, link and at last the file itself.
  void Run() {
    const auto visit = [&](const fs::path& folder, const fs::path& entry, bool last) {
      const struct stat status = Status(folder);
      CheckOwner(folder, status);
      CheckMode(folder, status, !last);
      CheckOwner(entry, Status(entry));
    };
    const fs::path end = internal::FollowLinks(file_, visit);
    if (end.empty()) {
      Fail(file_, "behind a symbolic link that cannot be read, or more than 40 of them");
    }
    CheckMode(end, Status(end), false);
  }

 private:
  [[noreturn]] void Fail(const fs::path& path, const std::string& why) const {
    const std::string subject = path == file_ ? "it is " : "'" + path.string() + "' is ";
    throw Error(ExitCode::kNotTrusted,
                ErrorLine({file_.string()}, {}, "not trusted: " + subject + why));
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
  /// Whether it is the private group of the user: the primary group, of the user's name and
  /// without another member. The group of root is not, as any user may have it in a container.
  static bool IsPrivateGroup(gid_t id) {
    const uid_t own = geteuid();
    const passwd* const user = getpwuid(own);
    if (id == 0 || user == nullptr || user->pw_gid != id) return false;
    const std::string name = user->pw_name;
    const group* const found = getgrgid(id);
    if (found == nullptr || name != found->gr_name) return false;
    for (char** member = found->gr_mem; *member != nullptr; ++member) {
      if (name != *member) return false;
    }
    bool is_shared = false;  // the primary group of another user
    setpwent();
    while (const passwd* const other = getpwent()) {
      is_shared = is_shared || (other->pw_gid == id && other->pw_uid != own);
    }
    endpwent();
    return !is_shared;
  }
  void CheckMode(const fs::path& path, const struct stat& status, bool sticky_allowed) const {
    if (sticky_allowed && (status.st_mode & S_ISVTX) != 0) return;
    const char* writer = nullptr;
    if ((status.st_mode & S_IWOTH) != 0) {
      writer = "everyone";
    } else if ((status.st_mode & S_IWGRP) != 0 && !IsPrivateGroup(status.st_gid)) {
      writer = "its group";
    }
    if (writer == nullptr) return;
    Fail(path, std::string("writable for ") + writer + "; chmod go-w " + path.string());
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
