// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "alidade/config.h"
#include "alidade/plugin_host.h"

namespace alidade::internal {

/// What an estimator can do with a system, beyond estimated and fixed blocks and held roles.
struct Support {
  bool considered;      ///< blocks and roles
  bool at_measurement;  ///< linearise_at: measurement
  bool recovery;        ///< blocks that start from a measurement, and from one after a lock-out
  bool robust_loss;
  bool landmarks = false;
};

/// A type of estimator that core has itself, for `type:` of an entry of `estimators:`.
struct EstimatorType {
  const char* name;
  const char* doc;  ///< one line
  /// Reads the entry's keys. Errors: kBadConfig.
  EstimatorMaker (*read)(const Node& entry);
  std::vector<ParamInfo> (*schema)();  ///< what `read` asks for
  Support support;
};

/// All of them; the first is `ekf`.
const std::vector<EstimatorType>& EstimatorTypes();
/// Null where there is none of that name.
const EstimatorType* FindEstimatorType(std::string_view name);

/// Refuses by name the keys of an estimator's entry that its type cannot have but others do:
/// `jacobian`, `lockout`. Errors: kBadConfig.
void RefuseUnsupportedKeys(const EstimatorType& type, const Node& entry);
/// The same for what `system`, built from the config `root`, asks of it: considered blocks and
/// roles, blocks that start from a measurement, linearise_at: measurement, a robust loss, and
/// landmarks. Errors: kBadConfig.
void RefuseUnsupported(const EstimatorType& type, const Node& root, const System& system);

}  // namespace alidade::internal
