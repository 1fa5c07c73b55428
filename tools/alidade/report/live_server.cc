// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/live_server.h"

#include <pthread.h>
#include <signal.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include "alidade/base/error.h"

namespace alidade::internal {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::system::error_code;
using std::chrono::duration;
using std::chrono::steady_clock;
using Tcp = asio::ip::tcp;

constexpr std::chrono::milliseconds kMinInterval{100};
constexpr double kMaxShare = 0.01;  // of the time of one core
constexpr std::chrono::seconds kRequestTimeout{10};
constexpr std::chrono::seconds kFinishTimeout{2};
constexpr std::size_t kMaxConnections = 16;
constexpr int kSendBuffer = 1 << 17;  // bytes; a larger buffer would hold outdated updates

/// Permits the page its own style and scripts, and the connection to this server.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

/// Returns the CPU time of the current thread.
duration<double> ThreadCpuTime() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

/// Returns whether a Host header names this computer, with any port. A web site whose name is
/// resolved to 127.0.0.1 could otherwise read the page (DNS rebinding).
bool IsThisComputer(std::string_view host) {
  for (const std::string_view name : {"localhost", "127.0.0.1", "[::1]"}) {
    if (!host.starts_with(name)) continue;
    const std::string_view port = host.substr(name.size());
    const bool is_port =
        port.starts_with(':') && port.find_first_not_of("0123456789", 1) == port.npos;
    if (port.empty() || is_port) return true;
  }
  return false;
}

}  // namespace

namespace live {

class Connection;

/// The open connections, and the texts that they serve.
struct Hub {
  LiveServer::Content content;
  std::set<std::shared_ptr<Connection>> connections = {};
  bool is_finished = false;
  std::function<void()> on_empty = {};  ///< called when the last connection closes

  void Remove(const std::shared_ptr<Connection>& connection) {
    connections.erase(connection);
    if (connections.empty() && on_empty) on_empty();
  }
};

/// Connection of a browser: one request, then its response or a stream of events.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Tcp::socket socket, Hub& hub) : stream_(std::move(socket)), hub_(hub) {
    parser_.body_limit(0);
  }

  void Read() {
    stream_.expires_after(kRequestTimeout);
    http::async_read(stream_, buffer_, parser_,
                     [self = shared_from_this()](error_code error, std::size_t) {
                       error ? self->Close() : self->Answer();
                     });
  }
  bool has_request() const { return has_request_; }
  bool has_events() const { return has_events_; }
  bool is_sending() const { return is_sending_; }
  /// Sends an event. Must not be called while is_sending() is true.
  void Send(const std::string& event) {
    is_sending_ = true;
    sent_ = event;
    asio::async_write(
        stream_.socket(), asio::buffer(sent_),
        [self = shared_from_this()](error_code error, std::size_t) { self->OnSent(error); });
  }
  /// Sends a last event when the previous event is complete, and closes the connection.
  void SendLast(const std::string& event) {
    if (is_sending_) {
      last_ = event;
    } else {
      is_last_ = true;
      Send(event);
    }
  }
  void Close() {
    error_code ignored;
    stream_.socket().shutdown(Tcp::socket::shutdown_both, ignored);
    stream_.socket().close(ignored);
    hub_.Remove(shared_from_this());
  }

 private:
  void Answer() {
    has_request_ = true;
    const auto& request = parser_.get();
    const auto host = request[http::field::host];
    if (!IsThisComputer({host.data(), host.size()})) {
      Respond(http::status::forbidden, "The Host of the request is not this computer.\n");
    } else if (request.method() != http::verb::get) {
      Respond(http::status::method_not_allowed, "Only GET is served.\n");
    } else if (request.target() == "/") {
      RespondPage();
    } else if (request.target() == "/events" && !hub_.is_finished) {
      StartEvents();
    } else {
      Respond(http::status::not_found, "Only / and /events exist.\n");
    }
  }

  void RespondPage() {
    std::string page;
    try {
      page = hub_.content.page();
    } catch (const std::exception&) {  // for example, the run renames its folder at this moment
      Respond(http::status::service_unavailable, "The page is not ready. Load it again.\n");
      return;
    }
    Respond(http::status::ok, std::move(page), "text/html; charset=utf-8");
  }

  void Respond(http::status status, std::string body, const char* type = "text/plain") {
    response_.result(status);
    response_.version(11);
    response_.keep_alive(false);
    response_.set(http::field::content_type, type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("Content-Security-Policy", kPolicy);
    response_.set("X-Content-Type-Options", "nosniff");
    if (status == http::status::method_not_allowed) response_.set(http::field::allow, "GET");
    response_.body() = std::move(body);
    response_.prepare_payload();
    stream_.expires_after(kRequestTimeout);
    http::async_write(stream_, response_,
                      [self = shared_from_this()](error_code, std::size_t) { self->Close(); });
  }

  void StartEvents() {
    stream_.expires_never();
    error_code ignored;
    stream_.socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    has_events_ = true;
    Send(
        "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\n"
        "X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n");
    AwaitEnd();
  }

  /// Waits until the browser closes the connection. The browser sends no further data.
  void AwaitEnd() {
    stream_.socket().async_read_some(
        asio::buffer(byte_),
        [self = shared_from_this()](error_code, std::size_t) { self->Close(); });
  }

  void OnSent(error_code error) {
    is_sending_ = false;
    if (error || is_last_) {
      Close();
    } else if (!last_.empty()) {
      SendLast(std::exchange(last_, {}));
    }
  }

  beast::tcp_stream stream_;
  Hub& hub_;
  beast::flat_buffer buffer_;
  http::request_parser<http::string_body> parser_;
  http::response<http::string_body> response_;
  std::string sent_, last_;
  std::array<char, 1> byte_{};
  bool has_request_ = false, has_events_ = false, is_sending_ = false, is_last_ = false;
};

}  // namespace live

