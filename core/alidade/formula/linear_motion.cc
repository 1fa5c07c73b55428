// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/config/read_covariance.h"
#include "alidade/formula/linear_system.h"
#include "alidade/formula/model_keys.h"
#include "alidade/formula/models_in_config.h"
#include "alidade/formula/read_matrix.h"
#include "alidade/state/dense_algebra.h"

namespace alidade::internal {
namespace {

constexpr double kMaxSeconds = 1e9;

/// Linear motion of n states with m control inputs.
///
///   model      x' = F x + B_d u + w,   w ~ N(0, Q_d)
///   rate       dx/dt = A x + B u + G v,  v has the spectral density Q: F, B_d and Q_d are those of
///              the exact solution over dt (linear_system.h)
///   step       x(t + period) = A x + B u + G v,  v ~ N(0, Q): F, B_d and Q_d are those of k steps,
///              k = dt / period
///   Jacobian   F, G = I                                n x n
///   noise      Q_d                                     n x n
///
///   symbol     shape  unit       frame  meaning
///   x          n      config     -      elements of all blocks: numbers and vectors
///   u          m      config     -      control input, constant over dt
///   v          k      1          -      noise, whose units are those of G and Q
///   A          n x n  1/s, or 1  -      by the units of x: of the rate, or of the step
///   period     1      s          -      key `step.period_s`; > 0
///
/// Defined for  `rate`: everywhere. `step`: k an integer >= 0 within 0.01; else Step fails.
/// Source       [VanLoan1978], for `rate`.
///
/// The last F, B_d and Q_d are stored, because dt seldom changes.
class LinearMotion final : public MotionModel {
 public:
  /// `period_s` has a value if `system` is a discrete equation. Q of `system` is G Q G'.
  LinearMotion(Description description, LinearSystem system, std::optional<double> period_s)
      : MotionModel(std::move(description)), system_(std::move(system)), period_s_(period_s) {}

 private:
  /// Equation over one dt.
  struct Solution {
    double dt_s = 0.0;
    LinearSystem step;
    Eigen::MatrixXd sqrt_q;
  };

  Status DoStep(const double* const* block_values, const double* input, const double* w,
                double dt_s, const Output& out) const override {
    const std::shared_ptr<const Solution> solution = Solve(dt_s);
    if (!solution) {
      return RecordModelError(this, "dt is " + NumberText(dt_s) +
                                        " s, which is not a multiple of step.period_s = " +
                                        NumberText(*period_s_) + "; use the form `rate`");
    }
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const int n = tangent_size(), n_w = noise_size();
    if (out.next != nullptr) ComputeNext(solution->step, block_values, input, w, out.next);
    if (out.f != nullptr) Eigen::Map<RowMajor>(out.f, n, n) = solution->step.a;
    if (out.g != nullptr) Eigen::Map<RowMajor>(out.g, n, n_w).setIdentity();
    if (out.sqrt_q != nullptr && n_w > 0) {
      Eigen::Map<RowMajor>(out.sqrt_q, n, n) = solution->sqrt_q;
    }
    return Status::kOk;
  }

  void ComputeNext(const LinearSystem& step, const double* const* block_values, const double* input,
                   const double* w, double* const* next) const {
    Eigen::Index row = 0;
    for (std::size_t k = 0; k < blocks().size(); ++k) {
      for (int i = 0; i < blocks()[k].geometry.ambient; ++i, ++row) {
        double sum = noise_size() > 0 ? w[row] : 0.0;
        Eigen::Index column = 0;
        for (std::size_t j = 0; j < blocks().size(); ++j) {
          for (int e = 0; e < blocks()[j].geometry.ambient; ++e) {
            sum += step.a(row, column++) * block_values[j][e];
          }
        }
        for (Eigen::Index e = 0; e < step.b.cols(); ++e) sum += step.b(row, e) * input[e];
        next[k][i] = sum;
      }
    }
  }

  /// Returns null if dt is not a multiple of the period.
  std::shared_ptr<const Solution> Solve(double dt_s) const {
    std::shared_ptr<const Solution> last = last_.load();
    if (last && last->dt_s == dt_s) return last;
    constexpr double kTolerance = 0.01;  // of the period
    auto solution = std::make_shared<Solution>();
    solution->dt_s = dt_s;
    if (period_s_) {
      const double count = std::round(dt_s / *period_s_);
      if (!(count >= 0.0 && std::abs(dt_s / *period_s_ - count) <= kTolerance)) return nullptr;
      solution->step = Repeat(system_, static_cast<std::int64_t>(count));
    } else {
      solution->step = Discretise(system_, dt_s);
    }
    Eigen::LDLT<Eigen::MatrixXd> ldlt;
    SquareRootOf(solution->step.noise, ldlt, solution->sqrt_q);
    last_.store(solution);
    return solution;
  }

