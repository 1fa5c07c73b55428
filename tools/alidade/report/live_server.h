// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace alidade::internal {

/// HTTP server of a page that changes during a run. It listens on 127.0.0.1 only, serves GET only,
/// and refuses requests whose Host is not this computer. `/` is the page, `/events` is a stream of
/// server-sent events with updates of its data. The server has one thread.
///
/// Updates are sent at most 10 times a second. After an update the server waits at least 100
/// times the CPU time that its thread has needed since the update before. The thread thus needs at
/// most 1 % of the time of one core. An update that a browser cannot receive yet is dropped and
/// counted.
class LiveServer {
 public:
  /// Texts that the server sends. Both functions are called on its thread. If one throws an
  /// exception, the server answers that the page is not ready, or omits the update.
  struct Content {
    std::function<std::string()> page;    ///< returns HTML
    std::function<std::string()> update;  ///< returns data without line ends; "": no update
  };
  /// Opens the port; 0 means any free port. Requests are answered after Start(). Error:
  /// kCannotCreate if the port is in use or not permitted.
  LiveServer(std::uint16_t port, Content content);
  /// Closes all connections.
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  void Start();
  /// Sends a last event `end` with `data` to all browsers, and stops the server. Waits at most two
  /// seconds for slow browsers.
  void Finish(const std::string& data);

  std::uint16_t port() const;
  /// Returns the number of updates that were dropped. Can be called on any thread.
  std::int64_t dropped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade::internal
