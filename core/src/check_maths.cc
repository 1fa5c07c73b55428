// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "check_table.h"
#include "check_values.h"
#include "number_text.h"

/// The checks of what a model computes but for Jacobians: noise, rotations, inverse, time.
namespace alidade::internal {
namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;

// Of values that are equal but for rounding.
constexpr double kRounding = 1e-9;

/// The farthest that a value is from what it should be, relative to `tolerance`.
struct Farthest {
  double ratio = 1.0;  ///< more is a failure
  std::string failure;

  /// `words` are made only for a failure.
  template <class Words>
  void Add(double distance, double tolerance, const Words& words) {
    if (!(distance > tolerance * ratio)) return;
    ratio = distance / tolerance;
    failure = words();
  }
};

std::string DefectOfR(const MatrixXd& l, const Space& z) {
  const MatrixXd r = l * l.transpose();
  const std::vector<std::string> names = TangentNames({z});
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    if (!(r(i, i) > 0.0)) {
      return "R is singular: no noise on " + names[static_cast<std::size_t>(i)];
    }
  }
  const Eigen::VectorXd scale = r.diagonal().array().rsqrt();
  const MatrixXd correlation = scale.asDiagonal() * r * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(correlation, Eigen::EigenvaluesOnly);
  const double smallest = solver.eigenvalues()[0];
  if (smallest > 1e-12) return {};
  return "R is singular: smallest eigenvalue of its correlations " + RoundedText(smallest);
}

/// Step over dt from `state` without noise; nothing where it is not defined.
std::optional<Values> StepOver(const Context& context, const Function& f, Values inputs,
                               const Values& blocks, double dt_s) {
  std::copy(blocks.begin(), blocks.end(), inputs.begin());
  std::vector<double>& w = inputs[blocks.size()];
  std::fill(w.begin(), w.end(), 0.0);
  inputs.back()[0] = dt_s;
  const Answer answer = context.CallWith(f, inputs, kNoMatrix);
  if (!answer.ok()) return std::nullopt;
  return OutputValues(answer);
}

/// Step over dt against two steps over its parts.
struct Additivity {
  double defect = 0.0, size = 0.0;
  Eigen::Index row = 0;
};

std::optional<Additivity> Split(const Context& context, const Function& f, const Values& inputs,
                                const Values& blocks, double dt_s) {
  const double first_s = 0.375 * dt_s;
  const auto whole = StepOver(context, f, inputs, blocks, dt_s);
  const auto first = StepOver(context, f, inputs, blocks, first_s);
  if (!whole || !first) return std::nullopt;
  const auto both = StepOver(context, f, inputs, *first, dt_s - first_s);
  if (!both) return std::nullopt;
  Additivity result;
  result.size = std::max({1.0, Largest(inputs), Largest(*whole), Largest(*both)});
  result.defect = Difference(f.outputs, *whole, *both).abs().maxCoeff(&result.row);
  return result;
}

/// p where the defect goes with dt^p, from 20 ms and 10 ms.
double OrderOf(const Context& context, const Function& f, const Values& inputs,
               const Values& blocks) {
  const auto coarse = Split(context, f, inputs, blocks, 0.02);
  const auto fine = Split(context, f, inputs, blocks, 0.01);
  return coarse && fine ? std::log2(coarse->defect / fine->defect) : 0.0;
}

}  // namespace

Finding CheckNoise(Context& context) {
  const Function* const f =
      context.model().Find(context.model().is_sensor() ? "SqrtNoise" : "SqrtQ");
  if (f == nullptr) return Skip("it has no noise input");
  for (const State& state : context.states()) {
    if (!state.defined) continue;
    const Buffer factor = context.Call(*f, state).matrices.front();
    const MatrixXd l = ToMatrix(factor);
    for (int r = 0; r < factor.rows(); ++r) {
      for (int c = 0; c < factor.columns(); ++c) {
        if (std::isfinite(l(r, c)) && !Unwritten(l(r, c))) continue;
        return Fail(context.Where(*f, state) + ": entry (" + std::to_string(r) + ", " +
                    std::to_string(c) + ") " +
                    (Unwritten(l(r, c)) ? "is not written" : "is " + NumberText(l(r, c))));
      }
    }
    if (!context.model().is_sensor()) continue;
    const std::string defect = DefectOfR(l, context.model().instance->space());
    if (!defect.empty()) return Fail(context.Where(*f, state) + ": " + defect);
  }
  return Ok(context.model().is_sensor() ? "R is finite and positive definite" : "Lq is finite");
}

