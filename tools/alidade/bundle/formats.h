// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "alidade/bundle/bundle_file.h"

/// Readers and writers of the bundle formats. `text` is the whole file; `name` is the name of the
/// file in messages.
namespace alidade::internal {

BundleFile ReadBal(std::string_view text, const std::string& name);
BundleFile ReadBundler(std::string_view text, const std::string& name);
BundleFile ReadLibmv(std::string_view bytes, const std::string& name);

/// Texts of the three files of a COLMAP folder.
struct ColmapTexts {
  std::string cameras, images, points;
};
/// Reads a COLMAP folder whose files have these texts.
BundleFile ReadColmap(const ColmapTexts& texts, const std::filesystem::path& folder);
ColmapTexts ColmapTextsOf(const BundleFile& file);

std::string BalText(const BundleFile& file);
std::string BundlerText(const BundleFile& file);
std::string LibmvBytes(const BundleFile& file);

inline constexpr std::string_view kBundlerHeader = "# Bundle file v0.3";

/// Converts x_cam = R(q) x_world + t to a camera. If `looks_back` is true, the camera frame of q
/// and t has y up, and the camera looks along -z.
BundleCamera CameraFromTransform(const double* q, const double* t, bool looks_back);
/// Computes q and t of a camera: the inverse of CameraFromTransform.
void TransformFromCamera(const BundleCamera& camera, bool looks_back, double* q, double* t);

/// Returns the numbers of the pose of camera i in the file. Returns null if the pose has changed
/// since the file was read.
const double* UnmovedNumbers(const BundleFile& file, std::size_t i);

}  // namespace alidade::internal
