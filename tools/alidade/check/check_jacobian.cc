// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/number_text.h"
#include "alidade/check/check_context.h"
#include "alidade/check/check_values.h"
#include "alidade/check/derivative.h"

/// Checks of Jacobians. Jacobians must agree with numeric differences. A request for Jacobians must
/// not change a value.
namespace alidade::internal {
namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;

/// Describes the difference between two answers if it exceeds the rounding error. Otherwise returns
/// "".
std::string ValueDefect(const Function& f, const Answer& a, const Answer& b, const Values& inputs) {
  if (a.code != b.code) {
    return "the status codes are " + std::to_string(a.code) + " and " + std::to_string(b.code);
  }
  if (!a.ok()) return {};
  const Values x = OutputValues(a);
  const double distance = Difference(f.outputs, x, OutputValues(b)).abs().maxCoeff();
  if (distance <= 1e-12 * (1.0 + Largest(x) + Largest(inputs))) return {};
  return StateText(f.outputs, x) + ", difference " + RoundedText(distance);
}

/// One entry of a Jacobian: the value from the model and the numeric derivative.
struct Entry {
  double model = 0.0, numeric = 0.0;
  Eigen::Index row = 0;
  bool is_judged = false;  ///< true: the numeric derivative is accurate enough for a comparison
  bool is_wrong = false;
  double Distance() const {
    return std::abs(model - numeric) / std::max(std::abs(model), std::abs(numeric));
  }
};

/// Test that compares the Jacobian of one function with numeric differences at one state.
class JacobianTest {
 public:
  JacobianTest(const Context& context, const Function& f, const Values& inputs)
      : context_(context), f_(f), inputs_(inputs) {
    const Answer answer = context.CallWith(f, inputs, kAllMatrices);
    defined_ = answer.ok();
    if (!defined_) return;
    jacobian_ = ConcatenatedJacobian(answer);
    centre_ = OutputValues(answer);
  }
  bool defined() const { return defined_; }

