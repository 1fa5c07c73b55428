// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "alidade/plugin/param_reader.h"
#include "plugins/tracks/tracks.h"
#include "support/temporary_folder.h"

namespace alidade::testing {

namespace fs = std::filesystem;

/// Test in a temporary folder, which contains tracks.csv and the files next to it.
class TracksTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  fs::path File() const { return folder_ / "tracks.csv"; }

  /// Opens the source for the folder. `keys` are the keys of `source`, without its braces.
  std::unique_ptr<Source> Open(const std::string& keys = "rate_hz: 10",
                               const std::string& path = "tracks.csv") {
    config_ = std::make_unique<Config>(
        Config::FromText("source: {path: \"" + path + "\", " + keys + "}", "run.yaml"));
    const Node entry = config_->root().At("source");
    internal::ParamReader reader(entry, "source 'tracks'");
    Params params(&reader.host());
    auto source = CreateTracks({entry, params, 1, folder_.path()});
    reader.Check();
    entry.RejectUnread();
    return source;
  }
  std::vector<SourceFrame> Frames(const std::string& keys = "rate_hz: 10",
                                  const std::string& path = "tracks.csv") {
    const auto source = Open(keys, path);
    std::vector<SourceFrame> frames;
    for (SourceFrame frame; source->Next(frame);) frames.push_back(frame);
    return frames;
  }
  std::vector<SourceFrame> FramesOf(const std::string& text) {
    Write("tracks.csv", text);
    return Frames();
  }

  /// Expects that `work` fails with `code` and with exactly `message`. DIR/ in `message` stands for
  /// the folder.
  void ExpectError(ExitCode code, std::string message, const std::function<void()>& work) const {
    for (auto at = message.find("DIR/"); at != std::string::npos; at = message.find("DIR/")) {
      message.replace(at, 3, folder_.path().string());
    }
    try {
      work();
      FAIL() << "no error; expected: " << message;
    } catch (const Error& error) {
      EXPECT_EQ(error.what(), message);
      EXPECT_EQ(error.code(), code);
    }
  }
  void ExpectBadData(const std::string& text, const std::string& message,
                     const std::string& keys = "rate_hz: 10") {
    Write("tracks.csv", text);
    ExpectError(ExitCode::kBadData, message, [&] { Frames(keys); });
  }

  TemporaryFolder folder_;
  std::unique_ptr<Config> config_;
};

}  // namespace alidade::testing
