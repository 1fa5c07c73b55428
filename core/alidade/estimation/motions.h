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

// A motion model at any values x of the whole state: that of a filter, a sigma point, a point of a
// batch. n_w: noise inputs.

/// Why a step failed; false if it did not. As small as a pointer, because every step returns one.
class StepError {
 public:
  StepError() = default;
  StepError(const char* kind, std::string text)
      : detail_(std::make_unique<const Detail>(Detail{kind, std::move(text)})) {}
  explicit operator bool() const { return detail_ != nullptr; }
  const char* kind() const { return detail_->kind; }  ///< of the event
  const std::string& text() const { return detail_->text; }

 private:
  struct Detail {
    const char* kind;
    std::string text;
  };
  std::unique_ptr<const Detail> detail_;
};

/// Destinations of a step, row-major; null: not computed.
struct StepOutput {
  double* next = nullptr;  ///< x', at the places of the model's blocks
  double* f = nullptr;     ///< F, n x n; G has to be wanted too
  double* g = nullptr;     ///< G, n x n_w
  double* l = nullptr;     ///< L of Qw = L L', n_w x n_w
};
/// x' = f(x, u, w, dt) of one motion model at the values x of the whole state. w may be null: zero.
Outcome StepAt(const MotionBinding& motion, const MotionPlace& place, const double* x,
               const double* u, const double* w, double dt_s, const StepOutput& to);
/// Converts an outcome of StepAt into an error; no error if it is kAccepted.
StepError StepErrorOf(const MotionBinding& motion, Outcome outcome);
/// x <- x' of its blocks that are not constant, brought back to their manifolds.
inline void TakeStep(const MotionPlace& place, const double* next, double* x) {
  for (const auto& [at, size, geometry] : place.moved) {
    for (int i = at; i < at + size; ++i) x[i] = next[i];
    if (geometry != nullptr) geometry->Normalise(x + at);
  }
}

/// Propagation by the motion models of a problem over one step: x', F and G Lq.
/// Discrete noise w ~ N(0, I) is held over an interval as Ekf has it: M = Cov(x, w), N = G Lq,
/// A = F M. n: size of P, n_w: noise inputs of the models that move. A copy is a snapshot.
class Motions {
 public:
  /// Of one model: row-major, in the order of its blocks.
  struct Step {
    bool active = false;        ///< false: stationary, or a block has no value yet
    std::vector<double> u;      ///< control input; empty: the model takes none
    std::vector<double> f, g;   ///< F, G
    std::vector<double> l, gl;  ///< L of Qw, G L
    std::vector<double> cross;  ///< C = A N', where `carries`
    std::vector<double> m;      ///< M, where its noise is discrete
    bool carries = false;       ///< noise that the step before held
  };

  explicit Motions(const ProblemIndex& index);

  /// Determines the active models: those that are not stationary and whose blocks all have a value.
  void Activate(const StateLayout& layout);
  std::vector<Step>& steps() { return steps_; }
  /// x' of the active models, by the places of their blocks.
  std::vector<double>& next() { return next_; }

  /// x', F, G and Lq of all active models; without `derivatives` x' and Lq alone.
  StepError Evaluate(const State& state, double dt_s, bool derivatives = true);
  /// P <- F P F' + N N', N = G Lq, and x <- x': all of it, or nothing, and why.
  StepError Apply(State& state);

  /// Whether noise that the last step held goes on being held.
  bool in_interval() const { return holds_ && interval_steps_ > 0; }
  void CountStep() { ++interval_steps_; }
  void EndInterval() { interval_steps_ = 0; }
  /// Whether the noise of an active model is discrete.
  bool holds() const { return holds_; }

  int noise_size() const;  ///< n_w
  // Matrices of the last step, in `work`:
  Workspace::Matrix Transition(int n, Workspace& work) const;  ///< F, n x n
  /// Of the steps' `gl` G Lq, of their `m` M, n x n_w, one model beside the other; unless `all`,
  /// the columns of continuous noise are zero.
  Workspace::Matrix Held(std::vector<double> Step::*matrix, int n, Workspace& work,
                         bool all = false) const;

 private:
  StepError EvaluateOne(std::size_t i, const State& state, double dt_s, bool derivatives);
  void CarryHeld(const MotionModel& model, const MotionPlace& place, Step& step);
  bool IsBounded(const Covariance& p) const;
  bool Propagate(Covariance& p);
  bool PropagatePart(Covariance& p, const MotionPlace& place, const Step& step, int width);
  StepError WhyNotFinite() const;

  const ProblemIndex* index_;
  std::vector<Step> steps_;  ///< as in Problem::motions
  std::vector<double> next_;
  std::vector<std::size_t> active_;  ///< steps that are
  bool holds_ = false;
  Scratch<Workspace> memory_;
  Timestamp interval_steps_ = 0;  ///< since the state was last changed by anything else
};

}  // namespace alidade::internal
