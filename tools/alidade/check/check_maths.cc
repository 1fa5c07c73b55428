// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>

#include "alidade/base/number_text.h"
#include "alidade/check/check_context.h"
#include "alidade/check/check_values.h"
#include "alidade/state/dense_algebra.h"

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
  const double smallest = EigenvaluesOf(correlation)[0];
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

/// A step without noise: x', F, and N = G Lq.
struct NoisyStep {
  Values next;
  MatrixXd f, n;
};

/// Over dt_s from `blocks`, with Lq as it is at `noise_of`, for a step of noise_dt_s.
std::optional<NoisyStep> StepWithNoise(const Context& context, Values inputs, const Values& blocks,
                                       double dt_s, const Values& noise_of, double noise_dt_s) {
  std::copy(blocks.begin(), blocks.end(), inputs.begin());
  std::fill(inputs[blocks.size()].begin(), inputs[blocks.size()].end(), 0.0);
  inputs.back()[0] = dt_s;
  Values of_noise = noise_of;
  of_noise.push_back({noise_dt_s});
  const bool has_input = inputs.size() > blocks.size() + 2;
  if (has_input) of_noise.push_back(inputs[blocks.size() + 1]);
  const Answer step = context.CallWith(context.main(), inputs, kAllMatrices);
  const Answer noise = context.CallWith(*context.model().Find("SqrtQ"), of_noise, kAllMatrices);
  if (!step.ok() || !noise.ok()) return std::nullopt;
  return NoisyStep{OutputValues(step), ToMatrix(step.matrices[0]),
                   ToMatrix(step.matrices[1]) * ToMatrix(noise.matrices[0])};
}

/// How far the covariance of the noise over two parts of dt is from that over dt, relative to it.
struct PartsDefect {
  double discrete = 0.0, continuous = 0.0;  ///< for one w in both parts, for one in each
};

std::optional<PartsDefect> DefectOfParts(const Context& context, const Values& inputs,
                                         const Values& blocks, double dt_s) {
  const double first_s = 0.375 * dt_s, second_s = dt_s - first_s;
  const auto whole = StepWithNoise(context, inputs, blocks, dt_s, blocks, dt_s);
  const auto first = StepWithNoise(context, inputs, blocks, first_s, blocks, first_s);
  if (!whole || !first) return std::nullopt;
  const Values& between = first->next;
  const auto held = StepWithNoise(context, inputs, between, second_s, blocks, first_s);
  const auto anew = StepWithNoise(context, inputs, between, second_s, between, second_s);
  if (!held || !anew) return std::nullopt;
  const MatrixXd q = whole->n * whole->n.transpose();
  const MatrixXd m = held->f * first->n + held->n, moved = anew->f * first->n;
  const MatrixXd discrete = m * m.transpose();
  const MatrixXd continuous = moved * moved.transpose() + anew->n * anew->n.transpose();
  if (!(q.norm() > 0.0 && q.allFinite())) return std::nullopt;
  return PartsDefect{(discrete - q).norm() / q.norm(), (continuous - q).norm() / q.norm()};
}

/// Where dt goes to 0, and with it what integration leaves.
std::optional<PartsDefect> LimitOfParts(const Context& context, const CheckedState& state) {
  const Values inputs = Context::Inputs(context.main(), state);
  const Values blocks(inputs.begin(),
                      inputs.begin() + static_cast<std::ptrdiff_t>(context.main().outputs.size()));
  std::optional<PartsDefect> least;
  for (const double scale : {1e-3, 1e-6, 1e-9}) {
    const auto defect = DefectOfParts(context, inputs, blocks, scale * inputs.back()[0]);
    if (!defect) continue;
    if (!least) least = defect;
    least->discrete = std::min(least->discrete, defect->discrete);
    least->continuous = std::min(least->continuous, defect->continuous);
  }
  return least;
}

/// The remedy for noise that is not of the kind that the model declares.
std::string RemedyOfParts(bool discrete, bool other_fits) {
  if (!other_fits) {
    return "its noise depends on the number of steps. Discrete noise has an Lq that does not "
           "depend "
           "on dt and enters as what is held, such as an acceleration; continuous noise has "
           "Q(dt) = F Q(dt_1) F' + Q(dt_2)";
  }
  return discrete ? "the noise adds up over the parts: leave noise_kind() out, or let it return "
                    "NoiseKind::kContinuous"
                  : "the noise is held over the parts: declare it by `NoiseKind noise_kind() const "
                    "{ return NoiseKind::kDiscrete; }`, or let Q grow with dt";
}

