// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

/// Times contenders side by side: one short chunk of each in turn, again and again, so that what
/// disturbs the machine disturbs all of them alike. Only ratios mean anything.
namespace alidade::bench {

struct Contender {
  std::string name;
  std::function<void()> chunk;  ///< about 0.4 ms
  double steps = 1.0;           ///< in a chunk
  std::vector<double> ns;       ///< CPU time of a step, by chunk

  /// q-quantile of the time of a step.
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
    for (Contender& one : contenders) {
      const double start = CpuNs();
      one.chunk();
      one.ns.push_back((CpuNs() - start) / one.steps);
    }
  }
}

/// Prints each contender's times in units of the first's: 1st percentile and median.
inline void PrintTable(const std::vector<Contender>& contenders) {
  std::printf("%-36s %8s %8s\n", "relative to the first, CPU time", "p01", "median");
  for (const Contender& one : contenders) {
    std::printf("%-36s %8.2f %8.2f\n", one.name.c_str(),
                one.Quantile(0.01) / contenders[0].Quantile(0.01),
                one.Quantile(0.5) / contenders[0].Quantile(0.5));
  }
}

/// `ratio A/B VALUE`, of the 1st percentiles.
inline void PrintRatio(const std::string& name, const Contender& a, const Contender& b) {
  std::printf("ratio %s %.3f\n", name.c_str(), a.Quantile(0.01) / b.Quantile(0.01));
}

}  // namespace alidade::bench
