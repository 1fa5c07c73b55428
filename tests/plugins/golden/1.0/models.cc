// SPDX-License-Identifier: Apache-2.0
//
// The models in the form in which an author writes them, with the headers of plugin ABI 1.0.
// models.c contains the same models, written with the C header alone.
#include <cmath>

#include "alidade/model/plugin.h"

namespace {

using alidade::Angle;
using alidade::MatrixRef;
using alidade::Owned;
using alidade::Params;
using alidade::Product;
using alidade::Quantity;
using alidade::UnitQuaternion;
using alidade::UnitVector;
using alidade::Vec;

/// Length of a line from an anchor above a rail to a carriage on the rail.
///
///   model      z = s sqrt((x - k)^2 + h^2) + b + n
///   noise      R = sigma^2, or (sigma z)^2
///   inverse    x = k +- sqrt(((z - b) / s)^2 - h^2)
///
/// Defined for  x on the given side of k.
struct Line : alidade::Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "of the carriage, along the rail"},
      Quantity{"offset", "m", "of the gauge", "", ALIDADE_ROLE_OWNED}};
  static constexpr Quantity kMeasurement{"length", "m", "of the line"};
  using Known = Vec<1>;
  static constexpr Quantity kKnown{"anchor", "m", "along the rail"};
  static constexpr int kInitialises = 0;

  double gain, height_m, sigma_m, max_m, side = 1.0;
  bool relative;

  explicit Line(Params& p)
      : gain(p.Positive("gain", "", "of the gauge")),
        height_m(p.NonNegative("height_m", "m", "of the anchor above the rail", 2.0)),
        sigma_m(p.Positive("sigma_m", "m", "noise of the length, 1 sigma")),
        max_m(p.NumberOrNone("max_m", "m", "longest it measures", alidade::kPositive)
                  .value_or(HUGE_VAL)),
        relative(p.Choice("noise_model", {"constant", "relative"}, "of the length", 0) == 1) {
    const std::string word = p.Text("side", "of the anchor, right or left", "right");
    if (word == "left") side = -1.0;
    if (word != "left" && word != "right") p.Fail("side", "is neither right nor left");
  }

  Owned OwnedRole(int) const { return Owned::RandomWalk({0.5}, {0.25}, {0.125}); }

  template <class T>
  bool Predict(const T* position, const T* offset, const double* anchor, T* length) const {
    const T d = position[0] - anchor[0];
    if (!(side * d > T(0.0))) return false;
    using std::sqrt;
    length[0] = gain * sqrt(d * d + height_m * height_m) + offset[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const double*, const T* length, T* l) const {
    l[0] = relative ? T(sigma_m * length[0]) : T(sigma_m);
  }
  bool Valid(const double*, const double* length) const { return length[0] <= max_m; }
  template <class T>
  bool Initialise(const T* offset, const double* anchor, const T* length, T* position) const {
    const T r = (length[0] - offset[0]) / gain;
    if (!(r > T(height_m))) return false;
    using std::sqrt;
    position[0] = anchor[0] + side * sqrt(r * r - height_m * height_m);
    return true;
  }
};

/// Position and heading of a cart, measured by an antenna on the cart and a compass.
///
///   model      z = (p + R(h) a, h - d) + n
///   noise      L = [s0 0 0; c s1 0; 0 0 sr] / sqrt(averaged),  c = s1 / 2 if coupled, else 0
struct Fix : alidade::Sensor<Product<Vec<2>, Angle>, Vec<2>, Angle> {
  static constexpr std::array kRoles{Quantity{"position", "m", "of the cart", "x,y"},
                                     Quantity{"heading", "rad", "of the cart"}};
  static constexpr Quantity kMeasurement{"fix", "", "position and heading"};
  static constexpr std::array kParts{Quantity{"antenna", "m", "its position", "x,y"},
                                     Quantity{"compass", "rad", "heading from magnetic north"}};

  std::array<double, 2> antenna_m, sigma_m;
  double declination_rad, sigma_rad, scale;
  bool coupled;

