// SPDX-License-Identifier: Apache-2.0
//
// The input is the innovations.csv of a run folder.
#include "alidade/evaluate/evaluate.h"
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  const MemoryFile file(TextOf(data, size));
  static_cast<void>(Accepts([&] {
    for (const auto& sensor : alidade::ReadInnovations(file.path())) {
      Require(sensor.measurements > 0, "a sensor has no measurements");
      Require(sensor.nis_within95 >= 0.0 && sensor.nis_within95 <= 1.0,
              "a fraction is outside 0 to 1");
    }
  }));
  return 0;
}
