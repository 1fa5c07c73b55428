// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "plugins/host/host_fixture.h"

namespace alidade {

/// Test with one of the plugins in tests/plugins/golden/1.0. The parameter is the stem of its file.
class GoldenTest : public HostTest, public ::testing::WithParamInterface<const char*> {
 protected:
  static std::filesystem::path Kept() {
    return std::filesystem::path(ALIDADE_SOURCE_DIR) / "tests/plugins/golden/1.0";
  }
  void SetUp() override {
#if !defined(__x86_64__)
    GTEST_SKIP() << "the plugins are built for x86-64";
#endif
  }
  /// Returns a copy that no other user can write to. The mode of the original file is not relevant.
  std::filesystem::path Lent() {
    namespace fs = std::filesystem;
    const fs::path file = folder_ / "golden.so";
    if (fs::exists(file)) return file;
    fs::copy_file(Kept() / (std::string(GetParam()) + ".so"), file);
    fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
    return file;
  }
  const PluginHost& Host() {
    if (host_ == nullptr) host_ = std::make_unique<PluginHost>(std::vector{Lent()});
    return *host_;
  }
  SharedSensor Sensor(const std::string& name, const std::string& parameters) {
    return Host().CreateSensor(name, Parse(parameters).root());
  }
  SharedMotion Cart() {
    return Host().CreateMotion("golden_cart", Parse("noise: {speed: 0.25, turn_rate: 0.5}").root());
  }

  std::unique_ptr<PluginHost> host_;
};

/// File stems of all plugins in tests/plugins/golden/1.0.
inline constexpr const char* kGolden[] = {"gxx", "clangxx", "c99"};

}  // namespace alidade
