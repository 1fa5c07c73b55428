// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "alidade/filter/ekf.h"

namespace alidade {

/// The fast path: takes the steps and updates in which nothing but acceptance and gating happens,
/// in functions compiled for the number of states. Before anything else it changes nothing and says
/// false: the general path then does the work and finds the words.
class Ekf::Small {
 public:
  /// Null where the filter is not one of few states, all of them vectors in the order of the
  /// layout, with plain joint updates.
  static std::unique_ptr<Small> For(Ekf& ekf);
  /// As Ekf::Process, all of it or nothing but the step.
  bool Process(const Frame& frame) { return (this->*process_)(frame); }

 private:
  static constexpr int kRows = 8;       ///< most rows of an update
  static constexpr int kMostOfOne = 3;  ///< most rows of a measurement

  struct Motion {
    const MotionModel* model;
    MotionPlan* plan;
    int offset, size, noise;
  };
  struct Sensor {
    const SensorModel* model;
    std::vector<const double*> roles;
    std::vector<double*> jacobians;  ///< into h
    std::vector<int> strides;
    std::array<double, kMostOfOne * Covariance::kSmall> h{};      ///< H, its zeros included
    std::array<double, kMostOfOne * Covariance::kSmall> blank{};  ///< h before the model writes it
    int index, stream, rows;
    int* rejections;
    double gate;
  };
  /// The rows that passed their gates, stacked.
  template <int N>
  struct Rows {
    double pht[kRows * N];  ///< P H', by columns
    double s[kRows * kRows];
    double innovation[kRows];
    double* gain[kRows];  ///< where to report each row's column of K
  };

  enum class Taken { kUnusual, kLeftOut, kStacked };

  explicit Small(Ekf& ekf) : ekf_(ekf) {}
  bool AddMotions();
  bool AddSensors();
  template <int N>
  bool ProcessSized(const Frame& frame);
  template <int N>
  bool Step(double dt_s);
  template <int N, int K, int W>
  bool StepModel(const Motion& motion, double dt_s, double (&p)[N][N]);
  template <int N, int M>
  Taken Take(Sensor& sensor, const Measurement& measurement, Rows<N>& rows, int at);
  template <int N>
  bool Update(const Frame& frame);
  template <int N, int M>
  bool Linearise(Sensor& sensor, const double* z, MeasurementReport& entry, double* pht);
  template <int N, int M>
  void Stack(const Sensor& sensor, MeasurementReport& entry, Rows<N>& rows, int at);
  template <int N, int M>
  bool Correct(const Rows<N>& rows, int count);

  void CountRejections();

  Ekf& ekf_;
  bool (Small::*process_)(const Frame& frame) = nullptr;
  std::vector<Motion> motions_;
  std::vector<Sensor> sensors_;
};

}  // namespace alidade
