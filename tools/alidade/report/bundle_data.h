// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/report/column_pool.h"

namespace alidade::internal {

/// Returns `bundle.json` with conclusions, iterations, the rms of each camera, residuals and the
/// worst observations. Of many residuals, the largest and each n-th of the others are returned.
/// Errors: kBadData, kIo.
Json BundleData(const std::filesystem::path& folder, const Json& bundle, ColumnPool& pool);

}  // namespace alidade::internal
