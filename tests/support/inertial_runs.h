// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/estimation/ekf.h"
#include "alidade/estimation/invariant_error.h"
#include "alidade/testing/jacobians.h"
#include "support/driven.h"

/// Simulation of a vehicle with an inertial unit and an initial heading that is almost unknown, in
/// the way of [Barrau2017] sec. V. Compares filters with different errors on the same data.
namespace alidade::testing {

/// Position in the world, z = p + n.
struct Gnss : Sensor<Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"position", "m", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"position", "m", "", "x,y,z"};
  static constexpr double kSigma = 1.0;
  template <class T>
  bool Predict(const T* p, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = p[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(kSigma);
  }
};

/// Three known points in the frame of the body, z = R' (l_i - p) + n.
struct KnownPoints : Sensor<Vec<9>, Vec<3>, UnitQuaternion> {
  static constexpr std::array kRoles{Quantity{"position", "m", "", "x,y,z"},
                                     Quantity{"orientation", "", "", "w,x,y,z"}};
  static constexpr Quantity kMeasurement{"points", "m"};
  static constexpr double kPoints[3][3] = {{0.0, 8.0, 1.0}, {-7.0, -4.0, 2.0}, {7.0, -4.0, 0.0}};
  static constexpr double kSigma = Gnss::kSigma;
  template <class T>
  bool Predict(const T* p, const T* q, T* z) const {
    for (int k = 0; k < 3; ++k) {
      const T offset[3] = {kPoints[k][0] - p[0], kPoints[k][1] - p[1], kPoints[k][2] - p[2]};
      UnitQuaternion::RotateBack(q, offset, z + 3 * k);
    }
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < 9; ++i) l[10 * i] = T(kSigma);
  }
};

/// Sensor of an experiment: the position in the world (Gnss), or known points in the frame of
/// the body (KnownPoints).
enum class InertialSensor { kGnss, kPoints };

/// Error of the vehicle at one time.
struct InertialError {
  double nees = 0.0;  ///< e' P^-1 e / 9 of position, orientation and velocity
  double heading_rad = 0.0, position_m = 0.0;
};

/// Vehicle on a circle of radius 10 m, 10 s per round, with inertial readings at 50 Hz and
/// measurements at 5 Hz, with a sigma of 1 m. The first estimate is wrong by about 1 rad in
/// heading, 0.02 rad in roll and pitch, 1 m, and 0.5 m/s.
class CircleDrive {
 public:
  CircleDrive(InertialSensor sensor, std::uint64_t seed) : random_(seed) {
    const auto body = problem_.AddState("body", motion_, DrawInitial(), {"imu"});
    for (const char* const name : {"position", "orientation", "velocity"}) {
      blocks_.push_back(body[name]);
    }
    model_ = sensor == InertialSensor::kGnss ? MakeSensor(Gnss(), "gnss")
                                             : MakeSensor(KnownPoints(), "points");
    std::vector<RoleBinding> roles{blocks_[0]};
    if (sensor == InertialSensor::kPoints) roles.emplace_back(blocks_[1]);
    problem_.AddSensor("z", model_, roles);
  }

  /// Drives with an EKF. `side` is its invariant error; nullopt: the error of the blocks. Returns
  /// the errors at `times_s`, in ascending order.
  std::vector<InertialError> Run(std::optional<ErrorSide> side,
                                 const std::vector<double>& times_s) {
    const auto make = [](const Problem& problem) { return std::make_unique<Ekf>(problem); };
    const Ekf plain(problem_);
    std::unique_ptr<Estimator> filter = std::make_unique<Ekf>(plain);
    if (side) filter = MakeInvariant({*side, blocks_}, problem_, make);
    filter->Start(0);
    std::vector<InertialError> errors;
    for (int k = 0; errors.size() < times_s.size(); ++k) {
      std::vector<Reading> readings{Reading(plain.stream("imu"), {kInput.begin(), kInput.end()})};
      if (k > 0 && k % kStepsPerMeasurement == 0) {
        readings.emplace_back(plain.stream("z"), Measure());
      }
      filter->Process(plain.MakeFrame(TimestampFromSeconds(kStep * k), readings));
      if (kStep * (k + 0.5) > times_s[errors.size()]) errors.push_back(ErrorOf(filter->state()));
      Move();
    }
    return errors;
  }

