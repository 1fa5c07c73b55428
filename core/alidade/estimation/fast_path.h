// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "alidade/estimation/gate.h"
#include "alidade/estimation/timeline.h"
#include "alidade/state/small_kernels.h"

namespace alidade::internal {

/// The fast path of a filter whose method is Linear, with joint updates: takes the steps and
/// updates in which nothing but acceptance and gating happens, in functions compiled for the number
/// of states. A measurement that its model calls invalid is reported as such. Of a frame with
/// anything else it does the step at most, and says false: the frame loop then does the rest and
/// finds the words. The loop's are the first frame of all, where Filter::Start gave no time, and
/// those that discrete noise is held over from the frame before, which had no accepted measurement:
/// the M = Cov(x, w) of Motions is not kept here.
class FastPath {
 public:
  /// Null where the filter is not one of few states, all of them estimated vectors in the order of
  /// the layout, and sensors of a vector of at most 3 elements each, without loss or known numbers,
  /// all of whose roles are blocks of their own, corrected and linearised at the estimate. It
  /// points into all three.
  static std::unique_ptr<FastPath> For(FilterState& f, Timeline& time, Gate& gate);
  /// As a filter processes a frame. False: nothing of it is done but, at most, the step, and what
  /// the report has of measurements is not to be read.
  bool Process(const Frame& frame);

 private:
  static constexpr int kRows = 8;       ///< most rows of an update
  static constexpr int kMostOfOne = 3;  ///< most rows of a measurement

  struct Motion {
    SharedMotion model;
    Motions::Step* step;
    std::vector<const double*> x;
    std::vector<double*> next;
    int offset;  ///< in P, x and next alike
    int size, noise;
  };
  struct Sensor {
    explicit Sensor(const SharedSensor& of) : model(of) {}

    SharedSensor model;
    std::vector<const double*> roles;
    std::vector<double*> jacobians;  ///< into H
    std::vector<int> strides;
    std::array<double, kMostOfOne * kSmall> H{};      ///< its zeros included
    std::array<double, kMostOfOne * kSmall> blank{};  ///< H before the model writes it
    int index, stream, rows;
    double threshold;  ///< of its gate
  };
  /// The rows that passed their gates, stacked.
  template <int N>
  struct RowStack {
    double pht[kRows * N];  ///< P H', by columns
    double s[kRows * kRows];
    double innovation[kRows];
    double* gain[kRows];  ///< column of K in the memory of its entry, which stays if that moves
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
  Taken Take(Sensor& sensor, const Measurement& measurement, RowStack<N>& rows, int at);
  template <int N>
  bool Update(const Frame& frame);
  template <int N, int M>
  bool Linearise(Sensor& sensor, const double* z, MeasurementReport& entry, double* pht);
  template <int N, int M>
  void Stack(const Sensor& sensor, MeasurementReport& entry, RowStack<N>& rows, int at);
  template <int N, int M>
  bool Correct(const RowStack<N>& rows, int count);

  FilterState& f_;
  Timeline& time_;
  Gate& gate_;
  bool (FastPath::*process_)(const Frame& frame) = nullptr;  ///< for the number of states
  std::vector<Motion> motions_;
  std::vector<Sensor> sensors_;
};

}  // namespace alidade::internal
