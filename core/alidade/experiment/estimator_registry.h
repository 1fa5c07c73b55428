// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/ekf.h"
#include "alidade/experiment/estimator_plugin.h"
#include "alidade/io/text_table.h"

namespace alidade::internal {

/// Options of an estimator entry, for display.
struct Description {
  EkfOptions common;              ///< options of every filter
  std::vector<TextRow> specific;  ///< key and text of each option that only this type has
};

/// Built-in estimator type, which the key `type` of an entry of `estimators:` selects.
struct EstimatorType {
  const char* name;
  const char* doc;  ///< description in one line
  EstimatorCapabilities capabilities;
  EstimatorKind kind;
  /// Reads the keys of the entry. Errors: kBadConfig.
  std::function<EstimatorMaker(const Node& entry)> read;
  std::function<std::vector<ParamInfo>()> schema;  ///< parameters that `read` reads
  /// Describes the options of an entry.
  std::function<Description(const Node& entry)> describe;
};

/// Returns the keys that all types of estimator have.
const std::vector<ParamInfo>& CommonEstimatorKeys();
/// Returns all built-in types; the first is `ekf`.
const std::vector<EstimatorType>& EstimatorTypes();
/// Returns the type with this name, or null.
const EstimatorType* FindEstimatorType(std::string_view name);

}  // namespace alidade::internal
