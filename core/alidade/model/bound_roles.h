// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>
#include <type_traits>
#include <vector>

#include "alidade/model/params.h"

namespace alidade {

/// Roles of a sensor that the config binds, with the geometries of their blocks. A sensor that
/// exists in several variants, such as one for the plane and one for space, selects its variant by
/// them. The host writes the parameter `roles` as the text `ROLE: GEOMETRY, ...`, in the order of
/// the config. `alidade check` uses the geometries that the user sets, for example by
/// `--set 'roles.position=vector(2)'`.
class BoundRoles {
 public:
  struct Role {
    std::string name, geometry;  ///< geometry: such as `vector(3)` or `angle`

    /// Returns the number of elements of a vector, or 0.
    int VectorSize() const {
      const char prefix[] = "vector(";
      return geometry.compare(0, sizeof(prefix) - 1, prefix) == 0
                 ? std::atoi(geometry.c_str() + sizeof(prefix) - 1)
                 : 0;
    }
  };

  explicit BoundRoles(Params& params) : params_(params) {
    const std::string text = params.Text(
        "roles", "geometries of the blocks that fill the roles, which select the variant", "");
    for (std::size_t first = 0; first < text.size();) {
      const std::size_t colon = text.find(": ", first);
      if (colon == std::string::npos) break;
      std::size_t end = text.find(", ", colon);
      if (end == std::string::npos) end = text.size();
      roles_.push_back(
          {text.substr(first, colon - first), text.substr(colon + 2, end - colon - 2)});
      first = end + 2;
    }
  }

  const std::vector<Role>& all() const { return roles_; }
  /// Returns the role, or null if the config does not bind it.
  const Role* Find(const std::string& name) const {
    for (const Role& role : roles_) {
      if (role.name == name) return &role;
    }
    return nullptr;
  }
  /// Calls f(std::integral_constant<int, N>{}) with the size N of the vector that is bound to
  /// `role`. N is kHigh if the role is not bound. Reports an error unless kLow <= N <= kHigh.
  template <int kLow, int kHigh, class F>
  void VisitSize(const char* role, const F& f) const {
    const Role* const bound = Find(role);
    const int size = bound == nullptr ? kHigh : bound->VectorSize();
    if (size < kLow || size > kHigh) {
      const std::string text = "is bound to a block of the geometry " + bound->geometry +
                               "; expected a vector of " + std::to_string(kLow) + " to " +
                               std::to_string(kHigh) + " elements";
      params_.Fail((std::string("roles.") + role).c_str(), text.c_str());
      return;
    }
    Visit<kLow, kHigh>(size, f);
  }

 private:
  template <int N, int kHigh, class F>
  static void Visit(int size, const F& f) {
    if (size == N) return f(std::integral_constant<int, N>{});
    if constexpr (N < kHigh) Visit<N + 1, kHigh>(size, f);
  }

  Params& params_;
  std::vector<Role> roles_;
};

}  // namespace alidade
