// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "alidade/filter/gate.h"
#include "alidade/filter/timeline.h"
#include "alidade/state/small_kernels.h"

namespace alidade::internal {

/// The fast path of a filter whose method is Linear, with joint updates: takes the steps and
/// updates in which nothing but acceptance and gating happens, in functions compiled for the number
/// of states. A measurement that its model calls invalid is reported as such. Of a frame with
/// anything else it does the step at most, and says false: the frame loop then does the rest and
/// finds the words. The first frame of all is the loop's, where
/// Filter::Start gave no time.
class FastPath {
 public:
  /// Null where the filter is not one of few states, all of them estimated vectors in the order of
  /// the layout, and sensors of a vector of at most 3 elements each, all of whose roles are
  /// corrected and linearised at the estimate, without loss or known numbers. It points into
  /// all three.
  static std::unique_ptr<FastPath> For(FilterState& f, Timeline& time, Gate& gate);
  /// As a filter processes a frame, all of it or nothing but the step.
  bool Process(const Frame& frame);

 private:
  static constexpr int kRows = 8;       ///< most rows of an update
  static constexpr int kMostOfOne = 3;  ///< most rows of a measurement

  struct Motion {
    MotionModel model;
    Motions::Step* step;
    std::vector<const double*> x;
    std::vector<double*> next;
    int offset, size, noise;
  };
  struct Sensor {
    explicit Sensor(const SensorModel& of) : model(of) {}

    SensorModel model;
    std::vector<const double*> roles;
    std::vector<double*> jacobians;  ///< into H
    std::vector<int> strides;
    std::array<double, kMostOfOne * kSmall> H{};      ///< its zeros included
    std::array<double, kMostOfOne * kSmall> blank{};  ///< H before the model writes it
    AlidadeObservation seen = detail::Seen(nullptr);  ///< the measurement that is taken
    int index, stream, rows;
    double threshold;  ///< of its gate
  };
  /// The rows that passed their gates, stacked.
  template <int N>
  struct Rows {
    double pht[kRows * N];  ///< P H', by columns
    double s[kRows * kRows];
    double innovation[kRows];
    double*
        gain[kRows];  ///< each row's column of K in its report, which may move: the memory stays
  };

  enum class Taken { kUnusual, kLeftOut, kStacked };

  FastPath(FilterState& f, Timeline& time, Gate& gate) : f_(f), time_(time), gate_(gate) {}
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

  FilterState& f_;
  Timeline& time_;
  Gate& gate_;
  bool (FastPath::*process_)(const Frame& frame) = nullptr;  ///< for the number of states
  std::vector<Motion> motions_;
  std::vector<Sensor> sensors_;
};

}  // namespace alidade::internal
