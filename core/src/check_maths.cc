// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "check_table.h"
#include "derivative.h"
#include "number_text.h"

/// The checks of what a model computes: Jacobians against differences, noise, inverses, time.
namespace alidade::internal {
namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;

// Of values that are equal but for rounding.
constexpr double kRounding = 1e-9;

std::string Text(double value) { return RoundedText(value, 6); }

double Largest(const std::vector<double>& values) {
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

double Largest(const Values& values) {
  double largest = 0.0;
  for (const auto& value : values) largest = std::max(largest, Largest(value));
  return largest;
}

Values OutputValues(const Answer& answer) {
  Values values;
  for (const Buffer& buffer : answer.outputs) {
    values.emplace_back();
    for (int i = 0; i < buffer.columns(); ++i) values.back().push_back(buffer(0, i));
  }
  return values;
}

/// a (-) b, all spaces one below the other.
ArrayXd Difference(const std::vector<Space>& spaces, const Values& a, const Values& b) {
  std::vector<double> d;
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    d.resize(d.size() + static_cast<std::size_t>(spaces[i].geometry.tangent));
    double* const tail = d.data() + d.size() - spaces[i].geometry.tangent;
    spaces[i].geometry.Minus(a[i].data(), b[i].data(), tail);
  }
  return Eigen::Map<const ArrayXd>(d.data(), static_cast<Eigen::Index>(d.size()));
}

MatrixXd ToMatrix(const Buffer& buffer) {
  return MatrixXd::NullaryExpr(buffer.rows(), buffer.columns(), [&](auto r, auto c) {
    return buffer(static_cast<int>(r), static_cast<int>(c));
  });
}

/// Whether status and value are the same but for the rounding of another order of operations.
bool SameValue(const Function& f, const Answer& a, const Answer& b, const Values& inputs) {
  if (a.code != b.code) return false;
  if (!a.ok()) return true;
  const Values x = OutputValues(a);
  const double size = 1.0 + Largest(x) + Largest(inputs);
  return Difference(f.outputs, x, OutputValues(b)).abs().maxCoeff() <= 1e-12 * size;
}

/// All Jacobians of `answer` side by side.
MatrixXd SideBySide(const Answer& answer) {
  MatrixXd all(answer.matrices.front().rows(), 0);
  for (const Buffer& buffer : answer.matrices) {
    const Eigen::Index first = all.cols();
    all.conservativeResize(Eigen::NoChange, first + buffer.columns());
    all.rightCols(buffer.columns()) = ToMatrix(buffer);
  }
  return all;
}

std::vector<std::string> TangentNames(const std::vector<Space>& spaces) {
  std::vector<std::string> names;
  for (const Space& space : spaces) {
    for (const std::string& name : internal::TangentNames(space)) names.push_back(name);
  }
  return names;
}

/// How far an entry of a Jacobian is from the numeric one.
struct Entry {
  double written = 0.0, numeric = 0.0;
  Eigen::Index row = 0;
  bool judged = false;  ///< the numeric derivative is good enough to tell
  bool wrong = false;
  double Distance() const {
    return std::abs(written - numeric) / std::max(std::abs(written), std::abs(numeric));
  }
};

/// Compares the Jacobian of a function at one state with differences.
class JacobianTest {
 public:
  JacobianTest(const Context& context, const Function& f, const Values& inputs)
      : context_(context), f_(f), inputs_(inputs) {
    const Answer answer = context.CallWith(f, inputs, kAllMatrices);
    defined_ = answer.ok();
    if (!defined_) return;
    jacobian_ = SideBySide(answer);
    center_ = OutputValues(answer);
  }
  bool defined() const { return defined_; }

  /// The entries of the column of tangent element `k` of input `i`, which is `column` of all.
  std::vector<Entry> Column(std::size_t i, int k, Eigen::Index column) const {
    const Geometry& geometry = Input(i).geometry;
    double h = 0.1;
    if (geometry.kind == GeometryKind::kVector) {
      h *= std::max(std::abs(inputs_[i][static_cast<std::size_t>(k)]), 0.01);
    }
    const Curve curve = [&](double t) { return Moved(i, k, t); };
    std::vector<Entry> entries;
    // A step that leaves the domain, or crosses a kink, is shortened.
    for (int tries = 0; tries < 40 && h > 1e-12; ++tries) {
      const auto derivative = Differentiate(curve, h);
      if (derivative) {
        entries = Compare(*derivative, jacobian_.col(column).array(), h);
        const auto wrong = [](const Entry& e) { return e.wrong; };
        if (std::none_of(entries.begin(), entries.end(), wrong) || tries >= 3) return entries;
      }
      h /= derivative ? 16.0 : 2.0;
    }
    return entries;
  }
  const Space& Input(std::size_t i) const {
    return context_.model().slots[static_cast<std::size_t>(f_.slots[i])];
  }

