// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/report/column_pool.h"

namespace alidade::internal {

/// Largest number of points of a scene. Of more points, each n-th is returned.
inline constexpr std::size_t kScenePoints = 20'000;

/// Returns the cameras and points of a bundle adjustment as the trajectories `before` and `after`,
/// or null if the folder contains no poses. Errors: kBadData, kIo.
Json BundleScene(const std::filesystem::path& folder, ColumnPool& pool);

}  // namespace alidade::internal
