// SPDX-License-Identifier: Apache-2.0
#include "support/http_client.h"
#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::HttpClient;
using testing::Outcome;
using LiveCli = testing::ProgramTest;

/// Returns the port in `note: live page at http://127.0.0.1:PORT/`; 0 if the text has no port yet.
std::uint16_t LivePort(const std::string& text) {
  const std::string start = "live page at http://127.0.0.1:";
  const std::size_t found = text.find(start);
  if (found == text.npos || text.find("/\n", found) == text.npos) return 0;
  return static_cast<std::uint16_t>(std::stoul(text.substr(found + start.size())));
}

TEST_F(LiveCli, RefusesAnAddress) {
  for (const char* address :
       {"0.0.0.0:8080", "192.168.0.5:8080", "localhost:8080", ":8080", "-1"}) {
    const Outcome outcome =
        Call({"run", "config.yaml", std::string("--live=") + address, "-o", "run"});
    EXPECT_EQ(outcome.code, 2) << address;
    EXPECT_TRUE(Contains(outcome.err, "is not a port")) << outcome.err;
    EXPECT_TRUE(Contains(outcome.err, "served at 127.0.0.1 only")) << outcome.err;
  }
  const Outcome large = Call({"run", "config.yaml", "--live", "65536", "-o", "run"});
  EXPECT_EQ(large.code, 2);
  EXPECT_TRUE(Contains(large.err, "'65536' is not a port")) << large.err;
  EXPECT_FALSE(Exists("run")) << "a refused command has run";
}

TEST_F(LiveCli, NamesAPortInUseAndLeavesNoFolder) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in endpoint{};
  endpoint.sin_family = AF_INET;
  endpoint.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof endpoint;
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&endpoint), size), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  ASSERT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&endpoint), &size), 0);
  const std::string port = std::to_string(ntohs(endpoint.sin_port));
  const Outcome outcome = Call({"run", "config.yaml", "--live", port, "-o", "run"});
  ::close(listener);
  EXPECT_EQ(outcome.code, 73);
  EXPECT_TRUE(Contains(outcome.err, "127.0.0.1:" + port + ": the port cannot be opened"))
      << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "0, which selects a free port")) << outcome.err;
  EXPECT_FALSE(Exists("run.partial"));
}

TEST_F(LiveCli, WritesTheSameFiles) {
  const Outcome without = Call({"run", "config.yaml", "-o", "without"});
  const Outcome with = Call({"run", "config.yaml", "-o", "with", "--live", "0"});
  EXPECT_EQ(with.code, without.code) << with.err;
  EXPECT_TRUE(Contains(with.err, "ended with 0 dropped updates; its report is with/report.html"))
      << with.err;
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / "without")) {
    const std::string name = entry.path().lexically_relative(folder_ / "without").string();
    // The wall-clock times differ.
    if (!entry.is_regular_file() || name == "timing.json" || name == "timing.csv") continue;
    EXPECT_TRUE(Read("without/" + name) == Read("with/" + name)) << name;
    ++files;
  }
  EXPECT_GT(files, 10);
}

TEST_F(LiveCli, ShowsTheRowsOfAPipeAndEndsWithTheRun) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const pid_t program =
      Start({"run", "table.yaml", "--set", "source.path=pipe", "--live", "0", "-o", "run"});
  std::ofstream pipe(folder_ / "pipe");
  pipe << "t_s,d" << std::endl;
  ASSERT_TRUE(Eventually([&] { return LivePort(Read("stderr")) != 0; })) << Read("stderr");
  const std::uint16_t port = LivePort(Read("stderr"));
  EXPECT_TRUE(Contains(testing::Response(port, "GET", "/"), "\"status\":\"running\""));
  HttpClient client(port);
  client.Request("GET", "/events");
  client.ReceiveUntil("\r\n\r\n");
  std::thread robot([&] {
    for (int i = 0; i < 20; ++i) {
      pipe << 0.1 * i << ",86" << std::endl;
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
    }
  });
  client.ReceiveUntil("data: {");  // during the run
  robot.join();
  pipe.close();
  EXPECT_TRUE(Contains(client.ReceiveUntil(""), "event: end\ndata: {"));
  const Outcome outcome = Wait(program);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_FALSE(HttpClient(port).is_connected());
}

}  // namespace
}  // namespace alidade
