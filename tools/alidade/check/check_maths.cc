// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>

#include "alidade/base/number_text.h"
#include "alidade/check/check_context.h"
#include "alidade/check/check_values.h"
#include "alidade/state/dense_algebra.h"

/// Checks of the mathematics other than Jacobians: noise, rotations, inverse model, steps in time.
namespace alidade::internal {
namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;

// Relative tolerance for the comparison of values that may differ by rounding errors.
constexpr double kRounding = 1e-9;

/// Largest deviation of a value from its expected value, relative to the tolerance.
struct WorstDeviation {
  double ratio = 1.0;  ///< largest deviation / tolerance so far; at least 1
  std::string failure;

  /// Records a failure if the deviation is the largest so far. `text` describes the failure.
  template <class Text>
  void Add(double distance, double tolerance, const Text& text) {
    if (!(distance > tolerance * ratio)) return;
    ratio = distance / tolerance;
    failure = text();
  }
};

std::string DefectOfR(const MatrixXd& l, const Space& z) {
  const MatrixXd r = l * l.transpose();
  const std::vector<std::string> names = TangentNames({z});
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    if (!(r(i, i) > 0.0)) {
      return "R is singular: the noise is 0 for " + names[static_cast<std::size_t>(i)];
    }
  }
  const Eigen::VectorXd scale = r.diagonal().array().rsqrt();
  const MatrixXd correlation = scale.asDiagonal() * r * scale.asDiagonal();
  const double smallest = EigenvaluesOf(correlation)[0];
  if (smallest > 1e-12) return {};
  return "R is singular: the smallest eigenvalue of the correlation matrix is " +
         RoundedText(smallest);
}

/// Computes a step over dt from `blocks` without noise. Returns nullopt if the step is not defined.
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

/// Difference between the results of one step over dt and of two steps over two parts of dt.
struct Additivity {
  double defect = 0.0, size = 0.0;
  Eigen::Index row = 0;  ///< tangent element with the largest difference
};

std::optional<Additivity> TestAdditivity(const Context& context, const Function& f,
                                         const Values& inputs, const Values& blocks, double dt_s) {
  const double first_s = 0.375 * dt_s;
  const auto single_step = StepOver(context, f, inputs, blocks, dt_s);
  const auto first = StepOver(context, f, inputs, blocks, first_s);
  if (!single_step || !first) return std::nullopt;
  const auto two_steps = StepOver(context, f, inputs, *first, dt_s - first_s);
  if (!two_steps) return std::nullopt;
  Additivity result;
  result.size = std::max({1.0, Largest(inputs), Largest(*single_step), Largest(*two_steps)});
  result.defect = Difference(f.outputs, *single_step, *two_steps).abs().maxCoeff(&result.row);
  return result;
}

/// Estimates the order p in defect ~ dt^p from steps of 20 ms and 10 ms.
double OrderOf(const Context& context, const Function& f, const Values& inputs,
               const Values& blocks) {
  const auto coarse = TestAdditivity(context, f, inputs, blocks, 0.02);
  const auto fine = TestAdditivity(context, f, inputs, blocks, 0.01);
  return coarse && fine ? std::log2(coarse->defect / fine->defect) : 0.0;
}

/// Result of a step with w = 0: x', F and N = G Lq.
struct NoisyStep {
  Values next;
  MatrixXd f, n;
};

/// Computes a step over dt_s from `blocks`, with Lq evaluated at `noise_blocks` for noise_dt_s.
std::optional<NoisyStep> StepWithNoise(const Context& context, Values inputs, const Values& blocks,
                                       double dt_s, const Values& noise_blocks, double noise_dt_s) {
  std::copy(blocks.begin(), blocks.end(), inputs.begin());
  std::fill(inputs[blocks.size()].begin(), inputs[blocks.size()].end(), 0.0);
  inputs.back()[0] = dt_s;
  Values noise_inputs = noise_blocks;
  noise_inputs.push_back({noise_dt_s});
  const bool has_input = inputs.size() > blocks.size() + 2;
  if (has_input) noise_inputs.push_back(inputs[blocks.size() + 1]);
  const Answer step = context.CallWith(context.main(), inputs, kAllMatrices);
  const Answer noise = context.CallWith(*context.model().Find("SqrtQ"), noise_inputs, kAllMatrices);
  if (!step.ok() || !noise.ok()) return std::nullopt;
  return NoisyStep{OutputValues(step), ToMatrix(step.matrices[0]),
                   ToMatrix(step.matrices[1]) * ToMatrix(noise.matrices[0])};
}

