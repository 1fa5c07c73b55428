// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "alidade/evaluate/evaluate.h"

namespace alidade::internal {

/// The statistics with evo's names, in its order.
inline constexpr std::pair<const char*, double ErrorStatistics::*> kStatistics[] = {
    {"rmse", &ErrorStatistics::rmse},     {"mean", &ErrorStatistics::mean},
    {"median", &ErrorStatistics::median}, {"std", &ErrorStatistics::std},
    {"min", &ErrorStatistics::min},       {"max", &ErrorStatistics::max},
    {"sse", &ErrorStatistics::sse}};

/// Whether the first poses alone are aligned: of the alignments by least squares.
inline bool LimitsAlignment(const EvaluateOptions& options) {
  return options.align_poses > 0 && options.alignment != Alignment::kNone &&
         options.alignment != Alignment::kOrigin;
}

}  // namespace alidade::internal