Finding CheckDoubleCover(Context& context) {
  Farthest farthest;
  bool any = false;
  for (const Function& f : context.model().functions) {
    for (std::size_t i = 0; i < f.slots.size(); ++i) {
      const Space& space = context.model().slots[static_cast<std::size_t>(f.slots[i])];
      if (space.geometry.kind != GeometryKind::kUnitQuaternion || f.outputs.empty()) continue;
      any = true;
      for (const State& state : context.states()) {
        Values turned = Context::Inputs(f, state);
        // Of a half turn, -0 apart from 0 decides which way round its logarithm goes.
        if (turned[i].empty() || turned[i][0] == 0.0) continue;
        for (double& element : turned[i]) element = -element;
        const Answer a = context.Call(f, state), b = context.CallWith(f, turned, kAllMatrices);
        const auto words = [&] {
          return context.Where(f, state) + ": q and -q of " + space.name + " are not the same";
        };
        farthest.Add(a.code == b.code ? 0.0 : 2.0, 1.0, words);
        if (!a.ok() || !b.ok()) continue;
        const Values x = OutputValues(a), y = OutputValues(b);
        farthest.Add(Difference(f.outputs, x, y).abs().maxCoeff(), kRounding * (1.0 + Largest(x)),
                     words);
        const MatrixXd j = SideBySide(a);
        farthest.Add((j - SideBySide(b)).cwiseAbs().maxCoeff(),
                     kRounding * (1.0 + j.cwiseAbs().maxCoeff()), words);
      }
    }
  }
  if (!any) return Skip("it takes no quaternion");
  return farthest.failure.empty() ? Ok("q and -q are one rotation") : Fail(farthest.failure);
}

Finding CheckInitialise(Context& context) {
  const Function* const f = context.model().Find("Initialise");
  if (f == nullptr) return Skip("it has no Initialise");
  const std::vector<int> y = context.model().Initialised();
  Farthest farthest;
  int inverted = 0;
  for (const State& state : context.states()) {
    if (!state.defined) continue;
    const Answer answer = context.Call(*f, state, kNoMatrix);
    if (!answer.ok()) continue;
    ++inverted;
    State back = state;
    const Values initialised = OutputValues(answer);
    for (std::size_t i = 0; i < y.size(); ++i) {
      back.values[static_cast<std::size_t>(y[i])] = initialised[i];
    }
    const Answer again = context.Call(context.main(), back, kNoMatrix);
    const std::vector<double>& z =
        state.values[static_cast<std::size_t>(context.model().measurement_slot())];
    const auto words = [&] {
      return context.Where(*f, state) + " gives " + StateText(f->outputs, initialised) +
             ", where Predict " +
             (again.ok() ? "gives " + StateText(context.main().outputs, OutputValues(again))
                         : std::string("is not defined"));
    };
    farthest.Add(again.ok() ? 0.0 : 2.0, 1.0, words);
    if (!again.ok()) continue;
    const ArrayXd d = Difference(context.main().outputs, OutputValues(again), {z});
    farthest.Add(d.abs().maxCoeff(), 1e-6 * Largest({z}) + 1e-12 * (1.0 + Largest(state.values)),
                 words);
  }
  if (!farthest.failure.empty()) return Fail(farthest.failure);
  if (inverted == 0) return Skip("it inverts at none of the states");
  return Ok("Predict gives the measurement back at " + std::to_string(inverted) + " states");
}

Finding CheckStep(Context& context) {
  if (context.model().is_sensor()) return Skip("not a motion model");
  const Function& f = context.main();
  const std::vector<std::string> names = TangentNames(f.outputs);
  const bool stationary = (context.model().instance->capabilities() & ALIDADE_STATIONARY) != 0;
  Farthest identity, additive;
  double order = 0.0;
  for (const State& state : context.states()) {
    const Values inputs = Context::Inputs(f, state);
    const Values blocks(inputs.begin(),
                        inputs.begin() + static_cast<std::ptrdiff_t>(f.outputs.size()));
    const double dt_s = inputs.back()[0];
    const auto still = StepOver(context, f, inputs, blocks, stationary ? dt_s : 0.0);
    if (still) {
      identity.Add(Difference(f.outputs, *still, blocks).abs().maxCoeff(),
                   kRounding * (1.0 + Largest(blocks)), [&] {
                     return context.Where(f, state) + ": " +
                            (stationary ? "it says that it is stationary, but moves"
                                        : "a step over dt = 0 without noise moves it");
                   });
    }
    const auto split = Split(context, f, inputs, blocks, dt_s);
    if (!split) continue;
    const double before = additive.ratio;
    additive.Add(split->defect, kRounding * split->size, [&] {
      return context.Where(f, state) + ", w = 0: one step and two steps over the parts of dt end " +
             RoundedText(split->defect) + " apart in " +
             names[static_cast<std::size_t>(split->row)];
    });
    if (additive.ratio > before) order = OrderOf(context, f, inputs, blocks);
  }
  if (!identity.failure.empty()) return Fail(identity.failure);
  if (additive.failure.empty()) return Ok("additive in dt, and over dt = 0 the identity");
  if (context.options().step_order > 0 && order > context.options().step_order - 0.2) {
    return Ok("additive to order " + RoundedText(order, 2) + " in dt, over dt = 0 the identity");
  }
  return Fail(additive.failure + "; of order " + RoundedText(order, 2) +
              " in dt. A discretisation of order N passes with --step-order N");
}

}  // namespace alidade::internal
