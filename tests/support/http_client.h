// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <string>

namespace alidade::testing {

/// Connection to a server of this computer.
class HttpClient {
 public:
  /// Connects to `port` of `address`. A small `receive_buffer` makes a slow reader.
  explicit HttpClient(std::uint16_t port, const char* address = "127.0.0.1", int receive_buffer = 0)
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) {
      ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    sockaddr_in endpoint{};
    endpoint.sin_family = AF_INET;
    endpoint.sin_port = htons(port);
    ::inet_pton(AF_INET, address, &endpoint.sin_addr);
    is_connected_ =
        ::connect(socket_, reinterpret_cast<const sockaddr*>(&endpoint), sizeof endpoint) == 0;
  }
  ~HttpClient() { ::close(socket_); }
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  bool is_connected() const { return is_connected_; }
  void Send(const std::string& text) const {
    EXPECT_EQ(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL), std::ssize(text));
  }
  /// Sends a request with the header Host, unless `host` is "".
  void Request(const std::string& method, const std::string& target,
               const std::string& host = "127.0.0.1") const {
    const std::string header = host.empty() ? "" : "Host: " + host + "\r\n";
    Send(method + ' ' + target + " HTTP/1.1\r\n" + header + "\r\n");
  }
  /// Returns everything that was received until it contains `text`, for at most 10 s. An empty
  /// `text` waits for the end of the connection.
  const std::string& ReceiveUntil(const std::string& text) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    char buffer[1 << 16];
    while (text.empty() || received_.find(text) == received_.npos) {
      pollfd readable{socket_, POLLIN, 0};
      if (std::chrono::steady_clock::now() > end || ::poll(&readable, 1, 10'000) <= 0) {
        ADD_FAILURE() << "no '" << text << "' in " << received_.substr(0, 200);
        break;
      }
      const ssize_t size = ::recv(socket_, buffer, sizeof buffer, 0);
      if (size <= 0) break;
      received_.append(buffer, static_cast<std::size_t>(size));
    }
    return received_;
  }
  void Clear() { received_.clear(); }

 private:
  int socket_;
  bool is_connected_ = false;
  std::string received_;
};

/// Returns the response of a server to a request.
inline std::string Response(std::uint16_t port, const std::string& method,
                            const std::string& target, const std::string& host = "127.0.0.1") {
  HttpClient client(port);
  client.Request(method, target, host);
  return client.ReceiveUntil("");
}

}  // namespace alidade::testing
