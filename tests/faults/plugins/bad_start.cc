// SPDX-License-Identifier: Apache-2.0
// A static constructor that ends the process, or changes it, in the way that BAD_START names.
#include <unistd.h>

#include <cfenv>
#include <clocale>
#include <csignal>
#include <cstdlib>

#include "alidade/model/plugin.h"
#include "probe.h"

#define CRASH 1
#define ABORT 2
#define EXIT 3
#define ROUND 4
#define LOCALE 5

namespace {

struct Start {
  Start() {
    if (BAD_START == CRASH) std::raise(SIGSEGV);
    if (BAD_START == ABORT) std::abort();
    if (BAD_START == EXIT) std::exit(0);
    if (BAD_START == ROUND) std::fesetround(FE_DOWNWARD);
    if (BAD_START == LOCALE) std::setlocale(LC_ALL, "C.UTF-8");
  }
};
const Start kStart;

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Probe, "probe", "", ""))
