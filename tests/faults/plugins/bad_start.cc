// SPDX-License-Identifier: Apache-2.0
// A static constructor that ends the process in the way that BAD_START names.
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "alidade/plugin.h"
#include "probe.h"

#define CRASH 1
#define ABORT 2
#define EXIT 3

namespace {

struct Start {
  Start() {
    if (BAD_START == CRASH) std::raise(SIGSEGV);
    if (BAD_START == ABORT) std::abort();
    if (BAD_START == EXIT) std::exit(0);
  }
};
const Start kStart;

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Probe, "probe", "", ""))
