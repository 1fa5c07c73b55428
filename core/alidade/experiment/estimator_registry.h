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
  std::vector<TextRow> specific;  ///< keys and texts of the options of this type only
};

/// Built-in type of estimator, for `type:` of an entry of `estimators:`.
struct EstimatorType {
  const char* name;
  const char* doc;  ///< one line
  EstimatorCapabilities capabilities;
  EstimatorKind kind;
  /// Reads the keys of the entry. Errors: kBadConfig.
  std::function<EstimatorMaker(const Node& entry)> read;
  std::function<std::vector<ParamInfo>()> schema;  ///< parameters that `read` reads
  /// Describes the options of an entry.
  std::function<Description(const Node& entry)> describe;
};

/// Returns all built-in types; the first is `ekf`.
const std::vector<EstimatorType>& EstimatorTypes();
/// Returns the type with this name, or null.
const EstimatorType* FindEstimatorType(std::string_view name);

}  // namespace alidade::internal
