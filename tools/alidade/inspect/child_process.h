// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

/// Work that may crash, exit, hang or use up memory, done in a child process.
namespace alidade::internal {

/// The current call of the child, in memory that the parent shares: if the child dies, the parent
/// reports this call.
class Journal {
 public:
  /// Notes the call and the state at which it is made, both truncated if they are too long.
  void Enter(const char* call, const std::string& state = {});
  std::string call() const { return call_; }
  std::string state() const { return state_; }

 private:
  char call_[128], state_[512];
};

/// A Journal that parent and children share, zeroed. Error: kInternal.
class SharedJournal {
 public:
  SharedJournal();
  ~SharedJournal();
  SharedJournal(const SharedJournal&) = delete;
  SharedJournal& operator=(const SharedJournal&) = delete;
  Journal& operator*() const { return *journal_; }

 private:
  Journal* journal_;
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
