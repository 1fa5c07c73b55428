// SPDX-License-Identifier: Apache-2.0
#include "alidade/ekf.h"
#include "param_reader.h"

namespace alidade {
namespace {

EkfOptions Read(Params& p) {
  EkfOptions options;
  options.gate =
      p.Number("gate", "", "probability with which a measurement that fits passes; 1: no gate",
               {0.0, 1.0, true, false}, options.gate);
  options.fuse = static_cast<Fuse>(p.Choice("fuse", {"joint", "per_sensor", "per_measurement"},
                                            "how the measurements of one stamp make updates",
                                            static_cast<int>(options.fuse)));
  options.max_dt_s =
      p.Positive("max_dt_s", "s", "longer gaps are stepped in equal parts", options.max_dt_s);
  options.lockout = static_cast<Lockout>(p.Choice("lockout.action", {"reset", "inflate", "none"},
                                                  "what is done after so many rejections",
                                                  static_cast<int>(options.lockout)));
  options.lockout_after = p.Integer("lockout.after", "rejections of one sensor in a row", 1,
                                    1'000'000, options.lockout_after);
  return options;
}

}  // namespace

EkfOptions EkfOptions::FromNode(const Node& entry) {
  internal::ParamReader reader(entry, "estimator 'ekf'");
  Params params(&reader.host());
  const EkfOptions options = Read(params);
  reader.Check();
  return options;
}

std::vector<ParamInfo> EkfOptions::Schema() {
  internal::ParamRecorder recorder;
  recorder.Run([&] {
    Params params(&recorder.host());
    static_cast<void>(Read(params));
  });
  return recorder.Result();
}

}  // namespace alidade
