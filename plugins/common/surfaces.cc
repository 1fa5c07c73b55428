// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/surfaces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "alidade/model/geometry.h"

namespace alidade {
namespace {

/// Returns a pseudo-random value, uniform in [0, 1), that depends only on the arguments.
double LatticeValue(std::uint64_t texture, std::uint64_t octave, std::int64_t x, std::int64_t y) {
  std::uint64_t bits = texture * 0x9e3779b97f4a7c15U + octave;
  for (const std::int64_t number : {x, y}) {
    bits = (bits ^ static_cast<std::uint64_t>(number)) * 0xbf58476d1ce4e5b9U;
    bits ^= bits >> 29;
  }
  bits *= 0x94d049bb133111ebU;
  return 0x1p-53 * static_cast<double>((bits ^ (bits >> 31)) >> 11);
}

/// Returns the brightness in [0, 1] of a texture at (x, y), m: a sum of lattice noises
/// [Perlin1985]. Each noise has half the wavelength and 0.8 times the amplitude of the previous
/// noise. Noises that a sample of width `sample_m` cannot resolve are faded out, which avoids
/// aliasing.
double Brightness(const Rectangle& rectangle, double x, double y, double sample_m) {
  constexpr double kFalloff = 0.8, kContrast = 0.9;
  double sum = 0.0, amplitude = 1.0, squares = 0.0, wavelength = rectangle.grain_m;
  for (std::uint64_t octave = 0; octave < 16; ++octave) {
    const double share = std::clamp(0.5 * wavelength / sample_m - 1.0, 0.0, 1.0);
    if (share == 0.0) break;
    const double u = x / wavelength, v = y / wavelength;
    const double u0 = std::floor(u), v0 = std::floor(v);
    const auto smooth = [](double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); };
    const double a = smooth(u - u0), b = smooth(v - v0);
    const auto i = static_cast<std::int64_t>(u0), j = static_cast<std::int64_t>(v0);
    const auto value_at = [&](std::int64_t k, std::int64_t l) {
      return LatticeValue(rectangle.texture, octave, i + k, j + l);
    };
    const double value = (1.0 - b) * ((1.0 - a) * value_at(0, 0) + a * value_at(1, 0)) +
                         b * ((1.0 - a) * value_at(0, 1) + a * value_at(1, 1));
    sum += share * amplitude * (value - 0.5);
    squares += amplitude * amplitude;
    amplitude *= kFalloff;
    wavelength *= 0.5;
  }
  if (squares == 0.0) return 0.5;
  return std::clamp(0.5 + kContrast * sum / std::sqrt(squares), 0.0, 1.0);
}

/// First surface on a ray.
struct Hit {
  int surface = -1;  ///< -1: the ray hits no surface
  double brightness = 0.0;
};

/// View of surfaces from a camera at `position`, `orientation` (world_from_cam, w x y z).
class SurfaceView {
 public:
  SurfaceView(const std::vector<Rectangle>& surfaces, const Camera& camera, const double* position,
              const double* orientation)
      : surfaces_(surfaces),
        camera_(camera),
        eye_(position[0], position[1], position[2]),
        orientation_{orientation[0], orientation[1], orientation[2], orientation[3]} {
    for (const Rectangle& surface : surfaces) {
      const Eigen::Vector3d normal = surface.right.cross(surface.down).normalized();
      planes_.push_back({normal, surface.right / surface.right.squaredNorm(),
                         surface.down / surface.down.squaredNorm(),
                         normal.dot(surface.corner - eye_), surface.right.norm(),
                         surface.down.norm()});
    }
  }

  /// Returns the nearest surface on the ray through pixel (u, v).
  Hit Trace(double u, double v) const {
    const double z[2] = {u, v};
    double h[3];
    Hit hit;
    if (!camera_.Unproject(z, h)) return hit;
    Eigen::Vector3d ray;
    UnitQuaternion::Rotate(orientation_.data(), h, ray.data());
    double nearest = std::numeric_limits<double>::infinity(), right = 0.0, down = 0.0;
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      const Plane& plane = planes_[i];
      const double range = plane.distance / plane.normal.dot(ray);
      if (!(range > 0.0) || !(range < nearest)) continue;
      const Eigen::Vector3d point = eye_ + range * ray - surfaces_[i].corner;
      const double a = plane.right.dot(point), b = plane.down.dot(point);
      if (a < 0.0 || a > 1.0 || b < 0.0 || b > 1.0) continue;
      nearest = range;
      right = a * plane.width;
      down = b * plane.height;
      hit.surface = static_cast<int>(i);
    }
    if (hit.surface < 0) return hit;
    const auto index = static_cast<std::size_t>(hit.surface);
    const double length = ray.norm();
    const double cosine = std::max(std::abs(planes_[index].normal.dot(ray)) / length, 0.05);
    hit.brightness =
        Brightness(surfaces_[index], right, down, nearest * length / (camera_.fx * cosine));
    return hit;
  }

  /// Returns the mean brightness of 4 x 4 rays through a pixel. Used for pixels at the edge of a
  /// surface.
  double MeanBrightness(int u, int v) const {
    constexpr double kOffsets[] = {-0.375, -0.125, 0.125, 0.375};
    double sum = 0.0;
    for (const double du : kOffsets) {
      for (const double dv : kOffsets) sum += Trace(u + du, v + dv).brightness;
    }
    return sum / 16.0;
  }

 private:
  struct Plane {
    Eigen::Vector3d normal, right, down;  ///< unit normal; edges divided by their squared length
    double distance, width, height;       ///< signed distance from the camera, m; sides, m
  };
  const std::vector<Rectangle>& surfaces_;
  const Camera& camera_;
  Eigen::Vector3d eye_;
  std::array<double, 4> orientation_;
  std::vector<Plane> planes_;
};

}  // namespace

GreyImage Render(const std::vector<Rectangle>& surfaces, const Camera& camera,
                 const double* position, const double* orientation, double noise_grey,
                 Random& noise) {
  const SurfaceView view(surfaces, camera, position, orientation);
  std::vector<Hit> hits;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) hits.push_back(view.Trace(u, v));
  }
  const auto hit_at = [&](int u, int v) {
    const auto column = static_cast<std::size_t>(std::clamp(u, 0, camera.width - 1));
    const auto row = static_cast<std::size_t>(std::clamp(v, 0, camera.height - 1));
    return hits[row * static_cast<std::size_t>(camera.width) + column];
  };
  GreyImage image{camera.width, camera.height, {}};
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Hit hit = hit_at(u, v);
      const bool edge =
          hit_at(u - 1, v).surface != hit.surface || hit_at(u + 1, v).surface != hit.surface ||
          hit_at(u, v - 1).surface != hit.surface || hit_at(u, v + 1).surface != hit.surface;
      double grey = 255.0 * (edge ? view.MeanBrightness(u, v) : hit.brightness);
      if (noise_grey > 0.0) grey += noise_grey * noise.Normal();
      image.pixels.push_back(static_cast<std::uint8_t>(std::clamp(grey + 0.5, 0.0, 255.0)));
    }
  }
  return image;
}

}  // namespace alidade
