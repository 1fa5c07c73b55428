// SPDX-License-Identifier: Apache-2.0
// Models that see whether another one is created while they are.
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "alidade/model/plugin.h"
#include "probe.h"

namespace {

/// Waits for a second one, and fails where it does not come.
struct InCompany : Probe {
  explicit InCompany(alidade::Params& p) : Probe(p) {
    static std::atomic<int> came{0};
    ++came;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (came < 2 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    if (came < 2) throw std::runtime_error("nobody came");
  }
};

/// Fails where a second one comes.
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

constexpr AlidadeEntry OneAtATime() {
  AlidadeEntry entry = ALIDADE_SENSOR(Alone, "alone", "", "");
  entry.thread_flags = 0;
  return entry;
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(InCompany, "in_company", "", ""), OneAtATime())