/// Relative difference between the noise covariances over two parts of dt and over the whole dt.
struct PartsDefect {
  double discrete = 0.0;    ///< difference if both parts have the same w
  double continuous = 0.0;  ///< difference if each part has an independent w
};

std::optional<PartsDefect> DefectOfParts(const Context& context, const Values& inputs,
                                         const Values& blocks, double dt_s) {
  const double first_s = 0.375 * dt_s, second_s = dt_s - first_s;
  const auto single_step = StepWithNoise(context, inputs, blocks, dt_s, blocks, dt_s);
  const auto first = StepWithNoise(context, inputs, blocks, first_s, blocks, first_s);
  if (!single_step || !first) return std::nullopt;
  const Values& between = first->next;
  const auto same_noise = StepWithNoise(context, inputs, between, second_s, blocks, first_s);
  const auto new_noise = StepWithNoise(context, inputs, between, second_s, between, second_s);
  if (!same_noise || !new_noise) return std::nullopt;
  const MatrixXd q = single_step->n * single_step->n.transpose();
  const MatrixXd m = same_noise->f * first->n + same_noise->n, moved = new_noise->f * first->n;
  const MatrixXd discrete = m * m.transpose();
  const MatrixXd continuous = moved * moved.transpose() + new_noise->n * new_noise->n.transpose();
  if (!(q.norm() > 0.0 && q.allFinite())) return std::nullopt;
  return PartsDefect{(discrete - q).norm() / q.norm(), (continuous - q).norm() / q.norm()};
}

/// Estimates the limit of DefectOfParts() for dt -> 0, at which the integration error vanishes.
std::optional<PartsDefect> LimitOfParts(const Context& context, const CheckedState& state) {
  const Values inputs = Context::Inputs(context.main(), state);
  const Values blocks(inputs.begin(),
                      inputs.begin() + static_cast<std::ptrdiff_t>(context.main().outputs.size()));
  std::optional<PartsDefect> smallest;
  for (const double scale : {1e-3, 1e-6, 1e-9}) {
    const auto defect = DefectOfParts(context, inputs, blocks, scale * inputs.back()[0]);
    if (!defect) continue;
    if (!smallest) smallest = defect;
    smallest->discrete = std::min(smallest->discrete, defect->discrete);
    smallest->continuous = std::min(smallest->continuous, defect->continuous);
  }
  return smallest;
}

/// Describes the remedy for noise that is not of the declared kind.
std::string NoiseKindRemedy(bool discrete, bool other_fits) {
  if (!other_fits) {
    return "the noise is neither discrete nor continuous. Discrete noise, such as an acceleration, "
           "is "
           "constant over dt, and Lq does not depend on dt. Continuous noise satisfies "
           "Q(dt) = F Q(dt_1) F' + Q(dt_2)";
  }
  return discrete ? "the noise accumulates over the parts: omit noise_kind(), or return "
                    "NoiseKind::kContinuous"
                  : "the noise is constant over the parts: declare it by `NoiseKind noise_kind() "
                    "const { return NoiseKind::kDiscrete; }`, or make Q grow with dt";
}

/// Compares the results of f for q and -q. q is the quaternion at `offset` in input i.
void CompareCovers(Context& context, const Function& f, std::size_t i, int offset,
                   WorstDeviation& worst) {
  const std::string& name = context.model().slots[static_cast<std::size_t>(f.slots[i])].name;
  for (const CheckedState& state : context.states()) {
    Values negated = Context::Inputs(f, state);
    // A half turn is skipped: there, the sign of a zero determines the sign of the logarithm.
    if (negated[i].empty() || negated[i][static_cast<std::size_t>(offset)] == 0.0) continue;
    for (double& element : std::span(negated[i]).subspan(offset, 4)) element = -element;
    const Answer a = context.Call(f, state), b = context.CallWith(f, negated, kAllMatrices);
    const auto text = [&] {
      return context.CallText(f, state) + ": q and -q of " + name + " yield different results";
    };
    worst.Add(a.code == b.code ? 0.0 : 2.0, 1.0, text);
    if (!a.ok() || !b.ok()) continue;
    const Values x = OutputValues(a), y = OutputValues(b);
    worst.Add(Difference(f.outputs, x, y).abs().maxCoeff(), kRounding * (1.0 + Largest(x)), text);
    const MatrixXd j = ConcatenatedJacobian(a);
    worst.Add((j - ConcatenatedJacobian(b)).cwiseAbs().maxCoeff(),
              kRounding * (1.0 + j.cwiseAbs().maxCoeff()), text);
  }
}

}  // namespace

