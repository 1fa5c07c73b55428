// SPDX-License-Identifier: Apache-2.0
//
// Shows a filter in your own program. The program reads lines `t_s stream value` from standard
// input. It passes each measurement to the filter when it arrives, and predicts the state.
#include <alidade/experiment/experiment.h>
#include <alidade/experiment/make_filter.h>

#include <cstdio>
#include <iostream>
#include <string>

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("usage: live CONFIG");
  const auto config = alidade::Config::FromFile(argv[1]);
  const alidade::PluginHost host(alidade::PluginPaths(config));
  const auto filter = alidade::MakeFilter(config, host, "ekf");
  const alidade::BlockId depth = filter->block("target.depth");
  double t_s = 0.0, value = 0.0;
  for (std::string stream; std::cin >> t_s >> stream >> value;) {
    const alidade::Timestamp now = alidade::TimestampFromSeconds(t_s);
    const alidade::UpdateReport& report = filter->Push(now, {{filter->stream(stream), {value}}});
    for (const alidade::Event& event : report.events) std::cerr << event.text << '\n';
    const alidade::State soon = filter->At(now + 50'000'000);  // does not change the filter
    std::printf("%.3f s: in 50 ms the depth is %.3f +- %.3f m\n", t_s, soon.value(depth)[0],
                soon.sigma(depth));
  }
} catch (const std::exception& e) {
  std::cerr << "error: " << e.what() << '\n';
  return 1;
}