/// That f is the same for q and -q, the quaternion at `offset` of its input i.
void CompareCovers(Context& context, const Function& f, std::size_t i, int offset,
                   Farthest& farthest) {
  const std::string& name = context.model().slots[static_cast<std::size_t>(f.slots[i])].name;
  for (const CheckedState& state : context.states()) {
    Values turned = Context::Inputs(f, state);
    // Of a half turn, -0 apart from 0 decides which way round its logarithm goes.
    if (turned[i].empty() || turned[i][static_cast<std::size_t>(offset)] == 0.0) continue;
    for (double& element : std::span(turned[i]).subspan(offset, 4)) element = -element;
    const Answer a = context.Call(f, state), b = context.CallWith(f, turned, kAllMatrices);
    const auto words = [&] {
      return context.Where(f, state) + ": q and -q of " + name + " are not the same";
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

}  // namespace

Finding CheckNoise(Context& context) {
  const Function* const f =
      context.model().Find(context.model().is_sensor() ? "SqrtNoise" : "SqrtQ");
  if (f == nullptr) return Skip("it has no noise input");
  for (const CheckedState& state : context.states()) {
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
    for (std::size_t i = 0; i < f.slots.size() && !f.outputs.empty(); ++i) {
      const Space& space = context.model().slots[static_cast<std::size_t>(f.slots[i])];
      space.geometry.ForEachPart([&](const Geometry& part, int offset, int) {
        if (part.kind != GeometryKind::kUnitQuaternion) return;
        any = true;
        CompareCovers(context, f, i, offset, farthest);
      });
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
  for (const CheckedState& state : context.states()) {
    if (!state.defined) continue;
    const Answer answer = context.Call(*f, state, kNoMatrix);
    if (!answer.ok()) continue;
    ++inverted;
    CheckedState back = state;
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
  for (const CheckedState& state : context.states()) {
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
  const int given = context.options().step_order;
  const int expected = given > 0 ? given : context.model().instance->step_order();
  if (expected > 0 && order > expected - 0.2) {
    return Ok("additive to order " + RoundedText(order, 2) + " in dt, over dt = 0 the identity");
  }
  return Fail(additive.failure + "; of order " + RoundedText(order, 2) + " in dt" +
              (expected > 0 ? ", not " + std::to_string(expected) : "") +
              ". A discretisation of order N declares `static constexpr int kStepOrder = N;`, or "
              "passes with --step-order N");
}

// A wrong kind leaves 0.47 or more however small dt is, a right one what goes with dt.
Finding CheckNoiseKind(Context& context) {
  constexpr double kMost = 0.1;
  if (context.model().is_sensor()) return Skip("not a motion model");
  if (context.model().Find("SqrtQ") == nullptr) return Skip("it has no noise input");
  const bool discrete = (context.model().instance->capabilities() & ALIDADE_DISCRETE_NOISE) != 0;
  const std::string kind = discrete ? "discrete" : "continuous";
  PartsDefect worst;
  bool any = false;
  std::string where;
  for (const CheckedState& state : context.states()) {
    const auto defect = LimitOfParts(context, state);
    if (!defect) continue;
    any = true;
    const double before = discrete ? worst.discrete : worst.continuous;
    if ((discrete ? defect->discrete : defect->continuous) > before) {
      where = context.Where(context.main(), state);
    }
    worst.discrete = std::max(worst.discrete, defect->discrete);
    worst.continuous = std::max(worst.continuous, defect->continuous);
  }
  if (!any) return Skip("its noise is 0");
  const double own = discrete ? worst.discrete : worst.continuous;
  const double other = discrete ? worst.continuous : worst.discrete;
  if (own <= kMost) {
    return Ok(kind + " noise: over two parts of dt it is that over dt, but for integration");
  }
  return Fail("declares " + kind +
              " noise, but over two parts of a dt that goes to 0 its covariance "
              "is " +
              std::to_string(std::lround(100.0 * own)) + " % off that over dt, at " + where + "; " +
              RemedyOfParts(discrete, other <= kMost));
}

}  // namespace alidade::internal
