// SPDX-License-Identifier: Apache-2.0
// A static constructor that ends the process, or changes it, in the way that BAD_START names.
#include <cxxabi.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cfenv>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "alidade/model/plugin.h"
#include "probe.h"

#define CRASH 1
#define ABORT 2
#define EXIT 3
#define ROUND 4
#define LOCALE 5
#define PRINT 6
#define IGNORE 7
#define BLOCK 8
#define ALARM 9
#define PATH 10
#define CLOSE 11
#define MASK 12
#define AT_EXIT 13

namespace {

struct Start {
  Start() {
    if (BAD_START == CRASH) std::raise(SIGSEGV);
    if (BAD_START == ABORT) std::abort();
    if (BAD_START == EXIT) std::exit(0);
    if (BAD_START == ROUND) std::fesetround(FE_DOWNWARD);
    if (BAD_START == LOCALE) std::setlocale(LC_ALL, "C.UTF-8");
    if (BAD_START == PRINT) std::puts("Hello from the constructor"), std::fflush(stdout);
    if (BAD_START == IGNORE) std::signal(SIGTERM, SIG_IGN);
    if (BAD_START == BLOCK) {
      sigset_t all;
      sigfillset(&all);
      sigprocmask(SIG_BLOCK, &all, nullptr);
    }
    if (BAD_START == ALARM) alarm(1000);
    if (BAD_START == PATH) setenv("PATH", "/tmp", 1);
    if (BAD_START == CLOSE) close(STDOUT_FILENO);
    if (BAD_START == MASK) umask(0777);
    if (BAD_START == AT_EXIT) {  // of no library: no destructor of this one calls it
      abi::__cxa_atexit([](void*) { std::raise(SIGSEGV); }, nullptr, nullptr);
    }
  }
};
const Start kStart;

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Probe, "probe", "", ""))
