// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/follow_links.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using internal::FollowLinks;
using testing::TemporaryFolder;

TEST(FollowLinks, LeadsToWhatIsThereOrIsNot) {
  const TemporaryFolder temporary;
  const fs::path folder = fs::canonical(temporary.path());
  fs::create_directories(folder / "a/b");
  fs::create_directory_symlink("a/b", folder / "relative");
  fs::create_directory_symlink(folder / "a", folder / "absolute");
  fs::create_symlink("nothing", folder / "dangling");
  EXPECT_EQ(FollowLinks(folder / "a/./b/"), folder / "a/b");
  EXPECT_EQ(FollowLinks(folder / "relative/../x"),
            folder / "a/x");  // As in the kernel, `..` applies to the target of the link.
  EXPECT_EQ(FollowLinks(folder / "absolute/b"), folder / "a/b");
  EXPECT_EQ(FollowLinks(folder / "dangling"), folder / "nothing");
}

TEST(FollowLinks, EndlessLinksLeadNowhere) {
  const TemporaryFolder folder;
  fs::create_symlink("loop", folder / "loop");
  EXPECT_EQ(FollowLinks(folder / "loop"), "");
}

TEST(FollowLinks, ShowsEveryEntryWithItsFolder) {
  const TemporaryFolder temporary;
  const fs::path folder = fs::canonical(temporary.path());
  fs::create_directory(folder / "a");
  fs::create_symlink("a/file", folder / "link");
  std::vector<std::string> seen;
  FollowLinks(folder / "link", [&](const fs::path& in, const fs::path& entry, bool last) {
    EXPECT_EQ(entry.parent_path(), in);
    if (in.string().starts_with(folder.string())) {
      seen.push_back(entry.lexically_relative(folder).string() + (last ? " last" : ""));
    }
  });
  EXPECT_EQ(seen, (std::vector<std::string>{"link last", "a", "a/file last"}));
}

}  // namespace
}  // namespace alidade
