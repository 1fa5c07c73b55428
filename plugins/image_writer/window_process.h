// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <exception>
#include <opencv2/core.hpp>
#include <opencv2/highgui.hpp>
#include <string>

#include "alidade/base/error.h"

namespace alidade {

/// Window in a separate process. The library that draws windows ends its process if there is no
/// display, and it needs a separate thread. Images are sent to the process of the window through a
/// socket.
class WindowProcess {
 public:
  /// Opens the window. `shown` is the title as it appears in messages. Error: kCannotCreate, with
  /// `shown` in the message.
  WindowProcess(const std::string& title, const std::string& shown) {
    std::array<int, 2> sockets{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) == 0) {
      child_ = ::fork();
      if (child_ == 0) {
        ::close(sockets[0]);
        RunChild(sockets[1], title);
      }
      ::close(sockets[1]);
      socket_ = sockets[0];
    }
    const timeval timeout{10, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    char opened = 0;
    if (child_ > 0 && ::recv(socket_, &opened, 1, 0) == 1) return;
    End();
    throw Error(ExitCode::kCannotCreate, ErrorLine({}, shown, "the window cannot be opened",
                                                   "a display named by DISPLAY; --save-video "
                                                   "FILE.avi does not need a display"));
  }
  ~WindowProcess() { End(); }
  WindowProcess(const WindowProcess&) = delete;
  WindowProcess& operator=(const WindowProcess&) = delete;

  /// Shows an image, 8 bit BGR. Does nothing after the window has been closed.
  void Show(const cv::Mat& image) {
    const std::array<int, 2> size{image.cols, image.rows};
    const cv::Mat continuous = image.isContinuous() ? image : image.clone();
    is_closed_ = is_closed_ || !Send(size.data(), sizeof size) ||
                 !Send(continuous.data, continuous.total() * continuous.elemSize());
  }

 private:
  bool Send(const void* data, std::size_t size) const {
    const char* position = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t sent = ::send(socket_, position, size, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) return false;
      position += sent;
      size -= static_cast<std::size_t>(sent);
    }
    return true;
  }
  void End() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
    if (child_ > 0) {
      ::kill(child_, SIGKILL);  // the child may be waiting for the display
      ::waitpid(child_, nullptr, 0);
    }
    child_ = -1;
  }

  /// Runs the child process. The child ends after the last image, when its window is closed, or
  /// when its parent ends.
  [[noreturn]] static void RunChild(int socket, const std::string& title) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (const int signal_number :
         {SIGINT, SIGTERM, SIGHUP, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) {
      ::signal(signal_number, SIG_DFL);
    }
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    // Discards messages of the library about fonts and settings.
    const int null_device = ::open("/dev/null", O_RDWR);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
      ::dup2(null_device, stream);
    }
    try {
      cv::namedWindow(title, cv::WINDOW_NORMAL | cv::WINDOW_KEEPRATIO | cv::WINDOW_GUI_NORMAL);
      const char opened = 1;
      if (::send(socket, &opened, 1, MSG_NOSIGNAL) == 1) ShowAll(socket, title);
    } catch (const std::exception&) {  // the parent detects that the child has ended
    }
    ::_exit(0);
  }
  static void ShowAll(int socket, const std::string& title) {
    bool shown = false;
    while (true) {
      pollfd ready{socket, POLLIN, 0};
      if (::poll(&ready, 1, 0) > 0) {
        std::array<int, 2> size{};
        if (!Receive(socket, size.data(), sizeof size)) return;
        cv::Mat image(size[1], size[0], CV_8UC3);
        if (!Receive(socket, image.data, image.total() * image.elemSize())) return;
        if (!shown) cv::resizeWindow(title, image.size());
        cv::imshow(title, image);
        shown = true;
      }
      cv::waitKey(5);
      if (shown && cv::getWindowProperty(title, cv::WND_PROP_VISIBLE) < 1.0) return;
    }
  }
  static bool Receive(int socket, void* data, std::size_t size) {
    char* position = static_cast<char*>(data);
    while (size > 0) {
      const ssize_t received = ::recv(socket, position, size, 0);
      if (received <= 0) return false;
      position += received;
      size -= static_cast<std::size_t>(received);
    }
    return true;
  }

  int socket_ = -1;
  pid_t child_ = -1;
  bool is_closed_ = false;
};

}  // namespace alidade