  explicit Fix(Params& p)
      : antenna_m(p.Vector<2>("antenna_m", "m", "in the cart", {}, {{0.0, 0.0}})),
        sigma_m(p.PerAxis<2>("sigma_m", "m", "noise of the position, 1 sigma", alidade::kPositive)),
        declination_rad(p.Number("declination_rad", "rad", "of magnetic north", {-3.0, 3.0}, 0.0)),
        sigma_rad(p.Positive("sigma_rad", "rad", "noise of the heading, 1 sigma")),
        scale(1.0 / std::sqrt(p.Integer("averaged", "fixes in one measurement", 1, 100, 1))),
        coupled(p.Flag("coupled", "the errors of x and y are correlated", false)) {}

  template <class T>
  bool Predict(const T* p, const T* heading, T* z) const {
    using std::cos;
    using std::sin;
    const T c = cos(heading[0]), s = sin(heading[0]);
    z[0] = p[0] + c * antenna_m[0] - s * antenna_m[1];
    z[1] = p[1] + s * antenna_m[0] + c * antenna_m[1];
    z[2] = Angle::Wrap(T(heading[0] - declination_rad));
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(scale * sigma_m[0]);
    l[3] = T(coupled ? 0.5 * scale * sigma_m[1] : 0.0);
    l[4] = T(scale * sigma_m[1]);
    l[8] = T(scale * sigma_rad);
  }
};

/// Direction of a field of the world, seen from a body.
///
///   model      z = (R(q)' m / |m|) (+) n
struct Direction : alidade::Sensor<UnitVector, UnitQuaternion> {
  static constexpr std::array kRoles{Quantity{"orientation", "", "world_from_body"}};
  static constexpr Quantity kMeasurement{"direction", "", "of the field, in the body", "x,y,z"};

  std::array<double, 3> field;
  double sigma_rad;

  explicit Direction(Params& p)
      : field(p.Vector<3>("field", "", "in the world, of any length")),
        sigma_rad(p.Positive("sigma_rad", "rad", "noise of the direction, 1 sigma")) {
    const double length =
        std::sqrt(field[0] * field[0] + field[1] * field[1] + field[2] * field[2]);
    if (!(length > 0.0)) p.Fail("field", "has no direction");
    for (double& one : field) one /= length;
  }

  template <class T>
  bool Predict(const T* q, T* z) const {
    UnitQuaternion::RotateBack(q, field.data(), z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(sigma_rad);
  }
};

/// A cart that drives arcs. Odometry measures its speed and turn rate.
///
///   model      p' = p + v dt sinc(a) [cos(h + a), sin(h + a)],  h' = h + o dt,  a = o dt / 2,
///              (v, o) = u + w, w held over an interval
struct Cart : alidade::Motion<2, Vec<2>, Angle> {
  static constexpr std::array kBlocks{Quantity{"position", "m", "", "x,y"},
                                      Quantity{"heading", "rad"}};
  using Input = Vec<2>;
  static constexpr Quantity kInput{"odometry", "", "m/s and rad/s", "speed,turn_rate"};

  double speed, turn_rate;

  explicit Cart(Params& p)
      : speed(p.NonNegative("noise.speed", "m/s", "noise of the speed")),
        turn_rate(p.NonNegative("noise.turn_rate", "rad/s", "noise of the turn rate")) {}

  alidade::NoiseKind noise_kind() const { return alidade::NoiseKind::kDiscrete; }

  template <class T>
  void Step(const T* p, const T* heading, const T* u, const T* w, double dt_s, T* p1,
            T* heading1) const {
    using std::cos;
    using std::sin;
    const T turn = (u[1] + w[1]) * dt_s, a = 0.5 * turn, direction = heading[0] + a;
    T sinc = 1.0 - a * a / 6.0 + a * a * a * a / 120.0;
    if (a * a > T(1e-4)) sinc = sin(a) / a;
    const T chord = (u[0] + w[0]) * dt_s * sinc;
    p1[0] = p[0] + chord * cos(direction);
    p1[1] = p[1] + chord * sin(direction);
    heading1[0] = Angle::Wrap(T(heading[0] + turn));
  }
  void SqrtQ(double, MatrixRef l) const {
    l(0, 0) = speed;
    l(1, 1) = turn_rate;
  }
};

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Line, "golden_line", "length of a line to a carriage", "[None2026]"),
               ALIDADE_SENSOR(Fix, "golden_fix", "position and heading of a cart", ""),
               ALIDADE_SENSOR(Direction, "golden_direction", "of a field, in the body", ""),
               ALIDADE_MOTION(Cart, "golden_cart", "drives arcs by odometry", ""))