  LinearSystem system_;
  std::optional<double> period_s_;
  mutable std::atomic<std::shared_ptr<const Solution>> last_;
};

/// Reader of the config entry of a linear motion model.
class LinearMotionReader {
 public:
  explicit LinearMotionReader(const Node& entry)
      : motion_(entry, "rate: {A: MATRIX}, or step: {period_s: SECONDS, A: MATRIX}") {
    ExpectVectors(motion_.blocks, entry.At("blocks"));
    names_ = ColumnsOf(motion_.blocks);
  }

  SharedMotion Read() {
    const Node& form = motion_.equation;
    form.ExpectMap("{A: MATRIX, B: MATRIX, G: MATRIX}");
    std::optional<double> period_s;
    if (!motion_.is_rate) {
      period_s = form.At("period_s", "the discrete form", "period_s: 0.1")
                     .Number(0.0, kMaxSeconds, true, false, "s");
    }
    MotionModel::Description description;
    description.name = kLinear;
    description.input = motion_.input;
    const int n = static_cast<int>(names_.size());
    LinearSystem system;
    system.a = ReadMatrix(form.At("A", "a linear model", "a list of rows"), "A", n, n, keys_);
    system.b = ReadB();
    system.noise = ReadNoise();
    description.noise_size = system.noise.isZero(0.0) ? 0 : n;
    form.RejectUnread();
    keys_.CheckDefinitionsOfConstants();
    keys_.RejectUnread();
    Describe(system, period_s);
    description.blocks = motion_.blocks;
    return std::make_shared<LinearMotion>(std::move(description), std::move(system), period_s);
  }

 private:
  Eigen::MatrixXd ReadB() const {
    const Node& form = motion_.equation;
    const int n = static_cast<int>(names_.size());
    if (motion_.inputs.empty()) {
      if (const auto b = form.Find("B")) {
        b->Fail("the model has no control input", "the key `inputs`, such as inputs: {u: [x, y]}");
      }
      return Eigen::MatrixXd(n, 0);
    }
    ExpectVectors(motion_.inputs, entry_.At("inputs"));
    return ReadMatrix(form.At("B", "the control input", "a list of rows"), "B", n,
                      motion_.input.geometry.ambient, keys_);
  }

  /// Returns G Q G'.
  Eigen::MatrixXd ReadNoise() const {
    const Node& form = motion_.equation;
    const int n = static_cast<int>(names_.size());
    const auto g_node = form.Find("G"), noise = entry_.Find("noise");
    if (!noise) {
      if (g_node) entry_.At("noise", "the matrix G", "noise: {sigma: NUMBER}");
      return Eigen::MatrixXd::Zero(n, n);
    }
    const Eigen::MatrixXd g =
        g_node ? ReadMatrix(*g_node, "G", n, -1, keys_) : Eigen::MatrixXd::Identity(n, n);
    constexpr const char* kExample = "{sigma: NUMBERS}, or {covariance: MATRIX}";
    noise->ExpectMap(kExample);
    const auto sigma = noise->Find("sigma"), covariance = noise->Find("covariance");
    noise->RejectUnread();
    if (sigma.has_value() == covariance.has_value()) {
      noise->Fail("the noise needs exactly one of `sigma` and `covariance`", kExample);
    }
    const int n_w = static_cast<int>(g.cols());
    if (sigma) {
      const Eigen::VectorXd sigmas = ReadSigmas(*sigma, n_w, keys_);
      return Congruence(g, sigmas.cwiseAbs2().asDiagonal().toDenseMatrix());
    }
    const std::vector<double> q = ReadCovariance(*covariance, n_w);
    return Congruence(g, Eigen::Map<const Eigen::MatrixXd>(q.data(), n_w, n_w));
  }

  /// Adds the equation of each block as its description.
  void Describe(const LinearSystem& system, const std::optional<double>& period_s) {
    Eigen::MatrixXd matrix(system.a.rows(), system.a.cols() + system.b.cols());
    matrix << system.a, system.b;
    std::vector<std::string> names = names_;
    for (const std::string& name : ColumnsOf(motion_.inputs)) names.push_back(name);
    const std::vector<std::string> rows = RowTexts(matrix, names);
    std::size_t row = 0;
    for (Space& block : motion_.blocks) {
      std::vector<std::string> equations;
      for (int i = 0; i < block.geometry.ambient; ++i, ++row) {
        const std::string& name = names_[row];
        equations.push_back(
            (period_s ? name + "(t + " + NumberText(*period_s) + " s) = " : "d" + name + "/dt = ") +
            rows[row]);
      }
      block.doc = Join(equations);
    }
  }

  MotionKeys motion_;
  const Node& entry_ = motion_.entry;
  const FormulaKeys& keys_ = motion_.keys;
  std::vector<std::string> names_;  ///< of the elements of all blocks
};

}  // namespace

SharedMotion CreateLinearMotion(const Node& entry) { return LinearMotionReader(entry).Read(); }

}  // namespace alidade::internal
