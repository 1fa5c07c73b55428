// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "alidade/model/plugin.h"

/// A plugin that is built with every compiler and set of flags of the build matrix. It uses
/// transcendental functions, quaternions, fixed and heap-allocated Eigen matrices, and the standard
/// library.
namespace {

using alidade::Quantity;
using alidade::UnitQuaternion;
using alidade::Vec;

/// Sensor z = (e^-b sin(y_x) + y_y, |y|), y = R(q)' p.
struct MatrixSensor : alidade::Sensor<Vec<2>, UnitQuaternion, Vec<3>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"orientation"}, Quantity{"point", "m", "", "x,y,z"},
                                     Quantity{"bias"}};
  static constexpr Quantity kMeasurement{"z", "", "", "a,b"};
  std::vector<double> table{0.1, 0.2, 0.3};
  double gain;
  explicit MatrixSensor(alidade::Params& p) : gain(p.Positive("gain", "", "scale of z")) {}

  template <class T>
  bool Predict(const T* q, const T* point, const T* bias, T* z) const {
    using std::exp;
    using std::sin;
    const Eigen::Matrix<T, 3, 1> p(point[0], point[1], point[2]), u(-q[1], -q[2], -q[3]);
    const Eigen::Matrix<T, 3, 1> uv = u.cross(p);
    const Eigen::Matrix<T, 3, 1> y = p + T(2.0) * (q[0] * uv + u.cross(uv));
    if (!(y.squaredNorm() > T(1e-6))) return false;
    z[0] = gain * (exp(-bias[0]) * sin(y[0]) + y[1]);
    z[1] = gain * y.norm();
    return true;
  }
  template <class T>
  void SqrtNoise(const T* q, const T* point, const T*, T* l) const {
    Eigen::MatrixXd r = Eigen::MatrixXd::Identity(2, 2);
    Eigen::VectorXd v(2);
    v << point[0] * table[0] + q[0], point[1] * table[1] + table[2];
    r += v * v.transpose();
    const Eigen::MatrixXd root = r.llt().matrixL();
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) l[2 * i + j] = root(i, j);
    }
  }
};

/// Motion model q' = q Exp(omega dt), omega' = omega e^(-dt / tau) + w.
struct MatrixMotion : alidade::Motion<3, UnitQuaternion, Vec<3>> {
  static constexpr std::array kBlocks{Quantity{"orientation"},
                                      Quantity{"rate", "rad/s", "", "x,y,z"}};
  double tau_s;
  explicit MatrixMotion(alidade::Params& p)
      : tau_s(p.Positive("tau_s", "s", "decay of the rate")) {}

  template <class T>
  void Step(const T* q, const T* rate, const T* w, double dt_s, T* q1, T* rate1) const {
    T turn[3];
    for (int i = 0; i < 3; ++i) {
      turn[i] = rate[i] * dt_s;
      rate1[i] = rate[i] * std::exp(-dt_s / tau_s) + w[i];
    }
    UnitQuaternion::Plus(q, turn, q1);
  }
  void SqrtQ(double dt_s, alidade::MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = std::sqrt(1.0 - std::exp(-2.0 * dt_s / tau_s));
  }
};

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(MatrixSensor, "matrix_sensor", "", ""),
               ALIDADE_MOTION(MatrixMotion, "matrix_motion", "", ""))