struct LiveServer::Impl {
  Impl(std::uint16_t port, Content content);

  void Accept();
  /// Sends an update now, and further updates later.
  void Update();
  /// Sends an update to each browser that has received the previous one, if there is new data.
  void SendUpdate();
  void Finish(const std::string& data);
  /// Closes all connections. Must be called after the thread has ended.
  void CloseAll();

  asio::io_context context{1};
  Tcp::acceptor acceptor{context};
  asio::steady_timer timer{context}, retry{context};
  std::uint16_t opened_port = 0;
  live::Hub hub;
  std::string last_update;
  duration<double> cpu_time{};  ///< of the thread, at the last update
  std::atomic<std::int64_t> dropped = 0;
  std::thread thread;
};

LiveServer::Impl::Impl(std::uint16_t port, Content content) : hub{std::move(content)} {
  const Tcp::endpoint endpoint(asio::ip::address_v4::loopback(), port);
  error_code error;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (!error) opened_port = acceptor.local_endpoint(error).port();
  if (!error) return;
  throw Error(ExitCode::kCannotCreate,
              ErrorLine({}, "127.0.0.1:" + std::to_string(port),
                        "the port cannot be opened: " + error.message(),
                        "a free port from 1024 to 65535, or 0, which selects a free port"));
}

void LiveServer::Impl::Accept() {
  acceptor.async_accept([this](error_code error, Tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error && hub.connections.size() < kMaxConnections) {
      const auto connection = std::make_shared<live::Connection>(std::move(socket), hub);
      hub.connections.insert(connection);
      connection->Read();
    }
    if (!error) return Accept();
    // For example, the process has no free file descriptor.
    retry.expires_after(kMinInterval);
    retry.async_wait([this](error_code stopped) {
      if (!stopped && !hub.is_finished) Accept();
    });
  });
}

void LiveServer::Impl::SendUpdate() {
  const auto has_events = [](const auto& connection) { return connection->has_events(); };
  if (std::ranges::none_of(hub.connections, has_events)) return;
  std::string update;
  try {
    update = hub.content.update();
  } catch (const std::exception&) {  // the run is writing the files; the next update will succeed
  }
  if (update.empty() || update == last_update) return;
  last_update = std::move(update);
  for (const auto& connection : hub.connections) {
    if (!connection->has_events()) continue;
    if (connection->is_sending()) {
      ++dropped;
    } else {
      connection->Send("data: " + last_update + "\n\n");
    }
  }
}

void LiveServer::Impl::Update() {
  SendUpdate();
  const duration<double> previous = std::exchange(cpu_time, ThreadCpuTime());
  const duration<double> needed = cpu_time - previous;
  const auto interval = std::chrono::ceil<std::chrono::milliseconds>(needed / kMaxShare);
  timer.expires_after(std::max(kMinInterval, interval));
  timer.async_wait([this](error_code error) {
    if (!error && !hub.is_finished) Update();
  });
}

void LiveServer::Impl::Finish(const std::string& data) {
  hub.is_finished = true;
  error_code ignored;
  acceptor.close(ignored);
  hub.on_empty = [this] { context.stop(); };
  timer.expires_after(kFinishTimeout);
  timer.async_wait([this](error_code) { context.stop(); });
  for (const auto& connection : std::set(hub.connections)) {
    if (connection->has_events()) connection->SendLast("event: end\ndata: " + data + "\n\n");
    if (!connection->has_request()) connection->Close();
  }
  if (hub.connections.empty()) context.stop();
}

void LiveServer::Impl::CloseAll() {
  hub.on_empty = {};
  for (const auto& connection : std::set(hub.connections)) connection->Close();
}

LiveServer::LiveServer(std::uint16_t port, Content content)
    : impl_(std::make_unique<Impl>(port, std::move(content))) {}

LiveServer::~LiveServer() {
  impl_->context.stop();
  if (impl_->thread.joinable()) impl_->thread.join();
  impl_->CloseAll();
}

void LiveServer::Start() {
  ALIDADE_EXPECTS(!impl_->thread.joinable());
  impl_->Accept();
  // Signals interrupt the thread of the run, which may wait for data.
  sigset_t all, previous;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &previous);
  impl_->thread = std::thread([impl = impl_.get()] {
    impl->Update();
    impl->context.run();
  });
  pthread_sigmask(SIG_SETMASK, &previous, nullptr);
}

void LiveServer::Finish(const std::string& data) {
  if (!impl_->thread.joinable()) return;
  asio::post(impl_->context, [this, &data] { impl_->Finish(data); });
  impl_->thread.join();
  impl_->CloseAll();
}

std::uint16_t LiveServer::port() const { return impl_->opened_port; }

std::int64_t LiveServer::dropped() const { return impl_->dropped; }

}  // namespace alidade::internal
