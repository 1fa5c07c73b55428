// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/config/read_covariance.h"
#include "alidade/formula/model_keys.h"
#include "alidade/formula/models_in_config.h"
#include "alidade/formula/rate_integrator.h"

namespace alidade::internal {
namespace {

/// Compiled functions of a motion model, and its description. Exactly one of `step` and `rate` has
/// a value.
struct MotionParts {
  MotionModel::Description description;
  std::optional<CompiledFunction> step;  ///< x' of (blocks, input, w, dt)
  std::optional<RateIntegrator> rate;
  CompiledFunction sigma;  ///< standard deviations of the noise, of (blocks, input)
};

class FormulaMotion final : public MotionModel {
 public:
  explicit FormulaMotion(MotionParts parts)
      : MotionModel(std::move(parts.description)),
        step_(std::move(parts.step)),
        rate_(std::move(parts.rate)),
        sigma_(std::move(parts.sigma)) {}

 private:
  static constexpr std::size_t kMaxInputs = std::size_t{kMaxRoles} + 3;

  Status DoStep(const double* const* block_values, const double* input, const double* w,
                double dt_s, const Output& out) const override {
    if (out.next != nullptr) {
      double next[CompiledFunction::kMaxElements];
      const Status status = rate_ ? rate_->Step(block_values, input, w, dt_s, next, out.f, out.g)
                                  : EvaluateStep(block_values, input, w, dt_s, next, out);
      if (status != Status::kOk) return status;
      const double* value = next;
      for (std::size_t k = 0; k < blocks().size(); ++k) {
        const int size = blocks()[k].geometry.ambient;
        std::copy_n(value, size, out.next[k]);
        value += size;
      }
    }
    return out.sqrt_q == nullptr ? Status::kOk
                                 : EvaluateNoise(block_values, input, dt_s, out.sqrt_q);
  }

  Status EvaluateStep(const double* const* block_values, const double* input, const double* w,
                      double dt_s, double* next, const Output& out) const {
    const std::size_t count = blocks().size();
    std::array<const double*, kMaxInputs> inputs;  // only the used elements are initialised
    std::array<double*, kMaxInputs> jacobians;
    std::array<int, kMaxInputs> strides;
    int column = 0;
    for (std::size_t k = 0; k < count; ++k) {
      inputs[k] = block_values[k];
      jacobians[k] = out.f == nullptr ? nullptr : out.f + column;
      strides[k] = tangent_size();
      column += blocks()[k].geometry.tangent;
    }
    std::size_t k = count;
    if (has_input()) {
      inputs[k] = input;
      jacobians[k++] = nullptr;
    }
    inputs[k] = w;
    jacobians[k] = out.g;
    strides[k++] = noise_size();
    inputs[k] = &dt_s;
    jacobians[k] = nullptr;
    const bool has_jacobians = out.f != nullptr || out.g != nullptr;
    return step_->Evaluate(inputs.data(), next, has_jacobians ? jacobians.data() : nullptr,
                           strides.data());
  }

  /// Computes the diagonal matrix of the standard deviations. Those of continuous noise are divided
  /// by the root of dt; they are 0 for dt = 0.
  Status EvaluateNoise(const double* const* block_values, const double* input, double dt_s,
                       double* sqrt_q) const {
    std::array<const double*, kMaxInputs> inputs;
    std::copy_n(block_values, blocks().size(), inputs.begin());
    inputs[blocks().size()] = input;
    double sigma[CompiledFunction::kMaxElements];
    if (sigma_.Evaluate(inputs.data(), sigma) != Status::kOk) return Status::kOutOfDomain;
    const int n = noise_size(), terms = rate_ ? rate_->terms() : 1;
    const double scale = discrete_noise() ? 1.0 : dt_s > 0.0 ? 1.0 / std::sqrt(dt_s) : 0.0;
    std::fill_n(sqrt_q, n * n, 0.0);
    for (int i = 0; i < n; ++i) {
      if (!(sigma[i / terms] >= 0.0)) return Status::kOutOfDomain;
      sqrt_q[i * n + i] = sigma[i / terms] * scale;
    }
    return Status::kOk;
  }

  std::optional<CompiledFunction> step_;
  std::optional<RateIntegrator> rate_;
  CompiledFunction sigma_;
};

/// Reader of the config entry of a motion model.
class MotionReader {
 public:
  explicit MotionReader(const Node& entry)
      : motion_(entry, "step: {BLOCK: value after dt}, or rate: {BLOCK: derivative by time}") {
    ReadNoise();
  }

  SharedMotion Read() {
    MotionParts parts{{}, {}, {}, ReadSigma()};
    CompiledFunction function = ReadFunction();
    int terms = 1;
    if (is_rate_) {
      parts.rate.emplace(std::move(function), blocks_, !inputs_.empty(), is_discrete_);
      terms = parts.rate->terms();
    } else {
      parts.step = std::move(function);
    }
    MotionModel::Description& description = parts.description;
    description.name = kFormula;
    description.blocks = blocks_;
    description.input = motion_.input;
    description.noise_size = static_cast<int>(noises_.size()) * terms;
    description.discrete_noise = is_discrete_;
    int size = description.noise_size;
    for (const Space& block : blocks_) size += block.geometry.ambient;
    if (size > CompiledFunction::kMaxElements) {
      entry_.Fail(
          "the blocks and the noise of the formula have " + std::to_string(size) + " elements",
          "at most " + std::to_string(CompiledFunction::kMaxElements));
    }
    keys_.RejectUnread();
    return std::make_shared<FormulaMotion>(std::move(parts));
  }

