// SPDX-License-Identifier: Apache-2.0
//
// The input is the config of the source tracks, the tracks, and the files next to them.
#include "plugins/tracks/tracks.h"

#include "fuzz.h"
#include "read_source.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  static const Folder folder;
  constexpr const char* kFiles[] = {"tracks.csv",      "timestamps.csv", "odometry.csv",
                                    "groundtruth.tum", "known.csv",      "calibration.yaml"};
  const auto parts = Parts(TextOf(data, size), 1 + std::size(kFiles));
  for (std::size_t i = 0; i < std::size(kFiles); ++i) folder.Put(kFiles[i], parts[i + 1]);
  static_cast<void>(Accepts([&] { ReadSource(alidade::CreateTracks, parts[0], folder.path()); }));
  return 0;
}
