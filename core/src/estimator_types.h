// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/config.h"
#include "alidade/ekf.h"

namespace alidade::internal {

/// Makes the estimator once its system is known.
using EstimatorMaker = std::function<std::unique_ptr<Estimator>(
    const System& system, const std::vector<StreamInfo>& streams)>;

/// A type of estimator that core has itself, for `type:` of an entry of `estimators:`.
struct EstimatorType {
  const char* name;
  const char* doc;      ///< one line
  const char* support;  ///< what it can do and what not, as `explain` says it
  /// Reads the entry's keys. Errors: kBadConfig.
  EstimatorMaker (*read)(const Node& entry);
  std::vector<ParamInfo> (*schema)();  ///< what `read` asks for
  /// Considered blocks and roles, linearise_at: measurement, blocks that start from a measurement,
  /// lock-out recovery.
  bool extended;
};

/// All of them; the first is `ekf`.
const std::vector<EstimatorType>& EstimatorTypes();
/// Null where there is none of that name.
const EstimatorType* FindEstimatorType(std::string_view name);

/// Refuses by name the keys of an estimator's entry that its type has no use for: `lockout`, `loss`.
/// Errors: kBadConfig.
void RefuseUnsupportedKeys(const EstimatorType& type, const Node& entry);
/// The same for what `system`, built from the config `root`, asks of it: considered blocks and
/// roles, blocks that start from a measurement, linearise_at: measurement. Errors: kBadConfig.
void RefuseUnsupported(const EstimatorType& type, const Node& root, const System& system);

}  // namespace alidade::internal
