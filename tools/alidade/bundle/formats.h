// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "alidade/bundle/bundle_file.h"

/// The formats one by one: `text` is the whole file, `name` the file in messages.
namespace alidade::internal {

BundleFile ReadBal(std::string_view text, const std::string& name);
BundleFile ReadBundler(std::string_view text, const std::string& name);
BundleFile ReadLibmv(std::string_view bytes, const std::string& name);

std::string BalText(const BundleFile& file);
std::string BundlerText(const BundleFile& file);
std::string LibmvBytes(const BundleFile& file);

inline constexpr std::string_view kBundlerHeader = "# Bundle file v0.3";

/// The camera that stands where x_cam = R(q) x_world + t. `looks_back`: x_cam has y up and looks
/// along -z.
BundleCamera CameraFrom(const double* q, const double* t, bool looks_back);
/// q and t of a camera: the inverse.
void CameraTo(const BundleCamera& camera, bool looks_back, double* q, double* t);

/// The numbers of camera i in the file, where it stands as it was read; else null.
const double* UnmovedNumbers(const BundleFile& file, std::size_t i);

}  // namespace alidade::internal
