// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <istream>
#include <string>
#include <vector>

/// Computes the cost of a BAL or Bundler file from its text, by the definition of the formats:
///
///   P = R X + t,   p = -P / P_z,   p' = f (1 + k1 |p|^2 + k2 |p|^4) p
///
/// The cost is the sum over all observations, for either sign of P_z. This file shares no code with
/// the code under test.
namespace alidade::testing {

struct FormulaCost {
  double squares = 0.0;  ///< sum of |p' - z|^2 over all observations z, in px^2
  int observations = 0;
  int behind = 0;  ///< number of observations with P_z > 0
  double Rms() const { return std::sqrt(squares / observations); }
};

struct FormulaCamera {
  std::array<double, 9> r{};  ///< rotation matrix, row-major
  std::array<double, 3> t{}, lens{};
};

/// Returns the rotation matrix by Rodrigues' formula: I + sin(a) K + (1 - cos(a)) K^2.
inline std::array<double, 9> RotationOf(const std::array<double, 3>& w) {
  const double angle = std::hypot(w[0], w[1], w[2]);
  if (angle == 0.0) return {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const double x = w[0] / angle, y = w[1] / angle, z = w[2] / angle;
  const double c = std::cos(angle), s = std::sin(angle), v = 1.0 - c;
  return {c + x * x * v,     x * y * v - z * s, x * z * v + y * s, y * x * v + z * s, c + y * y * v,
          y * z * v - x * s, z * x * v - y * s, z * y * v + x * s, c + z * z * v};
}

inline void AddToCost(const FormulaCamera& camera, const std::array<double, 3>& x, double u,
                      double v, FormulaCost& cost) {
  double p[3];
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = camera.r[3 * i] * x[0] + camera.r[3 * i + 1] * x[1] + camera.r[3 * i + 2] * x[2] +
           camera.t[i];
  }
  const double a = -p[0] / p[2], b = -p[1] / p[2], q = a * a + b * b;
  const double scale = camera.lens[0] * (1.0 + q * (camera.lens[1] + q * camera.lens[2]));
  cost.squares += (scale * a - u) * (scale * a - u) + (scale * b - v) * (scale * b - v);
  cost.behind += p[2] > 0.0 ? 1 : 0;
  ++cost.observations;
}

template <std::size_t N>
void Take(std::istream& text, std::array<double, N>& values) {
  for (double& value : values) text >> value;
}

inline FormulaCost BalFormula(std::istream& text) {
  std::size_t cameras = 0, points = 0, observations = 0;
  text >> cameras >> points >> observations;
  struct Seen {
    std::size_t camera = 0, point = 0;
    double u = 0.0, v = 0.0;
  };
  std::vector<Seen> all(observations);
  for (Seen& seen : all) text >> seen.camera >> seen.point >> seen.u >> seen.v;
  std::vector<FormulaCamera> eyes(cameras);
  for (FormulaCamera& eye : eyes) {
    std::array<double, 3> w{};
    Take(text, w);
    Take(text, eye.t);
    Take(text, eye.lens);
    eye.r = RotationOf(w);
  }
  std::vector<std::array<double, 3>> x(points);
  for (auto& point : x) Take(text, point);
  FormulaCost cost;
  for (const Seen& seen : all)
    AddToCost(eyes.at(seen.camera), x.at(seen.point), seen.u, seen.v, cost);
  return cost;
}

inline FormulaCost BundlerFormula(std::istream& text) {
  std::string header;
  std::getline(text, header);
  std::size_t cameras = 0, points = 0;
  text >> cameras >> points;
  std::vector<FormulaCamera> eyes(cameras);
  for (FormulaCamera& eye : eyes) {
    Take(text, eye.lens);
    Take(text, eye.r);
    Take(text, eye.t);
  }
  FormulaCost cost;
  for (std::size_t i = 0; i < points; ++i) {
    std::array<double, 3> x{}, colour{};
    std::size_t views = 0, camera = 0, key = 0;
    double u = 0.0, v = 0.0;
    Take(text, x);
    Take(text, colour);
    for (text >> views; views > 0; --views) {
      text >> camera >> key >> u >> v;
      AddToCost(eyes.at(camera), x, u, v, cost);
    }
  }
  return cost;
}

}  // namespace alidade::testing
