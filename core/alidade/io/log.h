// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

/// What the library reports to a person while it works. Results are returned and errors are thrown;
/// neither depends on the log. Without a sink the library is silent. Every function here may be
/// called from any thread.
namespace alidade {

enum class LogLevel { kTrace, kDebug, kInfo, kWarning, kError, kOff };
/// `trace`, `debug`, `info`, `warning`, `error`, `off`.
const char* ToString(LogLevel level);
/// The level of that name; none if there is no such level.
std::optional<LogLevel> LogLevelOf(std::string_view name);

/// Takes one message: its level, and its text without a line end. Calls come one at a time. A sink
/// that throws is given nothing more. What a sink logs itself is dropped. A sink makes and destroys
/// no LogSubscription: that would wait for itself.
using LogSink = std::function<void(LogLevel level, std::string_view text)>;

/// A sink in use, until the end of its scope.
class LogSubscription {
 public:
  /// `sink` is given the messages of level `least` and above.
  LogSubscription(LogLevel least, LogSink sink);
  ~LogSubscription();
  LogSubscription(const LogSubscription&) = delete;
  LogSubscription& operator=(const LogSubscription&) = delete;

 private:
  class Sink;
  std::shared_ptr<Sink> sink_;
};

/// Until the end of its scope messages of this thread begin with `prefix`, and those above level
/// `highest` get that level: for one run of many. The scope around it then has no effect.
class LogScope {
 public:
  LogScope(std::string prefix, LogLevel highest);
  ~LogScope();
  LogScope(const LogScope&) = delete;
  LogScope& operator=(const LogScope&) = delete;

  const std::string& prefix() const { return prefix_; }
  LogLevel highest() const { return highest_; }

 private:
  std::string prefix_;
  LogLevel highest_;
  const LogScope* outer_;
};

/// Whether a sink takes messages of that level: texts are composed only if so.
bool IsLogged(LogLevel level);

/// Gives the message to each sink that takes its level. Throws nothing.
void Log(LogLevel level, std::string_view text) noexcept;

}  // namespace alidade