 private:
  std::optional<ArrayXd> Moved(std::size_t i, int k, double t) const {
    Values moved = inputs_;
    const Geometry& geometry = Input(i).geometry;
    std::vector<double> d(static_cast<std::size_t>(geometry.tangent));
    d[static_cast<std::size_t>(k)] = t;
    geometry.Plus(inputs_[i].data(), d.data(), moved[i].data());
    const Answer answer = context_.CallWith(f_, moved, kNoMatrix);
    if (!answer.ok()) return std::nullopt;
    return Difference(f_.outputs, OutputValues(answer), center_);
  }
  std::vector<Entry> Compare(const Derivative& numeric, const ArrayXd& written, double h) const {
    // Rounding of the values, seen through the smallest step; 100 for what extrapolation adds.
    const double size = std::max(Largest(center_), Largest(inputs_));
    const double floor = 100.0 * 2.2e-16 * size / (kSmallestStep * h);
    std::vector<Entry> entries;
    for (Eigen::Index r = 0; r < written.size(); ++r) {
      Entry entry{written[r], numeric.value[r], r, false, false};
      const double scale = std::max(std::abs(entry.written), std::abs(entry.numeric));
      const double error = numeric.error[r];
      entry.judged = error <= 1e-3 * scale + floor;
      entry.wrong = entry.judged &&
                    std::abs(entry.written - entry.numeric) > 1e-6 * scale + 5.0 * error + floor;
      entries.push_back(entry);
    }
    return entries;
  }

  const Context& context_;
  const Function& f_;
  const Values& inputs_;
  bool defined_ = false;
  MatrixXd jacobian_;
  Values center_;
};

/// What CheckJacobian has seen so far.
struct JacobianTally {
  long judged = 0;
  double worst = 0.0;  ///< relative distance of the worst wrong entry
  std::string failure;
};

void TestJacobian(const Context& context, const Function& f, const State& state,
                  JacobianTally& tally) {
  const Values inputs = Context::Inputs(f, state);
  const JacobianTest test(context, f, inputs);
  if (!test.defined()) return;
  const std::vector<std::string> rows = TangentNames(f.outputs);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(f.differentiated); ++i) {
    const std::vector<std::string> columns = internal::TangentNames(test.Input(i));
    const int count = test.Input(i).geometry.tangent;
    for (int k = 0; k < count && !inputs[i].empty(); ++k) {
      for (const Entry& entry : test.Column(i, k, column + k)) {
        tally.judged += entry.judged ? 1 : 0;
        if (!entry.wrong || entry.Distance() <= tally.worst) continue;
        tally.worst = entry.Distance();
        tally.failure = f.name + ": d " + rows[static_cast<std::size_t>(entry.row)] + " / d " +
                        columns[static_cast<std::size_t>(k)] + " is " + Text(entry.written) +
                        " from the model, " + Text(entry.numeric) + " by differences; " +
                        context.Where(f, inputs);
      }
    }
    column += count;
  }
}

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
  const std::vector<std::string> names = internal::TangentNames(z);
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
  return "R is singular: smallest eigenvalue of its correlations " + Text(smallest);
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
  result.size = std::max({1.0, Largest(blocks), Largest(*whole), Largest(*both)});
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

Finding CheckSameValue(Context& context) {
  for (const Function& f : context.model().functions) {
    for (const State& state : context.states()) {
      if (f.differentiated == 0) continue;
      const Answer with = context.Call(f, state);
      const int count = static_cast<int>(f.matrices.size());
      for (int matrix = kNoMatrix; matrix < count; ++matrix) {
        const Answer other = context.Call(f, state, matrix);
        if (SameValue(f, with, other, Context::Inputs(f, state))) continue;
        return Fail(context.Where(f, state) + ": the value differs with all Jacobians and with " +
                    (matrix == kNoMatrix ? "none" : "one alone") + ": " +
                    StateText(f.outputs, OutputValues(with)) + " against " +
                    StateText(f.outputs, OutputValues(other)));
      }
    }
  }
  return Ok("values are the same with and without Jacobians");
}

Finding CheckJacobian(Context& context) {
  JacobianTally tally;
  for (const Function& f : context.model().functions) {
    for (const State& state : context.states()) {
      if (f.differentiated > 0) TestJacobian(context, f, state, tally);
    }
  }
  if (!tally.failure.empty()) return Fail(tally.failure);
  if (tally.judged == 0) return Skip("differences are nowhere good enough");
  return Ok(std::to_string(tally.judged) + " entries agree with differences");
}

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
    const std::string defect = DefectOfR(l, context.model().slots.back());
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
  const auto y =
      static_cast<std::size_t>(context.model().instance->c().description->initialise_role);
  Farthest farthest;
  int inverted = 0;
  for (const State& state : context.states()) {
    if (!state.defined) continue;
    const Answer answer = context.Call(*f, state, kNoMatrix);
    if (!answer.ok()) continue;
    ++inverted;
    State back = state;
    back.values[y] = OutputValues(answer).front();
    const Answer again = context.Call(context.main(), back, kNoMatrix);
    const std::vector<double>& z = state.values.back();
    const auto words = [&] {
      return context.Where(*f, state) + " gives " + StateText(f->outputs, OutputValues(answer)) +
             ", where Predict " +
             (again.ok() ? "gives " + StateText(context.main().outputs, OutputValues(again))
                         : std::string("is not defined"));
    };
    farthest.Add(again.ok() ? 0.0 : 2.0, 1.0, words);
    if (!again.ok()) continue;
    const ArrayXd d = Difference(context.main().outputs, OutputValues(again), {z});
    farthest.Add(d.abs().maxCoeff(), 1e-6 * Largest(z) + 1e-12 * (1.0 + Largest(state.values)),
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
             Text(split->defect) + " apart in " + names[static_cast<std::size_t>(split->row)];
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
