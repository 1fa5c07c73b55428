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

/// Rectangle that looks the same from both sides. The largest structures of its texture have the
/// size `grain_m`.
struct Rectangle {
  Eigen::Vector3d corner, right, down;  ///< a corner, and the two edges from this corner; world, m
  double grain_m;
  std::uint64_t texture;  ///< number that determines the texture
};

/// Renders the image of a camera at `position`, `orientation` (world_from_cam, w x y z), with grey
/// noise N(0, noise_grey^2). Pixels without a surface are black. A pixel inside a surface is
/// computed from one ray, because textures are smooth over a pixel. A pixel at an edge is the mean
/// of 4 x 4 rays.
GreyImage Render(const std::vector<Rectangle>& surfaces, const Camera& camera,
                 const double* position, const double* orientation, double noise_grey,
                 Random& noise);

}  // namespace alidade