 private:
  static constexpr double kStep = 0.02, kRadius = 10.0, kRate = 2.0 * std::numbers::pi / 10.0;
  static constexpr int kStepsPerMeasurement = 10;
  static constexpr std::array<double, 6> kInput{0.0, kRadius* kRate* kRate, 9.81, 0.0, 0.0, kRate};

  /// Returns initial values that are drawn around the truth.
  std::vector<InitialValue> DrawInitial() {
    const std::vector<double> sigmas[] = {{1.0, 1.0, 1.0}, {0.5, 0.5, 0.5}, {0.02, 0.02, 1.0}};
    std::vector<InitialValue> initial;
    for (std::size_t i = 0; i < 3; ++i) {
      const Space& block = motion_->blocks()[i];
      std::vector<double> d, estimate(truth_[i].size());
      for (const double sigma : sigmas[i]) d.push_back(sigma * random_.Normal());
      block.geometry.Plus(truth_[i].data(), d.data(), estimate.data());
      initial.emplace_back(block.name, estimate, sigmas[i]);
    }
    initial.push_back(InitialValue::Constant("force_bias", {0.0, 0.0, 0.0}));
    initial.push_back(InitialValue::Constant("rate_bias", {0.0, 0.0, 0.0}));
    return initial;
  }
  std::vector<double> Measure() {
    const double* const roles[] = {truth_[0].data(), truth_[2].data()};
    std::vector<double> z(static_cast<std::size_t>(model_->measurement().geometry.ambient));
    ALIDADE_EXPECTS(model_->Predict(roles, z.data()) == Status::kOk);
    for (double& element : z) element += KnownPoints::kSigma * random_.Normal();
    return z;
  }
  /// Moves the truth by one step of the model with random noise.
  void Move() {
    Blocks next = truth_;
    const auto blocks = Pointers(std::as_const(truth_));
    std::array<double, 144> l{};
    std::array<double, 12> w{};
    ALIDADE_EXPECTS(motion_->SqrtQ(blocks.data(), kInput.data(), kStep, l.data()) == Status::kOk);
    for (std::size_t i = 0; i < 6; ++i) w[i] = l[13 * i] * random_.Normal();
    ALIDADE_EXPECTS(motion_->Step(blocks.data(), kInput.data(), w.data(), kStep,
                                  {.next = Pointers(next).data()}) == Status::kOk);
    truth_ = next;
    UnitQuaternion::Normalise(truth_[2].data());
  }
  InertialError ErrorOf(const State& state) const {
    Eigen::Matrix<double, 9, 1> e;
    std::vector<int> rows;
    for (const BlockId id : blocks_) {
      const Block& block = state.layout()[id];
      block.geometry().Minus(truth_[static_cast<std::size_t>(id)].data(), state.value(id),
                             e.data() + rows.size());
      for (int i = 0; i < 3; ++i) rows.push_back(block.tangent_offset + i);
    }
    const Eigen::MatrixXd p = state.covariance().Dense()(rows, rows);
    return {e.dot(p.llt().solve(e)) / 9.0, std::abs(e[5]), e.head<3>().norm()};
  }

  Random random_;
  SharedMotion motion_ = MakeMotion(Inertial(), "inertial");
  SharedSensor model_;
  Problem problem_;
  std::vector<BlockId> blocks_;
  /// Blocks of the model. The vehicle starts at (10, 0, 0) m and heads for +y.
  Blocks truth_{{kRadius, 0.0, 0.0},
                {0.0, kRadius* kRate, 0.0},
                {std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)},
                {0.0, 0.0, 0.0},
                {0.0, 0.0, 0.0}};
};

/// Returns the means over the seeds first, first + 1, ... of the errors at `times_s`.
inline std::vector<InertialError> MeanErrors(InertialSensor sensor, std::optional<ErrorSide> side,
                                             const std::vector<double>& times_s, int seeds,
                                             std::uint64_t first = 1) {
  std::vector<InertialError> sums(times_s.size());
  for (int i = 0; i < seeds; ++i) {
    CircleDrive drive(sensor, first + static_cast<std::uint64_t>(i));
    const std::vector<InertialError> errors = drive.Run(side, times_s);
    for (std::size_t k = 0; k < sums.size(); ++k) {
      sums[k].nees += errors[k].nees / seeds;
      sums[k].heading_rad += errors[k].heading_rad / seeds;
      sums[k].position_m += errors[k].position_m / seeds;
    }
  }
  return sums;
}

}  // namespace alidade::testing
