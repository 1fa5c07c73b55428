// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/near_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "support/temporary_folder.h"

namespace alidade::internal {
namespace {

class NearFileTest : public ::testing::Test {
 protected:
  void Write(const std::string& name) const { std::ofstream(folder_ / name) << "text"; }

  testing::TemporaryFolder folder_;
};

TEST_F(NearFileTest, HasTheSameExtensionAndASimilarName) {
  Write("depth.yaml");
  Write("detph.csv");
  std::filesystem::create_directory(folder_ / "detph2.yaml");
  EXPECT_EQ(NearFile(folder_ / "detph.yaml"), (folder_ / "depth.yaml").string());
  EXPECT_EQ(NearFile(folder_ / "depth.yaml"), "");  // exists
  EXPECT_EQ(NearFile(folder_ / "camera.yaml"), "");
  EXPECT_EQ(NearFile(folder_ / "depth.json"), "");
  EXPECT_EQ(NearFile(folder_ / "missing/depth.yaml"), "");
}

TEST_F(NearFileTest, ConfigOfAFolder) {
  EXPECT_EQ(ConfigIn(folder_.path()), "");
  Write("config.yaml");
  EXPECT_EQ(ConfigIn(folder_.path()), (folder_ / "config.yaml").string());
}

}  // namespace
}  // namespace alidade::internal
