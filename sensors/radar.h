// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

namespace detail {

/// Product of all parts of several tuples.
template <class... Tuples>
struct Joined;
template <class... A, class... B, class... Rest>
struct Joined<std::tuple<A...>, std::tuple<B...>, Rest...>
    : Joined<std::tuple<A..., B...>, Rest...> {};
template <class... A>
struct Joined<std::tuple<A...>> {
  using Type = Product<A...>;
};

/// Geometry of the measured quantities.
template <int D, bool kRange, bool kAngles, bool kRate>
using RadarPlot = typename Joined<
    std::conditional_t<kRange, std::tuple<Vec<1>>, std::tuple<>>,
    std::conditional_t<kAngles,
                       std::conditional_t<D == 2, std::tuple<Angle>, std::tuple<Angle, Angle>>,
                       std::tuple<>>,
    std::conditional_t<kRate, std::tuple<Vec<1>>, std::tuple<>>>::Type;

}  // namespace detail

/// Plot of a target by a radar in D dimensions: any of range, direction and range rate.
///
///   model      d = |h|,   az = atan2(h_y, h_x),   el = atan2(h_z, sqrt(h_x^2 + h_y^2)),
///              rr = h' u / |h|,   h = p - s,   u = v - w
///   Jacobian   automatic differentiation               up to 4 x 12
///   noise      R = diag(sigma_d^2, sigma_az^2, sigma_el^2, sigma_rr^2), of the measured
///              quantities, or the covariance of the measurement
///
///   symbol     shape  unit    frame  meaning
///   d, rr      1      m, m/s  -      range and range rate
///   az, el     1      rad     world  azimuth, counter-clockwise from x, and elevation (D = 3)
///   p, v       D      m, m/s  world  position and velocity of the target
///   s, w       D      m, m/s  world  position and velocity of the radar; default: constant at 0
///   sigma_*    1      m, rad, m/s  -  standard deviations; > 0. Only a quantity with its sigma is
///                                    measured
///
/// Defined for  h != 0; azimuth and elevation in space for h_x or h_y != 0. Otherwise
///              out_of_domain; outputs unchanged.
/// Source       [BarShalom2001] sec. 10.4.
template <int D, bool kRange, bool kAngles, bool kRate>
struct Radar
    : Sensor<detail::RadarPlot<D, kRange, kAngles, kRate>, Vec<D>, Vec<D>, Vec<D>, Vec<D>> {
  static constexpr int kSize = kRange + (kAngles ? D - 1 : 0) + kRate;
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the target in the world", kAxes<D>},
      Quantity{"velocity", "m/s", "velocity of the target in the world", kAxes<D>,
               kRate ? 0u : unsigned{ALIDADE_ROLE_OPTIONAL}},
      Quantity{"radar_position", "m", "position of the radar in the world", kAxes<D>,
               ALIDADE_ROLE_OWNED},
      Quantity{"radar_velocity", "m/s", "velocity of the radar in the world", kAxes<D>,
               ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"plot", "", "range, direction and range rate"};
  static constexpr std::array<Quantity, kSize> Parts() {
    std::array<Quantity, kSize> parts{};
    std::size_t i = 0;
    if (kRange) parts[i++] = Quantity{"range", "m", "distance of the target"};
    if (kAngles) parts[i++] = Quantity{"azimuth", "rad", "angle from the x axis to the y axis"};
    if (kAngles && D == 3) parts[i++] = Quantity{"elevation", "rad", "angle above the x-y plane"};
    if (kRate) parts[i++] = Quantity{"range_rate", "m/s", "rate of the range"};
    return parts;
  }
  static constexpr std::array<Quantity, kSize> kParts = Parts();

  std::array<double, kSize> sigma;  ///< in the order of kParts

  explicit Radar(const std::array<double, kSize>& deviations) : sigma(deviations) {}

  template <class T>
  bool Predict(const T* position, const T* velocity, const T* radar_position,
               const T* radar_velocity, T* z) const {
    using std::atan2;
    using std::sqrt;
    T h[D], squared(0.0);
    for (int i = 0; i < D; ++i) {
      h[i] = position[i] - radar_position[i];
      squared += h[i] * h[i];
    }
    const T horizontal = h[0] * h[0] + h[1] * h[1];
    if (!((kAngles ? horizontal : squared) > T(0.0))) return false;
    const T range = sqrt(squared);
    int next = 0;
    if (kRange) z[next++] = range;
    if (kAngles) z[next++] = atan2(h[1], h[0]);
    if constexpr (D == 3) {
      if (kAngles) z[next++] = atan2(h[2], T(sqrt(horizontal)));
    }
    if (kRate) {
      T product(0.0);
      for (int i = 0; i < D; ++i) product += h[i] * (velocity[i] - radar_velocity[i]);
      z[next++] = product / range;
    }
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, T* L) const {
    for (int i = 0; i < kSize; ++i) L[(kSize + 1) * i] = T(sigma[static_cast<std::size_t>(i)]);
  }
};

}  // namespace alidade
