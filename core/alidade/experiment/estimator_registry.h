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

/// The options of an estimator's entry.
struct Description {
  EkfOptions common;         ///< of every filter
  std::vector<TextRow> own;  ///< key and value in words, of what only some have
};

/// A type of estimator that core has itself, for `type:` of an entry of `estimators:`.
struct EstimatorType {
  const char* name;
  const char* doc;  ///< one line
  EstimatorCapabilities capabilities;
  EstimatorKind kind;
  /// Reads the entry's keys. Errors: kBadConfig.
  std::function<EstimatorMaker(const Node& entry)> read;
  std::function<std::vector<ParamInfo>()> schema;  ///< what `read` asks for
  /// The options that an entry sets, in words.
  std::function<Description(const Node& entry)> describe;
};

/// All of them; the first is `ekf`.
const std::vector<EstimatorType>& EstimatorTypes();
/// Null where there is none of that name.
const EstimatorType* FindEstimatorType(std::string_view name);

}  // namespace alidade::internal
