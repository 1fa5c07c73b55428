// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

/// Work that may crash, exit, hang or use up memory, done in a child process.
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

  /// Notes the call and the state at which it is made, both truncated if they are too long.
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
  int memory_mb = 0;  ///< beyond the memory that the program has already; 0: no limit
};

struct ChildEnd {
  bool answered = false;
  bool late = false;    ///< killed because it exceeded the time
  std::string text;     ///< the answer, or how it ended: `crashed (signal 11, Segmentation fault)`
  std::string printed;  ///< the start of its output; its first line at most
};

/// Runs `work` in a child process and returns its answer. The child has the default signal
/// handlers and a process group of its own, which is killed when the child exceeds `limits` or
/// ends. Its output is captured; it dumps no core.
ChildEnd RunInChild(const ChildLimits& limits, const std::function<std::string()>& work);

}  // namespace alidade::internal
