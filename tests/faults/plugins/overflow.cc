// SPDX-License-Identifier: Apache-2.0
// A model that uses up the stack of any thread but the first, which it keeps busy meanwhile.
#include <unistd.h>

#include "alidade/model/plugin.h"
#include "probe.h"

namespace {

volatile double g_zero = 0.0;  // keeps the compiler from knowing better

int Deeper(int level) {
  volatile char room[4096];
  room[0] = static_cast<char>(level);
  return g_zero == 0.0 ? Deeper(level + 1) + room[0] : level;
}

struct Overflows : Probe {
  using Probe::Probe;
  template <class T>
  bool Predict(const T* x, T* z) const {
    if (::gettid() != ::getpid()) static_cast<void>(Deeper(0));
    ::usleep(10'000);
    return Probe::Predict(x, z);
  }
};

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Overflows, "overflows", "", ""))
