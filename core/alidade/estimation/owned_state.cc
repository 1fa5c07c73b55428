// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/owned_state.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

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

/// Motion model of a model parameter state whose geometry has a fixed size.
class OwnedGeometryMotion final : public MotionModel {
 public:
  OwnedGeometryMotion(const Geometry& geometry, const OwnedRole& owned)
      : OwnedGeometryMotion(geometry, Dynamics(owned, static_cast<std::size_t>(geometry.tangent)),
                            NameOf(owned.dynamics)) {}

 private:
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                               detail::kMaxTangent, detail::kMaxTangent>;

  OwnedGeometryMotion(const Geometry& geometry, Dynamics dynamics, std::string name)
      : MotionModel({.name = std::move(name),
                     .origin = {},
                     .blocks = {detail::SpaceOf(Quantity{"value"}, geometry)},
                     .noise_size = geometry.tangent,
                     .stationary = dynamics.is_stationary()}),
        dynamics_(std::move(dynamics)) {}

  Status DoStep(const double* const* blocks, const double*, const double* w, double dt_s,
                const Output& out) const override {
    const Geometry& geometry = this->blocks()[0].geometry;
    const int n = geometry.tangent;
    if (out.next != nullptr) {
      // next = y (+) w, and y = x or y = mu (+) a (x (-) mu)
      double* const next = out.next[0];
      std::copy_n(blocks[0], geometry.ambient, next);
      Square dy_dx = Square::Identity(n, n);
      if (dynamics_.is_gauss_markov()) dy_dx = Decay(geometry, dynamics_.Decay(dt_s), next);
      if (out.g != nullptr) {
        Square dnext_dy(n, n);
        PlusJacobianX(geometry, next, w, dnext_dy.data());
        Eigen::Map<Square>(out.f, n, n).noalias() = dnext_dy * dy_dx;
        PlusJacobian(geometry, next, w, out.g);
      }
      geometry.Plus(next, w, next);
    }
    if (out.sqrt_q != nullptr) dynamics_.SqrtQ(dt_s, n, {out.sqrt_q, n});
    return Status::kOk;
  }
  /// Replaces x by y = mu (+) a (x (-) mu), and returns dy/dx.
  Square Decay(const Geometry& geometry, double a, double* x) const {
    const int n = geometry.tangent;
    const double* const mu = dynamics_.mean.data();
    std::array<double, detail::kMaxTangent> d;
    Square dx_dd(n, n), dy_dd(n, n);
    geometry.Minus(x, mu, d.data());
    PlusJacobian(geometry, mu, d.data(), dx_dd.data());
    for (double& element : d) element *= a;
    PlusJacobian(geometry, mu, d.data(), dy_dd.data());
    geometry.Plus(mu, d.data(), x);
    return a * dy_dd * dx_dd.inverse();
  }

  Dynamics dynamics_;
};

}  // namespace

SharedMotion OwnedMotion(const Geometry& geometry, const OwnedRole& owned) {
  ALIDADE_EXPECTS(!geometry.is_product());
  if (!geometry.is_vector()) return std::make_shared<OwnedGeometryMotion>(geometry, owned);
  return MakeMotion(OwnedVectorMotion(owned, geometry.ambient), NameOf(owned.dynamics));
}

}  // namespace alidade::internal
