// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

/// Work that may crash, end, hang or eat memory, done in a child process.
namespace alidade::internal {

/// What the child is doing, in memory that the parent sees: an end that the child cannot report
/// itself is put into words with it.
class Journal {
 public:
  /// `call` at `state`, both cut where they are too long.
  void Enter(const char* call, const std::string& state = {});
  void Thrown(const char* what);
  std::string call() const { return call_; }
  std::string state() const { return state_; }
  /// The exception that nobody caught, or "".
  std::string thrown() const { return thrown_; }

 private:
  char call_[128], state_[512], thrown_[256];
};

/// Enters `call` in the journal of the child that this process is, if it is one.
void EnterInChild(const char* call);

struct ChildLimits {
  double timeout_s = 10.0;
  int memory_mb = 0;  ///< beyond what the program has already; 0: no limit
};

struct ChildEnd {
  bool answered = false;
  bool late = false;    ///< ended as it exceeded the time
  std::string text;     ///< the answer, or the end in words: `crashed (signal 11, ...)`
  std::string printed;  ///< the first line on standard output or error, cut where it is too long
};

/// The answer of `work`, done in a child that has the default signal handlers, prints to nobody and
/// dumps no core. It is killed when it exceeds `limits` or the program ends; all that it started,
/// daemons too, is killed when it ends.
ChildEnd RunInChild(const ChildLimits& limits, Journal& journal,
                    const std::function<std::string()>& work);

/// A Journal that parent and children share, zeroed. Error: kInternal.
class SharedJournal {
 public:
  SharedJournal();
  ~SharedJournal();
  SharedJournal(const SharedJournal&) = delete;
  SharedJournal& operator=(const SharedJournal&) = delete;
  Journal& operator*() const { return *journal_; }
  Journal* operator->() const { return journal_; }

 private:
  Journal* journal_;
};

}  // namespace alidade::internal
