// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/problem_index.h"
#include "alidade/state/workspace.h"

namespace alidade::internal {

// This header evaluates motion models at a value x of the whole state, such as an estimate, a sigma
// point or an iterate of a batch. n_w: number of noise inputs.

/// Error of a step. Converts to false if the step succeeded. A StepError is only as large as a
/// pointer, because every step returns one.
class StepError {
 public:
  StepError() = default;
  StepError(EventKind kind, std::string text)
      : detail_(std::make_unique<const Detail>(Detail{kind, std::move(text)})) {}
  explicit operator bool() const { return detail_ != nullptr; }
  EventKind kind() const { return detail_->kind; }  ///< kind of the event that reports the error
  const std::string& text() const { return detail_->text; }

 private:
  struct Detail {
    EventKind kind;
    std::string text;
  };
  std::unique_ptr<const Detail> detail_;
};

/// Destinations of a step, row-major. A quantity is not computed if its pointer is null.
struct StepOutput {
  double* next = nullptr;  ///< x' of the whole state; only the blocks of the model are written
  double* f = nullptr;     ///< F, n x n; computed only with g
  double* g = nullptr;     ///< G, n x n_w
  double* l = nullptr;     ///< L of Qw = L L', n_w x n_w
};
/// Computes x' = f(x, u, w, dt) of one motion model at the value x of the whole state. A null
/// pointer w means that w is 0.
Outcome StepAt(const MotionBinding& motion, const MotionPlace& place, const double* x,
               const double* u, const double* w, double dt_s, const StepOutput& output);
/// Converts an outcome of StepAt to an error. Returns a StepError that converts to false if the
/// outcome is kAccepted.
StepError StepErrorOf(const MotionBinding& motion, Outcome outcome);
/// Copies x' to x for the blocks that are not constant, and normalises the values to their
/// manifolds.
inline void TakeStep(const MotionPlace& place, const double* next, double* x) {
  for (const auto& [offset, size, geometry] : place.non_constant_ranges) {
    for (int i = offset; i < offset + size; ++i) x[i] = next[i];
    if (geometry != nullptr) geometry->Normalise(x + offset);
  }
}

/// Propagates the state by the motion models of a problem over one step: computes x', F and G Lq.
/// Discrete noise w ~ N(0, I) is constant over an interval (see Ekf): M = Cov(x, w), N = G Lq, A =
/// F M. n: size of P, n_w: number of noise inputs of the active models. A copy is a snapshot.
class Motions {
 public:
  /// Step of one model. Matrices are row-major, in the order of the blocks of the model.
  struct Step {
    bool active = false;        ///< false: the model is stationary, or a block has no value yet
    std::vector<double> u;      ///< control input; empty: the model has no control input
    std::vector<double> f, g;   ///< F, G
    std::vector<double> l, gl;  ///< L of Qw, G L
    std::vector<double> cross;  ///< C = A N'; used if `continues_interval`
    std::vector<double> m;      ///< M; used if the noise is discrete
    bool continues_interval = false;  ///< whether w is the same as in the previous step
  };

  explicit Motions(const ProblemIndex& index);

  /// Determines the active models: those that are not stationary and whose blocks all have a value.
  void Activate(const StateLayout& layout);
  std::vector<Step>& steps() { return steps_; }
  /// Returns x' of the whole state. Only the blocks of active models are valid.
  std::vector<double>& next() { return next_; }

  /// Computes x', F, G and Lq of all active models. If `derivatives` is false, computes only x' and
  /// Lq.
  StepError Evaluate(const State& state, double dt_s, bool derivatives = true);
  /// Sets x <- x'. The caller propagates P.
  void Move(State& state) const;
  /// Returns the error that explains why P after the step is not finite.
  StepError FindNotFinite() const;
  /// Sets P <- F P F' + N N', N = G Lq, and x <- x'. If this fails, returns the error and leaves P
  /// and x unchanged.
  StepError Apply(State& state);

  /// Returns whether the next step continues an interval of discrete noise.
  bool in_interval() const { return has_discrete_noise_ && interval_steps_ > 0; }
  void CountStep() { ++interval_steps_; }
  void EndInterval() { interval_steps_ = 0; }
  /// Returns whether the noise of an active model is discrete.
  bool has_discrete_noise() const { return has_discrete_noise_; }

  int noise_size() const;  ///< n_w
  // The following functions return matrices of the last step, stored in `work`.
  Workspace::Matrix Transition(int n, Workspace& work) const;  ///< F, n x n
  /// Returns the columns of G Lq of all models with continuous noise, side by side.
  Workspace::Matrix ContinuousNoise(int n, Workspace& work) const {
    return NoiseColumns(&Step::gl, false, n, work);
  }
  /// Returns the columns of M of all models with discrete noise, side by side.
  Workspace::Matrix DiscreteNoise(int n, Workspace& work) const {
    return NoiseColumns(&Step::m, true, n, work);
  }

 private:
  StepError EvaluateModel(std::size_t i, const State& state, double dt_s, bool derivatives);
  void PropagateDiscreteNoise(const MotionModel& model, const MotionPlace& place, Step& step);
  bool IsBounded(const Covariance& p) const;
  bool Propagate(Covariance& p);
  bool PropagatePart(Covariance& p, const MotionPlace& place, const Step& step, int width);
  Workspace::Matrix NoiseColumns(std::vector<double> Step::*matrix, bool is_discrete, int n,
                                 Workspace& work) const;

  const ProblemIndex* index_;
  std::vector<Step> steps_;  ///< in the order of Problem::motions
  std::vector<double> next_;
  std::vector<std::size_t> active_;  ///< indices of the active steps
  bool has_discrete_noise_ = false;
  Scratch<Workspace> memory_;
  Timestamp interval_steps_ = 0;  ///< steps since the start of the interval
};

}  // namespace alidade::internal
