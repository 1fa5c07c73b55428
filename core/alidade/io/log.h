// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

/// Log: messages of the library for a person. Results and errors do not depend on the log: the
/// library returns every result and throws every error. Without a sink, nothing is printed. All
/// functions of this header are thread-safe.
namespace alidade {

enum class LogLevel { kTrace, kDebug, kInfo, kWarning, kError, kOff };
/// Returns `trace`, `debug`, `info`, `warning`, `error` or `off`.
const char* ToString(LogLevel level);
/// Returns the level called `name`; nullopt if the name is unknown.
std::optional<LogLevel> LogLevelOf(std::string_view name);

/// Function that receives each message: the level, and the text without a line end. Calls do not
/// overlap. A sink that throws receives no further messages. Messages that a sink itself logs are
/// dropped. A sink must not create or destroy a LogSubscription, because this would cause a
/// deadlock.
using LogSink = std::function<void(LogLevel level, std::string_view text)>;

/// Subscription of a sink. It ends when the object is destroyed.
class LogSubscription {
 public:
  /// Subscribes `sink` to the messages of level `lowest` and above.
  LogSubscription(LogLevel lowest, LogSink sink);
  ~LogSubscription();
  LogSubscription(const LogSubscription&) = delete;
  LogSubscription& operator=(const LogSubscription&) = delete;

 private:
  class Sink;
  std::shared_ptr<Sink> sink_;
};

/// Logging scope that identifies one run among several runs. While the object exists, messages of
/// this thread begin with `prefix`, and levels above `highest` are reduced to `highest`. Within
/// nested scopes, only the innermost scope applies.
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

/// Returns true if at least one sink receives messages of this level. Otherwise the caller need not
/// compose the message.
bool IsLogged(LogLevel level);

/// Passes the message to each sink that receives its level.
void Log(LogLevel level, std::string_view text) noexcept;

}  // namespace alidade
