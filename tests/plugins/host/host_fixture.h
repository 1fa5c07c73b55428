// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/plugin/plugin_host.h"
#include "support/temporary_folder.h"

namespace alidade {

/// Test in a temporary folder, without the plugins of the user.
class HostTest : public ::testing::Test {
 protected:
  HostTest() {
    setenv("XDG_DATA_HOME", (folder_ / "no_user_data").c_str(), 1);
    unsetenv("ALIDADE_PLUGIN_PATH");
  }
  ~HostTest() override { unsetenv("ALIDADE_PLUGIN_PATH"); }

  /// Returns the path of a test plugin of this build.
  static std::filesystem::path Built(const std::string& name) {
    return std::filesystem::path(ALIDADE_TEST_PLUGINS) / (name + ".so");
  }
  std::filesystem::path Copy(const std::string& name, const std::filesystem::path& to) {
    std::filesystem::create_directories((folder_ / to).parent_path());
    std::filesystem::copy_file(Built(name), folder_ / to);
    return folder_ / to;
  }
  static Config Parse(const std::string& text) { return Config::FromText(text, "test.yaml"); }

  /// Expects that f throws an Error with `code` and with all of `words` in its message.
  template <class F>
  static void ExpectError(ExitCode code, const std::vector<std::string>& words, const F& f) {
    try {
      f();
      ADD_FAILURE() << "no error; expected: " << words.front();
    } catch (const Error& e) {
      const std::string text = e.what();
      EXPECT_EQ(e.code(), code) << text;
      for (const std::string& word : words) {
        EXPECT_NE(text.find(word), std::string::npos) << "'" << word << "' is not in: " << text;
      }
    }
  }
  /// Expects an error if only `file` is loaded.
  static void ExpectRefused(const std::filesystem::path& file, std::vector<std::string> words,
                            ExitCode code = ExitCode::kPlugin) {
    words.push_back(file.string());
    ExpectError(code, words, [&] { PluginHost host({file}); });
  }
  static const ParamInfo& Param(const std::vector<ParamInfo>& schema, const std::string& key) {
    const auto has_key = [&](const ParamInfo& info) { return info.key == key; };
    const auto found = std::find_if(schema.begin(), schema.end(), has_key);
    EXPECT_NE(found, schema.end()) << key;
    return *found;
  }

  testing::TemporaryFolder folder_;
};

}  // namespace alidade
