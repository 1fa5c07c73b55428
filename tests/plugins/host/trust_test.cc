// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/trust.h"

#include <grp.h>
#include <pwd.h>
#include <unistd.h>

#include <fstream>

#include "host_fixture.h"
#include "support/recording.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr uid_t kStranger = 54321;
constexpr std::size_t npos = std::string::npos;

/// Tests that the host does not open a plugin that another user could have written. This is fault
/// 70 of tests/faults/README.md.
class TrustTest : public HostTest {
 protected:
  static void Allow(const fs::path& path, fs::perms who) {
    fs::permissions(path, who, fs::perm_options::add);
  }
  void ExpectNotTrusted(const fs::path& file, const std::string& why) const {
    ExpectRefused(file, {"not trusted", why}, ExitCode::kNotTrusted);
  }
};

TEST_F(TrustTest, AFileThatOthersCanWrite) {
  const fs::path file = Copy("good", "good.so");
  EXPECT_NO_THROW(CheckTrusted(file));
  Allow(file, fs::perms::others_write);
  ExpectNotTrusted(file, "it is writable by everyone");
}

TEST_F(TrustTest, AFileThatAGroupCanWrite) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can change the group of a file";
  // The user www-data has a private group, as users of Ubuntu do.
  const passwd* const user = getpwnam("www-data");
  if (user == nullptr) GTEST_SKIP() << "the user www-data does not exist";
  const uid_t id = user->pw_uid;
  const gid_t own = user->pw_gid;
  const fs::path file = Copy("good", "a/good.so");
  Allow(file, fs::perms::group_write);
  Allow(folder_ / "a", fs::perms::group_write);
  Allow(folder_.path(), fs::perms::others_exec | fs::perms::group_exec);
  const auto trusted = [&](gid_t of_folder, gid_t of_file) {
    EXPECT_EQ(chown((folder_ / "a").c_str(), id, of_folder), 0);
    EXPECT_EQ(chown(file.c_str(), id, of_file), 0);
    EXPECT_EQ(seteuid(id), 0);
    std::string error;
    try {
      CheckTrusted(file);
    } catch (const Error& e) {
      error = e.what();
    }
    EXPECT_EQ(seteuid(0), 0);
    return error;
  };
  EXPECT_EQ(trusted(own, own), "") << "a private group may write, as with `umask 002`";
  EXPECT_NE(trusted(own, kStranger).find("it is writable by its group; run 'chmod go-w"), npos);
  EXPECT_NE(trusted(kStranger, own).find("' is writable by its group"), npos);
  EXPECT_NE(trusted(own, 0).find("it is writable by its group"), npos)
      << "the group of root is not private";
}

TEST_F(TrustTest, AFolderThatOthersCanWrite) {
  const fs::path file = Copy("good", "a/b/good.so");
  Allow(folder_ / "a", fs::perms::others_write);
  ExpectNotTrusted(file, "'" + (folder_ / "a").string() + "' is writable by everyone");
  Allow(folder_ / "a", fs::perms::sticky_bit);
  EXPECT_NO_THROW(CheckTrusted(file))
      << "as in /tmp, other users cannot replace files in this folder";
  Allow(folder_ / "a/b", fs::perms::others_write | fs::perms::sticky_bit);
  ExpectNotTrusted(file, "'" + (folder_ / "a/b").string() + "' is writable by everyone");
}

TEST_F(TrustTest, ARelativePath) {
  ExpectRefused("good.so", {"not trusted", "a relative path"}, ExitCode::kNotTrusted);
  ExpectError(ExitCode::kNotTrusted, {"a relative path"}, [] { CheckTrusted("a/good.so"); });
}

TEST_F(TrustTest, ALinkToWhatOthersCanWrite) {
  const fs::path file = Copy("good", "open/good.so");
  fs::create_symlink(file, folder_ / "link.so");
  fs::create_directory_symlink(folder_ / "open", folder_ / "link_to_folder");
  EXPECT_NO_THROW(CheckTrusted(folder_ / "link.so"));
  EXPECT_NO_THROW(CheckTrusted(folder_ / "link_to_folder/good.so"));
  Allow(folder_ / "open", fs::perms::others_write);
  ExpectNotTrusted(folder_ / "link.so", "writable by everyone");
  ExpectNotTrusted(folder_ / "link_to_folder/good.so", "writable by everyone");
}

TEST_F(TrustTest, AFolderThatIsLeftAgainCounts) {
  Copy("good", "good.so");
  fs::create_directory(folder_ / "open");
  Allow(folder_ / "open", fs::perms::others_write);
  fs::create_directory(folder_ / "open/deeper");
  ExpectNotTrusted(folder_ / "open/deeper/../../good.so", "writable by everyone");
}

TEST_F(TrustTest, EndlessLinks) {
  fs::create_symlink(folder_ / "b.so", folder_ / "a.so");
  fs::create_symlink(folder_ / "a.so", folder_ / "b.so");
  ExpectError(ExitCode::kNotTrusted,
              {"symbolic link that cannot be read, or behind more than 40 links"},
              [&] { CheckTrusted(folder_ / "a.so"); });
}

TEST_F(TrustTest, AForeignOwner) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can change the owner of a file";
  const fs::path file = Copy("good", "a/good.so");
  ASSERT_EQ(chown(file.c_str(), kStranger, 0), 0);
  ExpectNotTrusted(file, "owned by user 54321, not by root, you or the owner of this program");
  ASSERT_EQ(chown(file.c_str(), 0, 0), 0);
  ASSERT_EQ(chown((folder_ / "a").c_str(), kStranger, 0), 0);
  ExpectNotTrusted(file, "'" + (folder_ / "a").string() + "' is owned by user 54321");
  ASSERT_EQ(chown((folder_ / "a").c_str(), 0, 0), 0);
  fs::create_symlink(file, folder_ / "link.so");
  ASSERT_EQ(lchown((folder_ / "link.so").c_str(), kStranger, 0), 0);
  ExpectNotTrusted(folder_ / "link.so", "owned by user 54321");
}

TEST_F(TrustTest, InADefaultPlaceItIsToldWhenItsModelIsMissed) {
  const fs::path file = Copy("good", "path/good.so");
  Allow(file, fs::perms::others_write);
  setenv("ALIDADE_PLUGIN_PATH", (folder_ / "path").c_str(), 1);
  const PluginHost host;
  ASSERT_EQ(host.refusals().size(), 1u);
  EXPECT_EQ(host.refusals()[0].code, ExitCode::kNotTrusted);
  EXPECT_EQ(host.refusals()[0].file, file);
  const Config config = Parse("model: probe");
  ExpectError(ExitCode::kNotTrusted, {file.string(), "not trusted", "writable by everyone"},
              [&] { host.CreateSensor("probe", config.root()); });
  const Config stereo = Parse("{model: s, focal_px: 1, baseline_m: 1, sigma_px: 1}");
  EXPECT_NO_THROW(host.CreateSensor("stereo_disparity", stereo.root()));
}

TEST_F(TrustTest, ARelativePlaceOfTheEnvironmentIsNotSearched) {
  setenv("ALIDADE_PLUGIN_PATH", ".", 1);
  const fs::path before = fs::current_path();
  std::ofstream(folder_ / "no_plugin.so") << "refused because of its place, before it is read";
  fs::current_path(folder_.path());
  const PluginHost host;
  fs::current_path(before);
  ASSERT_EQ(host.refusals().size(), 1u);
  EXPECT_EQ(host.refusals()[0].code, ExitCode::kNotTrusted);
}

}  // namespace
}  // namespace alidade
