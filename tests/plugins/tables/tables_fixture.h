// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "plugins/tables/tables.h"
#include "support/temporary_folder.h"

namespace alidade::testing {

namespace fs = std::filesystem;

inline constexpr const char* kDepthConfig =
    "path: a.csv\nstreams: {disparity: disparity_px, inverse_scale: {columns: [scale], "
    "reciprocal: true}}\ntruth: {depth: reference_depth_m}\n";
inline constexpr const char* kHeader = "t_s,disparity_px,scale,reference_depth_m\n";

/// Test in a temporary folder, which contains `a.csv`.
class Tables : public ::testing::Test {
 protected:
  fs::path File() const { return folder_ / "a.csv"; }
  void Write(const std::string& text) const { Write("a.csv", text); }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  /// Opens the source of `config`, which contains the keys of the `source` map.
  std::unique_ptr<Source> Open(const std::string& config = kDepthConfig) {
    config_ = std::make_unique<Config>(Config::FromText(config, "run.yaml"));
    return OpenConfig();
  }
  std::unique_ptr<Source> OpenConfig() {
    static const AlidadeHost kHost{};
    Params params(&kHost);
    auto source = CreateTables({config_->root(), params, 1, folder_.path(), any_order_});
    config_->root().RejectUnread();
    return source;
  }
  std::vector<SourceFrame> Frames(const std::string& config = kDepthConfig) {
    const auto source = Open(config);
    std::vector<SourceFrame> frames;
    for (SourceFrame frame; source->Next(frame);) frames.push_back(frame);
    return frames;
  }
  std::vector<SourceFrame> Frames(const std::string& text, const std::string& config) {
    Write(text);
    return Frames(config);
  }

  /// Expects that `work` fails with `code` and with exactly `message`. FILE in `message` stands for
  /// the path of a.csv.
  void ExpectError(ExitCode code, std::string message, const std::function<void()>& work) const {
    if (const auto at = message.find("FILE"); at != std::string::npos) {
      message.replace(at, 4, File().string());
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
                     const std::string& config = kDepthConfig) {
    Write(text);
    ExpectError(ExitCode::kBadData, message, [&] { Frames(config); });
  }
  void ExpectBadConfig(const std::string& config, const std::string& message) {
    ExpectError(ExitCode::kBadConfig, message, [&] { Frames(config); });
  }

  TemporaryFolder folder_;
  bool any_order_ = false;  ///< true if `out_of_sequence.policy` allows any order
  std::unique_ptr<Config> config_;
};

/// Returns the frames in short, such as `100 s0=1,2 s1=3 t0=4`: the time in ms, the values of each
/// measurement with the index of its stream, and the true values.
inline std::vector<std::string> Shown(const std::vector<SourceFrame>& frames) {
  const auto list = [](const std::vector<double>& values) {
    std::ostringstream text;
    for (std::size_t i = 0; i < values.size(); ++i) text << (i > 0 ? "," : "") << values[i];
    return text.str();
  };
  std::vector<std::string> shown;
  for (const SourceFrame& frame : frames) {
    std::string& text = shown.emplace_back(std::to_string(frame.timestamp / 1'000'000));
    for (const Measurement& m : frame.measurements) {
      text += " s" + std::to_string(m.stream) + '=' + list(m.values);
      EXPECT_EQ(m.timestamp, frame.timestamp);
    }
    for (std::size_t i = 0; i < frame.truth.size(); ++i) {
      if (!frame.truth[i].empty()) text += " t" + std::to_string(i) + '=' + list(frame.truth[i]);
    }
  }
  return shown;
}

inline std::vector<Timestamp> Timestamps(const std::vector<SourceFrame>& frames) {
  std::vector<Timestamp> timestamps;
  for (const SourceFrame& frame : frames) timestamps.push_back(frame.timestamp);
  return timestamps;
}

/// Returns the indices of the measured streams and of the known true values of a frame: `0 1 | 1`.
inline std::string Held(const SourceFrame& frame) {
  std::string held;
  for (const Measurement& m : frame.measurements) held += std::to_string(m.stream) + ' ';
  held += "|";
  for (std::size_t i = 0; i < frame.truth.size(); ++i) {
    if (!frame.truth[i].empty()) held += ' ' + std::to_string(i);
  }
  return held;
}

}  // namespace alidade::testing
