// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/manifold.h"

#include <algorithm>
#include <array>
#include <utility>

#include "alidade/base/error.h"

namespace alidade {
namespace {

void SetIdentity(int size, double* j) {
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) j[row * size + column] = row == column;
  }
}

/// Sets j to the identity, except for the diagonal blocks of the parts that are not vectors.
/// write(part, ambient offset, tangent offset, block) computes such a block.
template <class Write>
void FillByParts(const Geometry& geometry, double* j, const Write& write) {
  const int size = geometry.tangent;
  SetIdentity(size, j);
  geometry.ForEachPart([&](const Geometry& part, int a, int t) {
    if (part.is_vector()) return;
    std::array<double, detail::kMaxTangent * detail::kMaxTangent> block;
    write(part, a, t, block.data());
    for (int row = 0; row < part.tangent; ++row) {
      std::copy_n(block.data() + row * part.tangent, part.tangent, j + (t + row) * size + t);
    }
  });
}

}  // namespace

Geometry::Geometry(std::uint32_t number, int size) : row_(FindGeometry(number)) {
  ALIDADE_EXPECTS(row_ != nullptr && !is_product());
  ambient = is_vector() ? size : row_->ambient;
  tangent = is_vector() ? size : row_->tangent;
}

Geometry Geometry::Product(std::vector<Geometry> parts) {
  Geometry product;
  product.row_ = &detail::kProductRow;
  product.ambient = product.tangent = 0;
  product.parts = std::move(parts);
  for (const Geometry& part : product.parts) {
    product.ambient += part.ambient;
    product.tangent += part.tangent;
  }
  return product;
}

std::string ToString(const Geometry& geometry) {
  std::string name = geometry.name();
  if (geometry.is_vector()) {
    name += '(' + std::to_string(geometry.ambient) + ')';
  } else if (geometry.is_product()) {
    for (const Geometry& part : geometry.parts) {
      name += (&part == &geometry.parts.front() ? "(" : ", ") + ToString(part);
    }
    name += ')';
  }
  return name;
}

bool Geometry::has_transport() const {
  return row_->transport != nullptr || std::ranges::any_of(parts, &Geometry::has_transport);
}

bool Geometry::IsAngular(int i) const {
  bool is_angle = false;
  ForEachPart([&](const Geometry& part, int, int t) {
    if (part.is_vector() || i < t || i >= t + part.tangent) return;
    is_angle = (part.row_->angular >> (i - t) & 1U) != 0;
  });
  return is_angle;
}

bool Geometry::is_angular() const {
  int i = 0;
  while (i < tangent && IsAngular(i)) ++i;
  return i == tangent;
}

void Geometry::Plus(const double* x, const double* d, double* y) const {
  if (is_vector()) return Vec<kDynamic>::Plus(x, d, y, ambient);
  if (!is_product()) return row_->plus(x, d, y);
  ForEachPart([&](const Geometry& part, int a, int t) { part.Plus(x + a, d + t, y + a); });
}

void Geometry::MinusCurved(const double* y, const double* x, double* d) const {
  if (!is_product()) return row_->minus(y, x, d);
  ForEachPart([&](const Geometry& part, int a, int t) { part.Minus(y + a, x + a, d + t); });
}

void Geometry::Transport(const double* x, const double* y, double* j) const {
  if (row_->transport != nullptr) return row_->transport(x, y, j);
  FillByParts(*this, j, [&](const Geometry& part, int a, int, double* block) {
    if (part.row_->transport == nullptr) return SetIdentity(part.tangent, block);
    part.row_->transport(x + a, y + a, block);
  });
}

void PlusJacobian(const Geometry& geometry, const double* x, const double* d, double* j) {
  FillByParts(geometry, j, [&](const Geometry& part, int a, int t, double* block) {
    part.row().plus_jacobian(x + a, d + t, block);
  });
}
void PlusJacobianX(const Geometry& geometry, const double* x, const double* d, double* j) {
  FillByParts(geometry, j, [&](const Geometry& part, int a, int t, double* block) {
    part.row().plus_jacobian_x(x + a, d + t, block);
  });
}

double DistanceFrom(const Geometry& geometry, const double* x) {
  double largest = 0.0;
  geometry.ForEachPart([&](const Geometry& part, int a, int) {
    const auto function = part.row().distance;
    const double distance = function == nullptr ? 0.0 : function(x + a);
    if (!(distance <= largest)) largest = distance;
  });
  return largest;
}

void Geometry::Normalise(double* x) const {
  ForEachPart([&](const Geometry& part, int a, int) {
    if (!part.is_vector()) part.row_->normalise(x + a);
  });
}

void internal::WrapParts(const Geometry& geometry, double* x) {
  geometry.ForEachPart([&](const Geometry& part, int a, int) {
    // If a geometry has no `distance` function, every x lies on the manifold, and Normalise() only
    // wraps angles.
    if (!part.is_vector() && part.row().distance == nullptr) part.Normalise(x + a);
  });
}

std::vector<double> Geometry::Identity() const {
  std::vector<double> x(static_cast<std::size_t>(ambient), 0.0);
  ForEachPart([&](const Geometry& part, int a, int) {
    if (!part.is_vector()) std::copy_n(part.row_->identity, part.ambient, x.begin() + a);
  });
  return x;
}

std::vector<std::string> ColumnNames(const std::string& name, const Space& space) {
  std::vector<std::string> columns;
  for (const std::string& element : space.elements) {
    columns.push_back(element.empty() ? name : name + '.' + element);
  }
  return columns;
}

}  // namespace alidade
