// SPDX-License-Identifier: Apache-2.0
//
// The input contains the files of a run folder that `alidade compare` reads. The estimator is
// `ekf`.
#include "alidade/compare/finished_run.h"
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  static const Folder folder;
  constexpr const char* kFiles[] = {"run.json",          "timing.json",       "columns.json",
                                    "ekf/estimates.csv", "ekf/landmarks.csv", "ekf/covariance.bin"};
  const auto parts = Parts(TextOf(data, size), std::size(kFiles));
  for (std::size_t i = 0; i < std::size(kFiles); ++i) folder.Put(kFiles[i], parts[i]);
  static_cast<void>(Accepts([&] {
    const auto run = alidade::internal::ReadRun(folder.path());
    for (const auto& entry : run.estimators) {
      const auto& series = entry.series;
      Require(series.values.size() ==
                  series.timestamps.size() * static_cast<std::size_t>(series.ambient()),
              "values of another width");
      static_cast<void>(entry.measurements() - entry.used());
    }
  }));
  return 0;
}