 private:
  void ReadNoise() {
    const auto noise = entry_.Find("noise");
    if (!noise) return;
    noise->ExpectMap("{kind: continuous, NAME: SIGMA}");
    for (const auto& [name, node] : noise->Entries()) {
      if (name == "kind") {
        is_discrete_ = node.Choice({"continuous", "discrete"}) == 1;
        continue;
      }
      noises_.push_back({});
      noises_.back().name = name;
      noises_.back().elements = {""};
      noise_nodes_.push_back(node);
    }
  }

  /// Returns the geometries of the blocks and of the control input.
  std::vector<Geometry> BlocksAndInput() const {
    std::vector<Geometry> geometries = GeometriesOf(blocks_);
    if (!inputs_.empty()) geometries.push_back(motion_.input.geometry);
    return geometries;
  }
  void DeclareBlocksAndInput(const CompiledFunction& function, Scope& scope) const {
    keys_.DeclareSpaces(blocks_, 0, scope);
    if (!inputs_.empty()) keys_.DeclareSpaces(inputs_, function.offset(blocks_.size()), scope);
  }

  CompiledFunction ReadSigma() const {
    CompiledFunction function(BlocksAndInput(), entry_);
    Scope scope(function.program());
    DeclareBlocksAndInput(function, scope);
    keys_.AddTo(scope);
    for (const Node& node : noise_nodes_) {
      const Value value = ParseExpression(node, scope, 1, "one noise");
      const auto number = function.program().ConstantValue(value.nodes[0]);
      if (number) ExpectSigma(node, *number);
      function.AddOutput(Geometry::Vector(1), value, node);
    }
    return function;
  }

  /// Compiles the values after dt, or the rates. A block without an expression is constant.
  CompiledFunction ReadFunction() {
    std::vector<Geometry> geometries = BlocksAndInput();
    const std::size_t noise = geometries.size();
    geometries.push_back(Geometry::Vector(static_cast<int>(noises_.size())));
    // A rate that depends on dt would depend on the division of a step.
    if (!is_rate_) geometries.push_back(Geometry::Vector(1));
    CompiledFunction function(std::move(geometries), entry_);
    const auto declare = [&](Scope& scope) {
      if (!is_rate_) scope.Declare("dt", {{{function.offset(noise + 1)}}}, entry_);
      DeclareBlocksAndInput(function, scope);
      keys_.DeclareSpaces(noises_, function.offset(noise), scope);
      keys_.AddTo(scope);
    };
    Scope scope(function.program());
    declare(scope);
    Program checked(function.program().variables());
    Scope checked_scope(checked);
    declare(checked_scope);
    keys_.CheckDefinitions(checked_scope);
    const Node& map = motion_.equation;
    map.ExpectMap("{BLOCK: EXPRESSION}");
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      Space& block = blocks_[k];
      Value value;
      for (int i = 0; i < block.geometry.ambient; ++i) {
        value.nodes.push_back(is_rate_ ? function.program().Constant(0.0) : function.offset(k) + i);
      }
      const auto node = map.Find(block.name);
      if (node) {
        value = is_rate_
                    ? ParseRate(*node, block, function.offset(k), scope)
                    : ParseExpression(*node, scope, block.geometry.ambient, "block " + block.name);
        block.doc = (is_rate_ ? "d" + block.name + "/dt = " : block.name + "(t + dt) = ") +
                    ExpressionText(*node);
      }
      function.AddOutput(is_rate_ ? Geometry::Vector(block.geometry.ambient) : block.geometry,
                         value, node.value_or(map));
    }
    map.RejectUnread();
    return function;
  }

  /// Compiles a rate. That of a unit quaternion is the angular velocity in the frame of the body.
  static Value ParseRate(const Node& node, const Space& block, int first, Scope& scope) {
    const Geometry& geometry = block.geometry;
    if (geometry.is_vector() || geometry.is_angle())
      return ParseExpression(node, scope, geometry.ambient, "block " + block.name);
    if (!(geometry == Geometry::UnitQuaternion())) {
      node.Fail("a block of geometry " + ToString(geometry) + " has no rate",
                "`step`, or a block that is a number, a vector, an angle or a unit quaternion");
    }
    const Value rate = ParseExpression(node, scope, 3, "the angular velocity in the body");
    Value q;
    for (int i = 0; i < geometry.ambient; ++i) q.nodes.push_back(first + i);
    return CompileQuaternionRate(scope.program(), q, rate);
  }

  MotionKeys motion_;
  const Node& entry_ = motion_.entry;
  const FormulaKeys& keys_ = motion_.keys;
  std::vector<Space>& blocks_ = motion_.blocks;
  const std::vector<Space>& inputs_ = motion_.inputs;
  const bool is_rate_ = motion_.is_rate;
  std::vector<Space> noises_;
  std::vector<Node> noise_nodes_;
  bool is_discrete_ = false;
};

}  // namespace

SharedMotion CreateFormulaMotion(const Node& entry) { return MotionReader(entry).Read(); }

}  // namespace alidade::internal
