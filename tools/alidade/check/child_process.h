// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

/// Runs work in a child process, so that it may crash, exit, hang or exhaust memory.
namespace alidade::internal {

/// The current call of a child process, in memory that it shares with its parent: if the child
/// dies, the parent reports this call.
class CallRecord {
 public:
  /// Error: kInternal.
  CallRecord();
  ~CallRecord();
  CallRecord(const CallRecord&) = delete;
  CallRecord& operator=(const CallRecord&) = delete;

  /// Records the current call and its state, both truncated if they are too long.
  void Enter(const char* call, const std::string& state = {});
  std::string call() const { return shared_->call; }
  std::string state() const { return shared_->state; }

 private:
  struct Shared {
    char call[128], state[512];
  };
  Shared* shared_;
};

struct ChildLimits {
  double timeout_s = 10.0;
  int memory_mb = 0;  ///< in addition to the present memory of the program; 0: no limit
};

struct ChildEnd {
  bool answered = false;
  bool timed_out = false;  ///< killed because it exceeded the time limit
  /// The answer, or how the child ended: `crashed (signal 11, Segmentation fault)`.
  std::string text;
  std::string printed;  ///< first line of its output, truncated
};

/// Runs `work` in a child process and returns its answer. The child has the default signal
/// handlers and its own process group, which is killed when the child exceeds `limits` or ends.
/// Its output is captured and core dumps are disabled.
ChildEnd RunInChild(const ChildLimits& limits, const std::function<std::string()>& work);

}  // namespace alidade::internal
