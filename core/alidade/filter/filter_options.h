// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/filter/ekf.h"
#include "alidade/host/param_reader.h"
#include "alidade/model/params.h"

namespace alidade::internal {

/// What every recursive filter reads: `gate`, `fuse`, `max_dt_s`.
EkfOptions ReadCommonOptions(Params& p);

inline EkfOptions WithoutRecovery(EkfOptions options) {
  options.rejection_recovery = RejectionRecovery::kNone;
  return options;
}

/// What `read` makes of the entry of an estimator of that type. Errors: kBadConfig.
template <class Read>
auto OptionsFromNode(const Node& entry, const std::string& type, const Read& read) {
  ParamReader reader(entry, "estimator '" + type + "'");
  Params params(&reader.host());
  const auto options = read(params);
  reader.Check();
  return options;
}

/// The keys that `read` asks for.
template <class Read>
std::vector<ParamInfo> SchemaOf(const Read& read) {
  ParamRecorder recorder;
  recorder.Run([&] {
    Params params(&recorder.host());
    static_cast<void>(read(params));
  });
  return recorder.Result();
}

}  // namespace alidade::internal
