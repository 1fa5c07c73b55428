// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "alidade/experiment/run.h"

namespace alidade {

/// Observer that serves the page of a run during the run, on 127.0.0.1. The page shows the last
/// rows of the files that a Recorder writes, so the memory and the time of an update do not depend
/// on the length of the run. The observer itself writes no file.
class LiveRun : public RunObserver {
 public:
  /// Largest number of rows that the page shows of each file.
  static constexpr std::size_t kRows = 1000;
  /// Longest time between a frame and its rows: Recorder::Options::max_delay of a watched run.
  static constexpr std::chrono::milliseconds kMaxDelay{100};

  /// Opens `port`; 0 means any free port. `folder` is the run folder of the Recorder, which must be
  /// an earlier observer of the run. Error: kCannotCreate if the port cannot be opened.
  LiveRun(std::uint16_t port, const std::filesystem::path& folder, const Config& config);
  ~LiveRun() override;
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  void Begin(const Experiment& experiment) override;
  void OnFrame(const SourceFrame& frame) override;
  /// Sends the data of the finished folder to all browsers, and stops the server. Call this
  /// function after Recorder::Finish().
  void Finish();

  /// Returns the address of the page, such as `http://127.0.0.1:8080/`.
  std::string address() const;
  /// Returns the number of updates that a browser was too slow to receive.
  std::int64_t dropped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
