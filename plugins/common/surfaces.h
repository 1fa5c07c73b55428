// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/experiment/source.h"
#include "alidade/model/camera.h"

/// Textured surfaces of a simulated world, and their images in a camera.
namespace alidade {

/// Rectangle that looks the same from both sides. Its texture has structures of `grain_m` and
/// smaller.
struct Rectangle {
  Eigen::Vector3d corner, right, down;  ///< m, world; `right` and `down` are its edges
  double grain_m;
  std::uint64_t texture;  ///< equal numbers have equal textures
};

/// Renders the image of a camera at `position`, `orientation` (world_from_cam, w x y z), with grey
/// noise N(0, noise_grey^2). Pixels without a surface are black. A pixel is one ray, or at edges
/// the mean of 4 x 4 rays: a texture is smooth over a pixel, an edge is not.
GreyImage Render(const std::vector<Rectangle>& surfaces, const Camera& camera,
                 const double* position, const double* orientation, double noise_grey,
                 Random& noise);

}  // namespace alidade
