// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade::testing {

/// Base class for tests of an example on real drives. The test is skipped if ALIDADE_DATA does not
/// contain the drives.
class DrivesTest : public ::testing::Test {
 protected:
  using Settings = std::vector<std::pair<std::string, std::string>>;

  void SetUp() override {
    const char* data = std::getenv("ALIDADE_DATA");
    if (data != nullptr) folder_ = std::filesystem::path(data) / "kitti-stereo-tracks";
    if (!std::filesystem::is_directory(folder_)) {
      GTEST_SKIP() << "ALIDADE_DATA does not contain kitti-stereo-tracks";
    }
  }
  /// Returns the config of `example` for the first `frames` frames of `drive`.
  Config ConfigOf(const std::string& example, const std::string& drive, int frames,
                  const Settings& settings) const {
    Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples" /
                                     example / "config.yaml");
    config.Set("source.path", (folder_ / drive).string(), "--set");
    config.Set("source.max_frames", std::to_string(frames), "--set");
    for (const auto& [key, value] : settings) config.Set(key, value, "--set");
    return config;
  }

  std::filesystem::path folder_;
};

}  // namespace alidade::testing
