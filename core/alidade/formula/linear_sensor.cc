// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/formula/model_keys.h"
#include "alidade/formula/models_in_config.h"
#include "alidade/formula/read_matrix.h"

namespace alidade::internal {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Linear function of any blocks.
///
///   model      z = sum_i H_i x_i + c + n,   n ~ N(0, R)
///   Jacobian   dz/dx_i = H_i                           m x n_i
///   noise      R                                       m x m, in the units of z
///
///   symbol     shape    unit     frame  meaning
///   z          m        config   -      measured quantities
///   x_i        n_i      config   -      block of the role i: a number or a vector
///   H_i        m x n_i  of z by  -      matrix of the role i
///                       unit of x_i
///   c          m        of z     -      key `offset`
///
/// Defined everywhere.
/// Source       [BarShalom2001] sec. 5.2.
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
      : sensor_(entry, bound_roles) {
    const Node z = sensor_.Measured("z: {position: [x, y]}");
    sensor_.parts = keys_.ReadSpaces("z");
    ExpectVectors(sensor_.parts, z);
    ExpectVectors(sensor_.roles, entry);
  }

  SharedSensor Read() {
    const Node& entry = sensor_.entry;
    const int m = sensor_.Measurement().geometry.tangent;
    const Node node = entry.At("H", "a linear sensor", "H: {ROLE: MATRIX}");
    node.ExpectMap("{ROLE: MATRIX}");
    std::vector<RowMajor> h;
    for (const Space& role : sensor_.roles) {
      const Node matrix = node.At(role.name, "role '" + role.name + "'", role.name + ": MATRIX");
      h.emplace_back(ReadMatrix(matrix, "H." + role.name, m, role.geometry.tangent, keys_));
    }
    node.RejectUnread();
    Eigen::VectorXd offset = Eigen::VectorXd::Zero(m);
    if (const auto values = entry.Find("offset")) {
      offset = ReadMatrix(*values, "offset", m, 1, keys_);
    }
    Describe(h, offset);
    SensorModel::Description description;
    description.name = kLinear;
    description.roles = sensor_.roles;
    description.measurement = sensor_.Measurement();
    description.sqrt_noise = ReadSqrtNoise(m);
    keys_.CheckDefinitionsOfConstants();
    keys_.RejectUnread();
    return std::make_shared<LinearSensor>(std::move(description), std::move(h), std::move(offset));
  }

 private:
  /// Adds the equations of each part as its description.
  void Describe(const std::vector<RowMajor>& h, const Eigen::VectorXd& offset) {
    const std::vector<std::string> columns = ColumnsOf(sensor_.roles);
    Eigen::MatrixXd all(offset.size(), static_cast<Eigen::Index>(columns.size()));
    Eigen::Index column = 0;
    for (const RowMajor& matrix : h) {
      all.middleCols(column, matrix.cols()) = matrix;
      column += matrix.cols();
    }
    std::vector<std::string> rows = RowTexts(all, columns);
    std::size_t row = 0;
    for (Space& part : sensor_.parts) {
      std::vector<std::string> equations;
      for (const std::string& name : ColumnNames(part.name, part)) {
        const double constant = offset[static_cast<Eigen::Index>(row)];
        equations.push_back(name + " = " + rows[row++]);
        if (constant == 0.0) continue;
        equations.back() += (constant < 0.0 ? " - " : " + ") + NumberText(std::abs(constant));
      }
      part.doc = Join(equations);
    }
  }

  /// Returns the lower triangular L of R = L L', row-major.
  std::vector<double> ReadSqrtNoise(int size) const {
    if (const auto root = sensor_.ReadSqrtCovariance()) return *root;
    Program program(0);
    Scope scope(program);
    keys_.AddTo(scope);
    RowMajor root = RowMajor::Zero(size, size);
    Eigen::Index i = 0;
    for (const Value& sigma : sensor_.ReadSigmas(scope)) {
      for (const double number : ConstantsOf(sigma, program, sensor_.entry.At("sigma"))) {
        root(i, i) = number;
        ++i;
      }
    }
    return {root.data(), root.data() + root.size()};
  }

  SensorKeys sensor_;
  const FormulaKeys& keys_ = sensor_.keys;
};

}  // namespace

SharedSensor CreateLinearSensor(const Node& entry, const std::vector<Space>& bound_roles,
                                bool has_landmark) {
  if (has_landmark) {
    entry.At("roles").At("landmark").Fail("the model linear has no landmarks", "the model formula");
  }
  return LinearSensorReader(entry, bound_roles).Read();
}

}  // namespace alidade::internal
