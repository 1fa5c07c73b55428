// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/log.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/dist_sink.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace alidade {
namespace {

constexpr std::array<const char*, 6> kLogLevelNames = {"trace",   "debug", "info",
                                                       "warning", "error", "off"};

spdlog::level::level_enum ToSpdlog(LogLevel level) {
  constexpr std::array kLevels = {spdlog::level::trace, spdlog::level::debug, spdlog::level::info,
                                  spdlog::level::warn,  spdlog::level::err,   spdlog::level::off};
  return kLevels.at(static_cast<std::size_t>(level));
}

LogLevel FromSpdlog(spdlog::level::level_enum level) {
  return level >= spdlog::level::err ? LogLevel::kError
                                     : static_cast<LogLevel>(static_cast<int>(level));
}

/// True while this thread is inside a sink.
thread_local bool in_log_sink = false;
/// Innermost scope of this thread.
thread_local const LogScope* log_scope = nullptr;

/// Lowest level that at least one sink receives. Log() returns early for a message
/// below this level.
std::atomic<int> lowest_log_level{static_cast<int>(LogLevel::kOff)};

/// Logger of the library.
class Logger {
 public:
  /// Returns the logger. It is never destroyed, because code after the end of main() may log.
  static Logger& Get() {
    static Logger& logger = *new Logger;
    return logger;
  }

  void Add(const std::shared_ptr<spdlog::sinks::sink>& sink) {
    const std::lock_guard lock(mutex_);
    subscribed_.push_back(sink);
    sinks_->add_sink(sink);
    Update();
  }
  void Remove(const std::shared_ptr<spdlog::sinks::sink>& sink) {
    const std::lock_guard lock(mutex_);
    std::erase(subscribed_, sink);
    sinks_->remove_sink(sink);
    Update();
  }
  void Write(LogLevel level, std::string_view text) {
    logger_.log(ToSpdlog(level), spdlog::string_view_t(text.data(), text.size()));
  }

 private:
  Logger() : sinks_(std::make_shared<spdlog::sinks::dist_sink_mt>()), logger_("alidade", sinks_) {
    logger_.set_level(spdlog::level::trace);               // the sinks filter by level
    logger_.set_error_handler([](const std::string&) {});  // the default handler would print errors
  }
  void Update() {
    int lowest = static_cast<int>(LogLevel::kOff);
    for (const auto& sink : subscribed_) lowest = std::min(lowest, static_cast<int>(sink->level()));
    lowest_log_level = lowest;
  }

  std::shared_ptr<spdlog::sinks::dist_sink_mt> sinks_;
  spdlog::logger logger_;
  std::mutex mutex_;  ///< guards `subscribed_`
  std::vector<std::shared_ptr<spdlog::sinks::sink>> subscribed_;
};

}  // namespace

const char* ToString(LogLevel level) { return kLogLevelNames.at(static_cast<std::size_t>(level)); }

std::optional<LogLevel> LogLevelOf(std::string_view name) {
  const auto position = std::ranges::find(kLogLevelNames, name);
  if (position == kLogLevelNames.end()) return std::nullopt;
  return static_cast<LogLevel>(position - kLogLevelNames.begin());
}

/// spdlog sink that calls a function. It needs no lock, because the dist_sink that contains it is
/// locked during each call.
class LogSubscription::Sink : public spdlog::sinks::sink {
 public:
  explicit Sink(LogSink function) : function_(std::move(function)) {}

  void log(const spdlog::details::log_msg& message) override {
    if (has_thrown_) return;
    try {
      function_(FromSpdlog(message.level), {message.payload.data(), message.payload.size()});
    } catch (...) {
      has_thrown_ = true;
    }
  }
  void flush() override {}
  void set_pattern(const std::string&) override {}
  void set_formatter(std::unique_ptr<spdlog::formatter>) override {}

 private:
  LogSink function_;
  bool has_thrown_ = false;
};

LogSubscription::LogSubscription(LogLevel lowest, LogSink sink)
    : sink_(std::make_shared<Sink>(std::move(sink))) {
  sink_->set_level(ToSpdlog(lowest));
  Logger::Get().Add(sink_);
}

LogSubscription::~LogSubscription() { Logger::Get().Remove(sink_); }

LogScope::LogScope(std::string prefix, LogLevel highest)
    : prefix_(std::move(prefix)), highest_(highest), outer_(std::exchange(log_scope, this)) {}

LogScope::~LogScope() { log_scope = outer_; }

bool IsLogged(LogLevel level) {
  return level < LogLevel::kOff && static_cast<int>(level) >= lowest_log_level.load();
}

void Log(LogLevel level, std::string_view text) noexcept {
  if (log_scope != nullptr) level = std::min(level, log_scope->highest());
  if (in_log_sink || !IsLogged(level)) return;
  in_log_sink = true;
  try {
    if (log_scope != nullptr) {
      Logger::Get().Write(level, log_scope->prefix() + std::string(text));
    } else {
      Logger::Get().Write(level, text);
    }
  } catch (...) {  // a message that cannot be logged must not end the program
  }
  in_log_sink = false;
}

}  // namespace alidade
