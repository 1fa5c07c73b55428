// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

/// Runs a function in a child process. If the function crashes, exits, hangs or exhausts memory,
/// the program continues.
namespace alidade::internal {

/// Current call of a child process, stored in memory that is shared with the parent process. If the
/// child dies, the parent reports this call.
class CallRecord {
 public:
  /// Allocates the shared memory. Error: kInternal.
  CallRecord();
  ~CallRecord();
  CallRecord(const CallRecord&) = delete;
  CallRecord& operator=(const CallRecord&) = delete;

  /// Records the name and the state of the current call. Long texts are truncated.
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
  int memory_mb = 0;  ///< additional memory that the child may allocate; 0: no limit
};

struct ChildEnd {
  bool answered = false;
  bool timed_out = false;  ///< true: the child was killed because it exceeded the time limit
  /// Answer of the child. If the child did not answer, the text describes how the process ended, as
  /// in `crashed (signal 11, Segmentation fault)`.
  std::string text;
  std::string printed;  ///< first line that the child printed, truncated
};

/// Runs `work` in a child process and returns the answer. The child has the default signal handlers
/// and a separate process group. The group is killed when the child ends or exceeds the time limit.
/// The output of the child is captured, and core dumps are disabled.
ChildEnd RunInChild(const ChildLimits& limits, const std::function<std::string()>& work);

}  // namespace alidade::internal
