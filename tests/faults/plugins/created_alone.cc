// SPDX-License-Identifier: Apache-2.0
// A model that fails if another instance is created at the same time.
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "alidade/model/plugin.h"
#include "probe.h"

namespace {

/// A model whose creation fails if another instance is being created at the same time.
struct Alone : Probe {
  explicit Alone(alidade::Params& p) : Probe(p) {
    static std::atomic<int> inside{0};
    bool alone = ++inside == 1;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    alone = alone && inside == 1;
    --inside;
    if (!alone) throw std::runtime_error("somebody came");
  }
};

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Alone, "alone", "", ""))