CheckResult CheckNoise(Context& context) {
  const Function* const f =
      context.model().Find(context.model().is_sensor() ? "SqrtNoise" : "SqrtQ");
  if (f == nullptr) return Skip("the model has no noise input");
  for (const CheckedState& state : context.states()) {
    if (!state.defined) continue;
    const Buffer factor = context.Call(*f, state).matrices.front();
    const MatrixXd l = ToMatrix(factor);
    for (int r = 0; r < factor.rows(); ++r) {
      for (int c = 0; c < factor.columns(); ++c) {
        if (std::isfinite(l(r, c)) && !Unwritten(l(r, c))) continue;
        return Fail(context.CallText(*f, state) + ": entry (" + std::to_string(r) + ", " +
                    std::to_string(c) + ") of the noise factor " +
                    (Unwritten(l(r, c)) ? "is not written" : "is " + NumberText(l(r, c))));
      }
    }
    if (!context.model().is_sensor()) continue;
    const std::string defect = DefectOfR(l, context.model().instance->space());
    if (!defect.empty()) return Fail(context.CallText(*f, state) + ": " + defect);
  }
  return Ok(context.model().is_sensor() ? "R is finite and positive definite" : "Lq is finite");
}

CheckResult CheckDoubleCover(Context& context) {
  WorstDeviation worst;
  bool has_quaternion = false;
  for (const Function& f : context.model().functions) {
    for (std::size_t i = 0; i < f.slots.size() && !f.outputs.empty(); ++i) {
      const Space& space = context.model().slots[static_cast<std::size_t>(f.slots[i])];
      space.geometry.ForEachPart([&](const Geometry& part, int offset, int) {
        if (part.row().quaternion < 0) return;
        has_quaternion = true;
        CompareCovers(context, f, i, offset + part.row().quaternion, worst);
      });
    }
  }
  if (!has_quaternion) return Skip("no input is a quaternion");
  return worst.failure.empty() ? Ok("q and -q yield the same results") : Fail(worst.failure);
}

CheckResult CheckInitialise(Context& context) {
  const Function* const f = context.model().Find("Initialise");
  if (f == nullptr) return Skip("the model has no Initialise");
  const std::vector<int> y = context.model().InitialisedRoles();
  WorstDeviation worst;
  int inverted = 0;
  for (const CheckedState& state : context.states()) {
    if (!state.defined) continue;
    const Answer answer = context.Call(*f, state, kNoMatrix);
    if (!answer.ok()) continue;
    ++inverted;
    CheckedState initialised_state = state;
    const Values initialised = OutputValues(answer);
    for (std::size_t i = 0; i < y.size(); ++i) {
      initialised_state.values[static_cast<std::size_t>(y[i])] = initialised[i];
    }
    const Answer prediction = context.Call(context.main(), initialised_state, kNoMatrix);
    const std::vector<double>& z =
        state.values[static_cast<std::size_t>(context.model().measurement_slot())];
    const auto text = [&] {
      return context.CallText(*f, state) + " returns " + StateText(f->outputs, initialised) +
             ", for which Predict " +
             (prediction.ok()
                  ? "returns " + StateText(context.main().outputs, OutputValues(prediction)) +
                        " instead of the measurement"
                  : std::string("is not defined"));
    };
    worst.Add(prediction.ok() ? 0.0 : 2.0, 1.0, text);
    if (!prediction.ok()) continue;
    const ArrayXd d = Difference(context.main().outputs, OutputValues(prediction), {z});
    worst.Add(d.abs().maxCoeff(), 1e-6 * Largest({z}) + 1e-12 * (1.0 + Largest(state.values)),
              text);
  }
  if (!worst.failure.empty()) return Fail(worst.failure);
  if (inverted == 0) return Skip("Initialise fails at all states");
  return Ok("Predict reproduces the measurement at " + std::to_string(inverted) + " states");
}

