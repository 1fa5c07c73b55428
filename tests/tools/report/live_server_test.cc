// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/live_server.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <thread>

#include "alidade/base/error.h"
#include "support/http_client.h"

namespace alidade::internal {
namespace {

using std::chrono::milliseconds;
using testing::HttpClient;
using testing::Response;

/// Server of a small page. Each update is a text of `size` bytes that begins with its number.
struct SmallServer {
  explicit SmallServer(std::size_t size = 10)
      : server(0, {[] { return "<p>page</p>"; },
                   [this, size] {
                     const std::string number = std::to_string(++updates);
                     return number + ' ' + std::string(size, 'x');
                   }}) {
    server.Start();
  }
  std::uint16_t port() const { return server.port(); }

  std::atomic<int> updates = 0;
  LiveServer server;
};

bool StartsWith(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

TEST(LiveServer, ServesThePageToThisComputer) {
  const SmallServer small;
  for (const char* const host : {"localhost", "localhost:8080", "127.0.0.1:1", "[::1]:9"}) {
    const std::string page = Response(small.port(), "GET", "/", host);
    EXPECT_TRUE(StartsWith(page, "HTTP/1.1 200 OK\r\n")) << page;
    EXPECT_TRUE(page.ends_with("\r\n\r\n<p>page</p>")) << page;
  }
}

TEST(LiveServer, RefusesOtherHostsMethodsAndTargets) {
  const SmallServer small;
  for (const char* const host :
       {"example.org", "127.0.0.1.example.org", "localhost.example.org:80", "localhost:x", ""}) {
    EXPECT_TRUE(StartsWith(Response(small.port(), "GET", "/", host), "HTTP/1.1 403 ")) << host;
    EXPECT_TRUE(StartsWith(Response(small.port(), "GET", "/events", host), "HTTP/1.1 403 "));
  }
  for (const char* const method : {"POST", "HEAD", "PUT", "DELETE", "OPTIONS"}) {
    EXPECT_TRUE(StartsWith(Response(small.port(), method, "/"), "HTTP/1.1 405 ")) << method;
  }
  EXPECT_TRUE(StartsWith(Response(small.port(), "GET", "/../etc/passwd"), "HTTP/1.1 404 "));
  EXPECT_EQ(Response(small.port(), "GET", "/" + std::string(100'000, 'a')), "");
}

TEST(LiveServer, ListensOnLoopbackOnly) {
  const SmallServer small;
  EXPECT_TRUE(HttpClient(small.port(), "127.0.0.1").is_connected());
  // A server that listened on all addresses would accept this one too.
  EXPECT_FALSE(HttpClient(small.port(), "127.0.0.2").is_connected());
}

TEST(LiveServer, NamesAPortInUse) {
  const SmallServer first;
  try {
    const LiveServer second(first.port(), {});
    FAIL() << "the port was opened twice";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kCannotCreate);
    EXPECT_EQ(std::string(error.what()),
              "127.0.0.1:" + std::to_string(first.port()) +
                  ": the port cannot be opened: Address already in use; expected a free port from "
                  "1024 to 65535, or 0, which selects a free port");
  }
}

TEST(LiveServer, SendsUpdatesAndTheEnd) {
  SmallServer small;
  HttpClient client(small.port());
  client.Request("GET", "/events");
  client.ReceiveUntil("data: 3 xxxxxxxxxx\n\n");
  small.server.Finish("last");
  const std::string& text = client.ReceiveUntil("");
  EXPECT_TRUE(text.ends_with("event: end\ndata: last\n\n")) << text;
  EXPECT_EQ(small.server.dropped(), 0);
  EXPECT_FALSE(HttpClient(small.port()).is_connected());
}

TEST(LiveServer, DropsAndCountsUpdatesOfASlowBrowser) {
  SmallServer small(1 << 20);
  const HttpClient slow(small.port(), "127.0.0.1", 4096);
  slow.Request("GET", "/events");
  for (int i = 0; i < 1000 && small.server.dropped() < 2; ++i) {
    std::this_thread::sleep_for(milliseconds(10));
  }
  EXPECT_GE(small.server.dropped(), 2);
  // Other browsers receive their updates.
  HttpClient other(small.port());
  other.Request("GET", "/events");
  other.ReceiveUntil("x\n\n");
  const auto start = std::chrono::steady_clock::now();
  std::thread reader(
      [&] { EXPECT_TRUE(other.ReceiveUntil("").ends_with("event: end\ndata: last\n\n")); });
  small.server.Finish("last");
  reader.join();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(8));
}

TEST(LiveServer, DoesNotUpdateAPageThatNobodyReads) {
  const SmallServer small;
  Response(small.port(), "GET", "/");
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_EQ(small.updates, 0);
}

TEST(LiveServer, SpacesExpensiveUpdates) {
  std::atomic<int> updates = 0;
  LiveServer server(0, {[] { return ""; },
                        [&] {  // needs 20 ms of CPU time, so the next update is 2 s later
                          timespec time{};
                          clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
                          const auto since = [&, start = time] {
                            clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
                            return 1e3 * static_cast<double>(time.tv_sec - start.tv_sec) +
                                   1e-6 * static_cast<double>(time.tv_nsec - start.tv_nsec);
                          };
                          while (since() < 20.0) {
                          }
                          return std::to_string(++updates);
                        }});
  server.Start();
  HttpClient client(server.port());
  client.Request("GET", "/events");
  client.ReceiveUntil("data: 1\n\n");
  std::this_thread::sleep_for(milliseconds(1500));
  EXPECT_EQ(updates, 1);
}

TEST(LiveServer, AnswersThatAPageIsNotReady) {
  LiveServer server(0, {[]() -> std::string { throw Error(ExitCode::kBadData, "half a file"); },
                        []() -> std::string { throw Error(ExitCode::kBadData, "half a file"); }});
  server.Start();
  EXPECT_TRUE(StartsWith(Response(server.port(), "GET", "/"), "HTTP/1.1 503 "));
  HttpClient client(server.port());
  client.Request("GET", "/events");
  client.ReceiveUntil("\r\n\r\n");
  server.Finish("last");
  EXPECT_TRUE(client.ReceiveUntil("").ends_with("\r\n\r\nevent: end\ndata: last\n\n"));
}

}  // namespace
}  // namespace alidade::internal
