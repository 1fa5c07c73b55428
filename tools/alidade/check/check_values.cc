// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/check_values.h"

#include <algorithm>
#include <cmath>

#include "alidade/state/element_names.h"

namespace alidade::internal {

using Eigen::ArrayXd;
using Eigen::MatrixXd;

double Largest(const Values& values) {
  double largest = 0.0;
  for (const auto& value : values) {
    for (const double element : value) largest = std::max(largest, std::abs(element));
  }
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

MatrixXd ConcatenatedJacobian(const Answer& answer) {
  MatrixXd jacobian(answer.matrices.front().rows(), 0);
  for (const Buffer& buffer : answer.matrices) {
    const Eigen::Index first = jacobian.cols();
    jacobian.conservativeResize(Eigen::NoChange, first + buffer.columns());
    jacobian.rightCols(buffer.columns()) = ToMatrix(buffer);
  }
  return jacobian;
}

std::vector<std::string> TangentNames(const std::vector<Space>& spaces) {
  std::vector<std::string> names;
  for (const Space& space : spaces) {
    for (const std::string& name : TangentNames(space.name, space)) names.push_back(name);
  }
  return names;
}

}  // namespace alidade::internal
