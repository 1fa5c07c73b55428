// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

/// Measures the times of several contenders in turn: repeatedly runs one short chunk of each
/// contender. Disturbances of the machine therefore affect all contenders equally. Only ratios of
/// times are meaningful.
namespace alidade::bench {

struct Contender {
  std::string name;
  std::function<void()> chunk;  ///< measured work, about 0.4 ms
  double steps = 1.0;           ///< number of steps in a chunk
  std::vector<double> ns;       ///< CPU time per step, for each chunk

  /// Returns the q-quantile of the time per step.
  double Quantile(double q) const {
    std::vector<double> sorted = ns;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
  }
};

inline double CpuNs() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

inline void Interleave(std::vector<Contender>& contenders, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    for (Contender& contender : contenders) {
      const double start = CpuNs();
      contender.chunk();
      contender.ns.push_back((CpuNs() - start) / contender.steps);
    }
  }
}

/// Prints the 1st percentile and the median of the times of the contenders, relative to the first
/// contender.
inline void PrintTable(const std::vector<Contender>& contenders) {
  std::printf("%-36s %8s %8s\n", "CPU time, relative to the first", "p01", "median");
  for (const Contender& contender : contenders) {
    std::printf("%-36s %8.2f %8.2f\n", contender.name.c_str(),
                contender.Quantile(0.01) / contenders[0].Quantile(0.01),
                contender.Quantile(0.5) / contenders[0].Quantile(0.5));
  }
}

/// Prints `ratio NAME VALUE`. VALUE is the 1st percentile of `a`, divided by that of `b`.
inline void PrintRatio(const std::string& name, const Contender& a, const Contender& b) {
  std::printf("ratio %s %.3f\n", name.c_str(), a.Quantile(0.01) / b.Quantile(0.01));
}

}  // namespace alidade::bench