  /// Compares column `column` of the Jacobian, which belongs to tangent element `k` of input `i`.
  std::vector<Entry> Column(std::size_t i, int k, Eigen::Index column) const {
    double h = 0.1;
    Input(i).geometry.ForEachPart([&](const Geometry& part, int a, int t) {
      if (!part.is_vector() || k < t || k >= t + part.tangent) return;
      h *= std::max(std::abs(inputs_[i][static_cast<std::size_t>(a + k - t)]), 0.01);
    });
    const Curve curve = [&](double t) { return Moved(i, k, t); };
    constexpr int kMaxLengths = 6;
    std::vector<Entry> entries;
    // Shorten a step that leaves the domain, crosses a kink, or spans several periods of the
    // function. Over several periods, the differences agree on the mean slope, which is not the
    // derivative.
    for (int tries = 0, lengths = 0; tries < 40 && h > 1e-12; ++tries) {
      const auto derivative = Differentiate(curve, h);
      if (derivative) {
        entries = Compare(*derivative, jacobian_.col(column).array(), h);
        if (std::ranges::none_of(entries, &Entry::is_wrong)) return entries;
        if (++lengths == kMaxLengths) return entries;
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
    return Difference(f_.outputs, OutputValues(answer), centre_);
  }
  std::vector<Entry> Compare(const Derivative& numeric, const ArrayXd& column, double h) const {
    // Rounding error of the values, divided by the smallest step. The factor 100 allows for the
    // amplification of this error by the extrapolation.
    const double size = std::max(Largest(centre_), Largest(inputs_));
    const double floor = 100.0 * 2.2e-16 * size / (kSmallestStep * h);
    std::vector<Entry> entries;
    for (Eigen::Index r = 0; r < column.size(); ++r) {
      Entry entry{column[r], numeric.value[r], r, false, false};
      const double scale = std::max(std::abs(entry.model), std::abs(entry.numeric));
      const double error = numeric.error[r];
      entry.is_judged = error <= 1e-3 * scale + floor;
      entry.is_wrong = entry.is_judged &&
                       std::abs(entry.model - entry.numeric) > 1e-6 * scale + 5.0 * error + floor;
      entries.push_back(entry);
    }
    return entries;
  }

  const Context& context_;
  const Function& f_;
  const Values& inputs_;
  bool defined_ = false;
  MatrixXd jacobian_;
  Values centre_;
};

/// Intermediate results of CheckJacobian().
struct JacobianTally {
  long judged = 0;     ///< number of compared entries
  double worst = 0.0;  ///< largest relative difference of a wrong entry
  std::string failure;
};

void TestJacobian(const Context& context, const Function& f, const CheckedState& state,
                  JacobianTally& tally) {
  const Values inputs = Context::Inputs(f, state);
  const JacobianTest test(context, f, inputs);
  if (!test.defined()) return;
  const std::vector<std::string> rows = TangentNames(f.outputs);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(f.differentiated); ++i) {
    const std::vector<std::string> columns = TangentNames({test.Input(i)});
    const int count = test.Input(i).geometry.tangent;
    for (int k = 0; k < count && !inputs[i].empty(); ++k) {
      for (const Entry& entry : test.Column(i, k, column + k)) {
        tally.judged += entry.is_judged ? 1 : 0;
        if (!entry.is_wrong || entry.Distance() <= tally.worst) continue;
        tally.worst = entry.Distance();
        tally.failure = f.name + ": d " + rows[static_cast<std::size_t>(entry.row)] + " / d " +
                        columns[static_cast<std::size_t>(k)] + " is " + RoundedText(entry.model) +
                        " from the model, but " + RoundedText(entry.numeric) +
                        " from numeric differences; " + context.CallText(f, inputs);
      }
    }
    column += count;
  }
}

/// Returns the kind of each Jacobian, as in
/// `Predict: analytic Jacobian, Initialise: automatic differentiation`.
std::string KindsText(const ModelUnderTest& model) {
  const bool analytic = (model.instance->capabilities() & ALIDADE_ANALYTIC_JACOBIAN) != 0;
  std::string text;
  for (const Function& f : model.functions) {
    if (f.differentiated == 0) continue;
    // The Jacobian of Initialise is always computed by automatic differentiation.
    const bool is_analytic = analytic && f.name != "Initialise";
    text += (text.empty() ? "" : ", ") + f.name +
            (is_analytic ? ": analytic Jacobian" : ": automatic differentiation");
  }
  return text;
}

}  // namespace

CheckResult CheckSameValue(Context& context) {
  for (const Function& f : context.model().functions) {
    for (const CheckedState& state : context.states()) {
      if (f.differentiated == 0) continue;
      const Answer all_jacobians = context.Call(f, state);
      const int count = static_cast<int>(f.matrices.size());
      for (int matrix = kNoMatrix; matrix < count; ++matrix) {
        const Answer fewer_jacobians = context.Call(f, state, matrix);
        const std::string defect =
            ValueDefect(f, all_jacobians, fewer_jacobians, Context::Inputs(f, state));
        if (defect.empty()) continue;
        return Fail(context.CallText(f, state) +
                    ": the value with all Jacobians differs from the value with " +
                    (matrix == kNoMatrix ? "no Jacobian: " : "only one Jacobian: ") + defect);
      }
    }
  }
  return Ok("values are the same with and without Jacobians");
}

CheckResult CheckJacobian(Context& context) {
  JacobianTally tally;
  for (const Function& f : context.model().functions) {
    for (const CheckedState& state : context.states()) {
      if (f.differentiated > 0) TestJacobian(context, f, state, tally);
    }
  }
  if (!tally.failure.empty()) return Fail(tally.failure);
  if (tally.judged == 0) return Skip("no numeric derivative is accurate enough for a comparison");
  return Ok(KindsText(context.model()) + "; " + std::to_string(tally.judged) +
            " entries agree with numeric differences");
}

}  // namespace alidade::internal
