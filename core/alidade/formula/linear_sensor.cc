// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/linear_sensor.h"

#include <cmath>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/formula/read_matrix.h"
#include "alidade/plugin/config_noise.h"
#include "alidade/state/element_names.h"

namespace alidade::internal {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Linear function of any blocks.
///
///   model      z = sum_i H_i x_i + offset + n,   n ~ N(0, R)
///   Jacobian   dz/dx_i = H_i
///
/// Defined everywhere.
class LinearSensor final : public SensorModel {
 public:
  /// R of `description` must be set.
  LinearSensor(Description description, std::vector<RowMajor> h, Eigen::VectorXd offset)
      : SensorModel(std::move(description)), h_(std::move(h)), offset_(std::move(offset)) {}

 private:
  Status DoEvaluate(const Observation& /*observation*/, const double* const* role_values,
                    const Output& out) const override {
    if (out.h == nullptr) return Status::kOk;
    Eigen::Map<Eigen::VectorXd> z(out.h, offset_.size());
    z = offset_;
    for (std::size_t k = 0; k < h_.size(); ++k) {
      const RowMajor& h = h_[k];
      z.noalias() += h * Eigen::Map<const Eigen::VectorXd>(role_values[k], h.cols());
      if (out.jacobians == nullptr || out.jacobians[k] == nullptr) continue;
      Eigen::Map<RowMajor, 0, Eigen::OuterStride<>>(out.jacobians[k], h.rows(), h.cols(),
                                                    Eigen::OuterStride<>(out.strides[k])) = h;
    }
    return Status::kOk;
  }

  std::vector<RowMajor> h_;  ///< by role
  Eigen::VectorXd offset_;
};

/// Reader of the config entry of a linear sensor.
class LinearSensorReader {
 public:
  LinearSensorReader(const Node& entry, const std::vector<Space>& bound_roles)
      : keys_(entry), entry_(entry), roles_(bound_roles), parts_(keys_.ReadSpaces("z")) {
    for (Space& role : keys_.ReadSpaces("owns", ALIDADE_ROLE_OWNED)) {
      roles_.push_back(std::move(role));
    }
    if (roles_.size() > std::size_t{kMaxRoles}) {
      entry_.Fail("the sensor has " + std::to_string(roles_.size()) + " roles",
                  "at most " + std::to_string(kMaxRoles));
    }
    constexpr const char* kExample = "z: {position: [x, y]}";
    const Node z = entry_.At("z", "a linear sensor", kExample);
    if (parts_.empty()) z.Fail("the sensor measures nothing", kExample);
    ExpectVectors(parts_, z);
    ExpectVectors(roles_, entry_);
  }

  SharedSensor Read() {
    SensorModel::Description description;
    description.name = kLinear;
    description.roles = roles_;
    description.measurement = Concatenated(parts_, "z");
    const int m = description.measurement.geometry.tangent;
    const Node node = entry_.At("H", "a linear sensor", "H: {ROLE: MATRIX}");
    node.ExpectMap("{ROLE: MATRIX}");
    std::vector<RowMajor> h;
    std::vector<std::string> columns;
    Eigen::MatrixXd all(m, 0);
    for (const Space& role : roles_) {
      const Node matrix = node.At(role.name, "role '" + role.name + "'", role.name + ": MATRIX");
      h.emplace_back(ReadMatrix(matrix, "H." + role.name, m, role.geometry.tangent, keys_));
      Eigen::MatrixXd wider(m, all.cols() + h.back().cols());
      wider << all, h.back();
      all = std::move(wider);
      for (const std::string& name : ColumnNames(role.name, role)) columns.push_back(name);
    }
    node.RejectUnread();
    Eigen::VectorXd offset = Eigen::VectorXd::Zero(m);
    if (const auto values = entry_.Find("offset")) {
      offset = ReadMatrix(*values, "offset", m, 1, keys_);
    }
    Describe(all, columns, offset, description.measurement);
    description.sqrt_noise = ReadSqrtNoise(m);
    keys_.RejectUnread();
    return std::make_shared<LinearSensor>(std::move(description), std::move(h), std::move(offset));
  }

 private:
  static void Describe(const Eigen::MatrixXd& h, const std::vector<std::string>& columns,
                       const Eigen::VectorXd& offset, Space& measurement) {
    std::vector<std::string> equations = RowTexts(h, columns);
    const std::vector<std::string> names = ColumnNames(measurement.name, measurement);
    for (std::size_t i = 0; i < equations.size(); ++i) {
      const double constant = offset[static_cast<Eigen::Index>(i)];
      equations[i] = names[i] + " = " + equations[i];
      if (constant == 0.0) continue;
      equations[i] += (constant < 0.0 ? " - " : " + ") + NumberText(std::abs(constant));
    }
    measurement.doc = Join(equations);
  }

  /// Returns the lower triangular L of R = L L', row-major.
  std::vector<double> ReadSqrtNoise(int size) const {
    const auto covariance = entry_.Find("covariance"), sigma = entry_.Find("sigma");
    if (covariance) {
      if (sigma) covariance->Fail("the noise is also defined by `sigma`", "one of the two keys");
      return ReadSqrtR(*covariance, size);
    }
    const std::string example = "sigma: {" + parts_[0].name + ": 0.1}";
    const Node map = entry_.At("sigma", "a linear sensor", example);
    map.ExpectMap(example);
    RowMajor root = RowMajor::Zero(size, size);
    Eigen::Index first = 0;
    for (const Space& part : parts_) {
      const Node node = map.At(part.name, "z." + part.name, example);
      const Eigen::VectorXd sigmas = ReadSigmas(node, part.geometry.tangent, keys_);
      if (sigmas.minCoeff() <= 0.0) node.Fail("the standard deviation is not > 0");
      root.diagonal().segment(first, sigmas.size()) = sigmas;
      first += sigmas.size();
    }
    map.RejectUnread();
    return {root.data(), root.data() + root.size()};
  }

  FormulaKeys keys_;
  Node entry_;
  std::vector<Space> roles_, parts_;
};

}  // namespace

SharedSensor CreateLinearSensor(const Node& entry, const std::vector<Space>& bound_roles) {
  return LinearSensorReader(entry, bound_roles).Read();
}

}  // namespace alidade::internal
