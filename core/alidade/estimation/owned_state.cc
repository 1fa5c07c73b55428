// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/owned_state.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"
#include "alidade/estimation/direct_models.h"

namespace alidade::internal {
namespace {

/// Dynamics of a model parameter state: the decay a and the square root of Q. Both motion models
/// below use them.
struct Dynamics {
  explicit Dynamics(const OwnedRole& owned, std::size_t n)
      : mean(owned.mean), l(owned.sqrt_density), tau_s(owned.time_constant_s) {
    if (owned.dynamics == OwnedDynamics::kConstant || l.empty()) l.assign(n * n, 0.0);
    if (owned.dynamics != OwnedDynamics::kGaussMarkov) tau_s = 0.0;
  }

  bool is_gauss_markov() const { return tau_s > 0.0; }
  bool is_stationary() const {
    return !is_gauss_markov() &&
           std::ranges::all_of(l, [](double element) { return element == 0.0; });
  }
  double Decay(double dt_s) const { return is_gauss_markov() ? std::exp(-dt_s / tau_s) : 1.0; }
  void SqrtQ(double dt_s, int n, MatrixRef q) const {
    const double effective_dt_s =
        is_gauss_markov() ? -0.5 * tau_s * std::expm1(-2.0 * dt_s / tau_s) : dt_s;
    for (int i = 0; i < n * n; ++i) {
      q(i / n, i % n) = std::sqrt(std::max(effective_dt_s, 0.0)) * l[static_cast<std::size_t>(i)];
    }
  }

  std::vector<double> mean, l;
  double tau_s;
};

/// Motion model of a model parameter state that is a vector of any size.
struct OwnedVectorMotion : Motion<kDynamic, Vec<kDynamic>> {
  static constexpr std::array kBlocks{Quantity{"value"}};

  Dynamics dynamics;
  int size;

  OwnedVectorMotion(const OwnedRole& owned, int n)
      : dynamics(owned, static_cast<std::size_t>(n)), size(n) {}

  int Size(int) const { return size; }
  int NoiseSize() const { return size; }
  bool Stationary() const { return dynamics.is_stationary(); }
  template <class T>
  void Step(const T* x, const T* w, double dt_s, T* next) const {
    const double a = dynamics.Decay(dt_s);
    for (int i = 0; i < size; ++i) {
      const double mean =
          dynamics.is_gauss_markov() ? dynamics.mean[static_cast<std::size_t>(i)] : 0.0;
      next[i] = mean + a * (x[i] - mean) + w[i];
    }
  }
  void StepJacobian(const double*, const double*, double dt_s, MatrixRef f, MatrixRef g) const {
    for (int i = 0; i < size; ++i) {
      f(i, i) = dynamics.Decay(dt_s);
      g(i, i) = 1.0;
    }
  }
  void SqrtQ(double dt_s, MatrixRef q) const { dynamics.SqrtQ(dt_s, size, q); }
};

/// Motion model of a model parameter state whose geometry has a fixed size.
template <class G>
struct OwnedGeometryMotion : Motion<G::kTangent, G> {
  static constexpr std::array kBlocks{Quantity{"value"}};

  Dynamics dynamics;

  explicit OwnedGeometryMotion(const OwnedRole& owned) : dynamics(owned, G::kTangent) {}

  bool Stationary() const { return dynamics.is_stationary(); }
  template <class T>
  void Step(const T* x, const T* w, double dt_s, T* next) const {
    if (!dynamics.is_gauss_markov()) return G::Plus(x, w, next);
    T d[G::kTangent], decayed[G::kAmbient];
    G::Minus(x, dynamics.mean.data(), d);
    for (T& element : d) element *= dynamics.Decay(dt_s);
    G::Plus(dynamics.mean.data(), d, decayed);
    G::Plus(decayed, w, next);
  }
  void SqrtQ(double dt_s, MatrixRef q) const { dynamics.SqrtQ(dt_s, G::kTangent, q); }
};

const char* NameOf(OwnedDynamics dynamics) {
  switch (dynamics) {
    case OwnedDynamics::kRandomWalk:
      return "random_walk";
    case OwnedDynamics::kGaussMarkov:
      return "gauss_markov";
    case OwnedDynamics::kConstant:
      break;
  }
  return "constant";
}

}  // namespace

SharedMotion OwnedMotion(const Geometry& geometry, const OwnedRole& owned) {
  const char* const name = NameOf(owned.dynamics);
  ALIDADE_EXPECTS(!geometry.is_product());
  if (geometry.is_vector()) return MakeMotion(OwnedVectorMotion(owned, geometry.ambient), name);
  SharedMotion motion;
  VisitGeometry(geometry.row().number,
                [&]<class G>(G) { motion = MakeMotion(OwnedGeometryMotion<G>(owned), name); });
  return motion;
}

}  // namespace alidade::internal
