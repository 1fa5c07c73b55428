// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/number_text.h"
#include "alidade/check/check_context.h"
#include "alidade/check/check_values.h"
#include "alidade/check/derivative.h"

/// The checks of Jacobians: against differences, and that asking for them changes no value.
namespace alidade::internal {
namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;

/// How two answers of a function differ, beyond the rounding of another order of operations; or "".
std::string ValueDefect(const Function& f, const Answer& a, const Answer& b, const Values& inputs) {
  if (a.code != b.code) {
    return "status " + std::to_string(a.code) + " against " + std::to_string(b.code);
  }
  if (!a.ok()) return {};
  const Values x = OutputValues(a);
  const double distance = Difference(f.outputs, x, OutputValues(b)).abs().maxCoeff();
  if (distance <= 1e-12 * (1.0 + Largest(x) + Largest(inputs))) return {};
  return StateText(f.outputs, x) + ", " + RoundedText(distance) + " apart";
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
    double h = 0.1;
    Input(i).geometry.ForEachPart([&](const Geometry& part, int a, int t) {
      if (part.kind != GeometryKind::kVector || k < t || k >= t + part.tangent) return;
      h *= std::max(std::abs(inputs_[i][static_cast<std::size_t>(a + k - t)]), 0.01);
    });
    const Curve curve = [&](double t) { return Moved(i, k, t); };
    constexpr int kMostLengths = 6;
    std::vector<Entry> entries;
    // A step that leaves the domain, crosses a kink or takes the function round and round, so that
    // differences agree on its mean slope, is shortened.
    for (int tries = 0, lengths = 0; tries < 40 && h > 1e-12; ++tries) {
      const auto derivative = Differentiate(curve, h);
      if (derivative) {
        entries = Compare(*derivative, jacobian_.col(column).array(), h);
        const auto wrong = [](const Entry& e) { return e.wrong; };
        if (std::none_of(entries.begin(), entries.end(), wrong)) return entries;
        if (++lengths == kMostLengths) return entries;
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
        tally.judged += entry.judged ? 1 : 0;
        if (!entry.wrong || entry.Distance() <= tally.worst) continue;
        tally.worst = entry.Distance();
        tally.failure = f.name + ": d " + rows[static_cast<std::size_t>(entry.row)] + " / d " +
                        columns[static_cast<std::size_t>(k)] + " is " + RoundedText(entry.written) +
                        " from the model, " + RoundedText(entry.numeric) + " by differences; " +
                        context.Where(f, inputs);
      }
    }
    column += count;
  }
}

/// `Predict: analytic Jacobian, Initialise: automatic differentiation`
std::string KindsText(const ModelUnderTest& model) {
  const bool analytic = (model.instance->capabilities() & ALIDADE_ANALYTIC_JACOBIAN) != 0;
  std::string text;
  for (const Function& f : model.functions) {
    if (f.differentiated == 0) continue;
    const bool written = analytic && f.name != "Initialise";  // of which a model writes none
    text += (text.empty() ? "" : ", ") + f.name +
            (written ? ": analytic Jacobian" : ": automatic differentiation");
  }
  return text;
}

}  // namespace

Finding CheckSameValue(Context& context) {
  for (const Function& f : context.model().functions) {
    for (const CheckedState& state : context.states()) {
      if (f.differentiated == 0) continue;
      const Answer with = context.Call(f, state);
      const int count = static_cast<int>(f.matrices.size());
      for (int matrix = kNoMatrix; matrix < count; ++matrix) {
        const Answer other = context.Call(f, state, matrix);
        const std::string defect = ValueDefect(f, with, other, Context::Inputs(f, state));
        if (defect.empty()) continue;
        return Fail(context.Where(f, state) + ": the value differs with all Jacobians and with " +
                    (matrix == kNoMatrix ? "none: " : "one alone: ") + defect);
      }
    }
  }
  return Ok("values are the same with and without Jacobians");
}

Finding CheckJacobian(Context& context) {
  JacobianTally tally;
  for (const Function& f : context.model().functions) {
    for (const CheckedState& state : context.states()) {
      if (f.differentiated > 0) TestJacobian(context, f, state, tally);
    }
  }
  if (!tally.failure.empty()) return Fail(tally.failure);
  if (tally.judged == 0) return Skip("differences are nowhere good enough");
  return Ok(KindsText(context.model()) + "; " + std::to_string(tally.judged) +
            " entries agree with differences");
}

}  // namespace alidade::internal
