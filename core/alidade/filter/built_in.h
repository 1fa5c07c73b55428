// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/text_table.h"
#include "alidade/config/config.h"
#include "alidade/filter/ekf.h"
#include "alidade/filter/support.h"
#include "alidade/host/plugin_host.h"

namespace alidade::internal {

/// The options of an estimator's entry.
struct Description {
  EkfOptions common;         ///< of every filter
  std::vector<TextRow> own;  ///< key and value in words, of what only some have
};

/// A type of estimator that core has itself, for `type:` of an entry of `estimators:`.
struct EstimatorType {
  const char* name;
  const char* doc;  ///< one line
  /// Reads the entry's keys. Errors: kBadConfig.
  EstimatorMaker (*read)(const Node& entry);
  std::vector<ParamInfo> (*schema)();  ///< what `read` asks for
  /// The options that an entry sets, in words.
  Description (*describe)(const Node& entry);
  Support support;
  EstimatorKind kind = EstimatorKind::kFilter;
};

/// All of them; the first is `ekf`.
const std::vector<EstimatorType>& EstimatorTypes();
/// Null where there is none of that name.
const EstimatorType* FindEstimatorType(std::string_view name);

/// Refuses by name the keys of an estimator's entry that are left unread but other types have:
/// `gate`, `fuse`, `jacobian`, `rejection_recovery`. To be called once the entry's own keys have
/// been read. Errors: kBadConfig.
void RefuseUnsupportedKeys(const std::string& type, const Node& entry);
/// The same for what `system`, built from the config `root`, asks for beyond `support`.
/// Errors: kBadConfig.
void RefuseUnsupported(const std::string& type, const Support& support, const Node& root,
                       const System& system);
/// Refuses `fuse: per_measurement` of an estimator, the map `entry`, where a sensor looks for
/// matches that agree. Error: kBadConfig.
void RefuseLoneMatches(const Node& entry, const System& system);

}  // namespace alidade::internal
