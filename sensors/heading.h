// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Heading of a body: a compass, two GNSS antennas. The body is described by a heading (an angle,
/// HeadingOfAngle) or an orientation (a unit quaternion, HeadingOfOrientation).
///
///   model      z = psi + delta + b (+) n,   n ~ N(0, sigma^2)
///              psi = atan2(2 (w z + x y), 1 - 2 (y^2 + z^2))   yaw of an orientation (w, x, y, z)
///   Jacobian   automatic differentiation               1 x 1, or 1 x 3; 1 x 1
///   noise      R = sigma^2                             1x1, rad^2
///   inverse    psi = z - delta - b                     of a heading
///
///   symbol     shape  unit    frame  meaning
///   z          1      rad     -      measured heading, counter-clockwise from the x axis
///   psi        1      rad     world  heading of the body, counter-clockwise from the x axis
///   delta      1      rad     -      declination: > 0 if magnetic north is east of true north. A
///                                    compass that measures from magnetic north reads delta more
///   b          1      rad     -      bias, also the angle of mounting: a model parameter state, by
///                                    default constant at 0
///   sigma      1      rad     -      standard deviation of z; > 0
///
/// Defined for  a body whose x axis is not vertical (pitch of +-90 deg). Otherwise out_of_domain;
///              outputs unchanged.
/// Source       yaw [Groves2013] sec. 2.2; declination sec. 6.1.1.
struct Heading {
  static constexpr Quantity kMeasurement{"heading", "rad",
                                         "heading, counter-clockwise from the x axis"};
  static constexpr Quantity kBias{"bias", "rad", "bias of the heading", "", ALIDADE_ROLE_OWNED};

  double sigma_rad, declination_rad;

  explicit Heading(double sigma, double declination = 0.0)
      : sigma_rad(sigma), declination_rad(declination) {}
  explicit Heading(Params& p)
      : Heading{p.Positive("sigma_rad", "rad", "standard deviation of the heading"),
                p.Number("declination_rad", "rad",
                         "declination; > 0 if magnetic north is east of true north", {}, 0.0)} {}

  template <class T>
  void SqrtNoise(const T*, const T*, T* L) const {
    L[0] = T(sigma_rad);
  }
};

struct HeadingOfAngle : Sensor<Angle, Angle, Vec<1>>, Heading {
  static constexpr std::array kRoles{Body<2>::Attitude(), kBias};
  using Heading::kMeasurement;
  static constexpr int kInitialises = 0;
  using Heading::Heading;

  template <class T>
  bool Predict(const T* heading, const T* bias, T* z) const {
    z[0] = Angle::Wrap(T(heading[0] + declination_rad + bias[0]));
    return true;
  }
  template <class T>
  bool Initialise(const T* bias, const T* z, T* heading) const {
    heading[0] = Angle::Wrap(T(z[0] - declination_rad - bias[0]));
    return true;
  }
};

struct HeadingOfOrientation : Sensor<Angle, UnitQuaternion, Vec<1>>, Heading {
  static constexpr std::array kRoles{Body<3>::Attitude(), kBias};
  using Heading::Heading;
  using Heading::kMeasurement;

  template <class T>
  bool Predict(const T* orientation, const T* bias, T* z) const {
    using std::atan2;
    const T *w = orientation, *x = w + 1, *y = w + 2, *k = w + 3;
    const T sine = 2.0 * (*w * *k + *x * *y), cosine = 1.0 - 2.0 * (*y * *y + *k * *k);
    constexpr double kVertical = 1e-12;  // squared cosine of the pitch
    if (!(sine * sine + cosine * cosine > T(kVertical))) return false;
    z[0] = Angle::Wrap(T(atan2(sine, cosine) + declination_rad + bias[0]));
    return true;
  }
};

}  // namespace alidade
