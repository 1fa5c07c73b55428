// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "support/bundles.h"

/// Camera models and text files of COLMAP, by the formulas of its documentation. These functions
/// share no code with the reader.
namespace alidade::testing {

/// Returns the pixel at which a camera of COLMAP observes (x, y, 1).
inline std::array<double, 2> ColmapPixel(const std::string& model, const std::vector<double>& a,
                                         double x, double y) {
  const double r2 = x * x + y * y;
  if (model == "SIMPLE_PINHOLE") return {a[0] * x + a[1], a[0] * y + a[2]};
  if (model == "PINHOLE") return {a[0] * x + a[2], a[1] * y + a[3]};
  if (model == "OPENCV") {
    const double s = 1.0 + a[4] * r2 + a[5] * r2 * r2;
    return {a[0] * (x * s + 2.0 * a[6] * x * y + a[7] * (r2 + 2.0 * x * x)) + a[2],
            a[1] * (y * s + 2.0 * a[7] * x * y + a[6] * (r2 + 2.0 * y * y)) + a[3]};
  }
  const double s = 1.0 + a[3] * r2 + (model == "RADIAL" ? a[4] * r2 * r2 : 0.0);
  return {a[0] * s * x + a[1], a[0] * s * y + a[2]};
}

/// Returns R(q) X + t.
inline std::array<double, 3> ColmapInCamera(const std::array<double, 7>& qt,
                                            const std::array<double, 3>& point) {
  const double w = qt[0], x = qt[1], y = qt[2], z = qt[3];
  const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                          {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                          {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  std::array<double, 3> p{};
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = qt[4 + i];
    for (std::size_t k = 0; k < 3; ++k) p[i] += r[i][k] * point[k];
  }
  return p;
}

/// Writes a COLMAP folder of one camera with the given model and parameters, 6 images and 30 points
/// without noise. Points and focal lengths are changed by about `disturbance` (relative). Feature 0
/// of each image belongs to no point.
inline void WriteColmap(const std::filesystem::path& folder, const std::string& model,
                        const std::vector<double>& parameters, double disturbance) {
  std::filesystem::create_directories(folder);
  std::ofstream cameras(folder / "cameras.txt"), images(folder / "images.txt"),
      points(folder / "points3D.txt");
  cameras.precision(17), images.precision(17), points.precision(17);
  cameras << "# Camera list\n7 " << model << " 1000 800";
  const std::size_t focal_lengths = model == "PINHOLE" || model == "OPENCV" ? 2 : 1;
  for (std::size_t i = 0; i < parameters.size(); ++i)
    cameras << ' ' << parameters[i] * (i < focal_lengths ? 1.0 + 0.1 * disturbance : 1.0);
  cameras << '\n';
  std::vector<std::array<double, 3>> xyz;
  for (int i = 0; i < 30; ++i)
    xyz.push_back({2.0 * Wave(3 * i), 2.0 * Wave(3 * i + 1), 6.0 + Wave(3 * i + 2)});
  for (int i = 0; i < 6; ++i) {
    const double angle = 0.2 * (i - 2.5), half = 0.5 * angle;
    // Rotations about the y axis alone would not determine fy.
    std::array<double, 7> qt = {std::cos(half),
                                0.1 * Wave(i),
                                std::sin(half),
                                0.2 * Wave(i + 3),
                                -6.0 * std::sin(angle),
                                0.1 * Wave(i),
                                6.0 - 6.0 * std::cos(angle)};
    const double length = std::hypot(std::hypot(qt[0], qt[1]), std::hypot(qt[2], qt[3]));
    for (std::size_t k = 0; k < 4; ++k) qt[k] /= length;
    images << 10 + i;
    for (const double x : qt) images << ' ' << x;
    images << " 7 image " << i << ".jpg\n1.5 2.5 -1";
    for (std::size_t k = 0; k < xyz.size(); ++k) {
      const auto p = ColmapInCamera(qt, xyz[k]);
      const auto z = ColmapPixel(model, parameters, p[0] / p[2], p[1] / p[2]);
      images << ' ' << z[0] << ' ' << z[1] << ' ' << 100 + k;
    }
    images << '\n';
  }
  for (std::size_t k = 0; k < xyz.size(); ++k) {
    points << 100 + k;
    for (std::size_t c = 0; c < 3; ++c)
      points << ' ' << xyz[k][c] + disturbance * Wave(static_cast<int>(7 * k + c));
    points << " 10 20 30 0.5 10 " << k + 1 << '\n';
  }
}

/// Returns the RMS error of a COLMAP folder of one camera, px.
inline double ColmapRms(const std::filesystem::path& folder) {
  std::ifstream cameras(folder / "cameras.txt"), images(folder / "images.txt"),
      points(folder / "points3D.txt");
  const auto next = [](std::ifstream& file, std::istringstream& row) {
    std::string line;
    while (std::getline(file, line)) {
      if (line.starts_with('#')) continue;
      row = std::istringstream(line);
      return true;
    }
    return false;
  };
  std::istringstream row;
  std::string model, word;
  std::vector<double> parameters;
  next(cameras, row);
  row >> word >> model >> word >> word;
  for (double x = 0.0; row >> x;) parameters.push_back(x);
  std::map<int, std::array<double, 3>> xyz;
  while (next(points, row)) {
    int id = 0;
    row >> id;
    for (double& x : xyz[id]) row >> x;
  }
  double sum = 0.0, count = 0.0;
  while (next(images, row)) {
    std::array<double, 7> qt{};
    row >> word;
    for (double& x : qt) row >> x;
    next(images, row);
    double u = 0.0, v = 0.0;
    for (int id = 0; row >> u >> v >> id;) {
      if (id < 0) continue;
      const auto p = ColmapInCamera(qt, xyz.at(id));
      const auto z = ColmapPixel(model, parameters, p[0] / p[2], p[1] / p[2]);
      sum += (z[0] - u) * (z[0] - u) + (z[1] - v) * (z[1] - v);
      count += 1.0;
    }
  }
  return std::sqrt(sum / count);
}

}  // namespace alidade::testing
