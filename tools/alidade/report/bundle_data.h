// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/io/json.h"
#include "alidade/report/column_pool.h"

namespace alidade::internal {

/// Returns the cameras and points of a bundle adjustment as the object `run` in the data of a page.
/// Returns null if there is no camera. Errors: kInputMissing, kBadData.
Json BundleScene(const std::filesystem::path& folder, ColumnPool& pool);

}  // namespace alidade::internal