CheckResult CheckStep(Context& context) {
  constexpr double kEdge = 1e5;  // the large values of RandomStates() are 1e6
  if (context.model().is_sensor()) return Skip("the model is not a motion model");
  const Function& f = context.main();
  const std::vector<std::string> names = TangentNames(f.outputs);
  const bool stationary = (context.model().instance->capabilities() & ALIDADE_STATIONARY) != 0;
  const int option = context.options().step_order;
  const int expected = option > 0 ? option : context.model().instance->step_order();
  WorstDeviation identity, additive;
  double order = 0.0;
  for (const CheckedState& state : context.states()) {
    const Values inputs = Context::Inputs(f, state);
    const Values blocks(inputs.begin(),
                        inputs.begin() + static_cast<std::ptrdiff_t>(f.outputs.size()));
    const double dt_s = inputs.back()[0];
    const auto unchanged = StepOver(context, f, inputs, blocks, stationary ? dt_s : 0.0);
    if (unchanged) {
      identity.Add(Difference(f.outputs, *unchanged, blocks).abs().maxCoeff(),
                   kRounding * (1.0 + Largest(blocks)), [&] {
                     return context.CallText(f, state) + ": " +
                            (stationary
                                 ? "the model declares itself stationary, but its state changes"
                                 : "a step over dt = 0 without noise changes the state");
                   });
    }
    // The order of an approximation is that of small steps, which inputs of 1e6 are not.
    if (expected > 0 && Largest(inputs) >= kEdge) continue;
    const auto split = TestAdditivity(context, f, inputs, blocks, dt_s);
    if (!split) continue;
    const double previous_ratio = additive.ratio;
    additive.Add(split->defect, kRounding * split->size, [&] {
      return context.CallText(f, state) +
             ", but without noise: one step over dt and two steps over two parts of dt differ by " +
             RoundedText(split->defect) + " in " + names[static_cast<std::size_t>(split->row)];
    });
    if (additive.ratio > previous_ratio) order = OrderOf(context, f, inputs, blocks);
  }
  if (!identity.failure.empty()) return Fail(identity.failure);
  if (additive.failure.empty()) return Ok("Step is additive in dt, and is the identity for dt = 0");
  if (expected > 0 && order > expected - 0.2) {
    return Ok("Step is additive in dt to order " + RoundedText(order, 2) +
              ", and is the identity for dt = 0");
  }
  return Fail(additive.failure + "; the difference is of order " + RoundedText(order, 2) +
              " in dt" + (expected > 0 ? ", not " + std::to_string(expected) : "") +
              ". If the model is a discretisation of order N, declare `static constexpr int "
              "kStepOrder = N;`, or pass --step-order N");
}

// If the declared kind is wrong, the defect is at least 0.47 for every dt. If the declared kind is
// correct, the defect vanishes for dt -> 0.
CheckResult CheckNoiseKind(Context& context) {
  constexpr double kMaxDefect = 0.1;
  if (context.model().is_sensor()) return Skip("the model is not a motion model");
  if (context.model().Find("SqrtQ") == nullptr) return Skip("the model has no noise input");
  const bool discrete = (context.model().instance->capabilities() & ALIDADE_DISCRETE_NOISE) != 0;
  const std::string kind = discrete ? "discrete" : "continuous";
  PartsDefect worst;
  bool has_noise = false;
  std::string worst_call;
  for (const CheckedState& state : context.states()) {
    const auto defect = LimitOfParts(context, state);
    if (!defect) continue;
    has_noise = true;
    const double previous_worst = discrete ? worst.discrete : worst.continuous;
    if ((discrete ? defect->discrete : defect->continuous) > previous_worst) {
      worst_call = context.CallText(context.main(), state);
    }
    worst.discrete = std::max(worst.discrete, defect->discrete);
    worst.continuous = std::max(worst.continuous, defect->continuous);
  }
  if (!has_noise) return Skip("the noise is 0");
  const double declared_defect = discrete ? worst.discrete : worst.continuous;
  const double other_defect = discrete ? worst.continuous : worst.discrete;
  if (declared_defect <= kMaxDefect) {
    return Ok(kind +
              " noise: the covariance over two parts of dt equals the covariance over dt, up to "
              "integration error");
  }
  return Fail("the model declares " + kind +
              " noise, but for small dt the covariance over two parts of dt differs from the "
              "covariance over dt by " +
              std::to_string(std::lround(100.0 * declared_defect)) + " % in the call " +
              worst_call + "; " + NoiseKindRemedy(discrete, other_defect <= kMaxDefect));
}

}  // namespace alidade::internal
