// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <exception>
#include <memory>
#include <utility>
#include <vector>

#include "alidade/model/autodiff_inverse.h"
#include "alidade/model/plugin_abi.h"

/// Functions that implement the functions of plugin_abi.h with a model. They are noexcept and
/// convert an exception to ALIDADE_ERROR.
namespace alidade {
namespace detail {

inline AlidadeSpace Describe(const Quantity& q, std::uint32_t geometry, int ambient, int tangent) {
  AlidadeSpace space{};
  space.struct_size = sizeof(AlidadeSpace);
  space.geometry = geometry;
  space.ambient = ambient;
  space.tangent = tangent;
  space.flags = q.flags;
  space.name = q.name;
  space.unit = q.unit;
  space.elements = q.elements;
  space.doc = q.doc;
  return space;
}

/// Prior and dynamics of a role, converted to the struct of the ABI.
struct AbiPrior {
  explicit AbiPrior(Owned role_prior) : prior(std::move(role_prior)) {
    c.struct_size = sizeof(c);
    c.dynamics = prior.dynamics;
    c.mean = prior.mean.empty() ? nullptr : prior.mean.data();
    c.sqrt_prior = Diagonal(prior.sigma, sqrt_prior);
    c.sqrt_density = Diagonal(prior.density, sqrt_density);
    c.time_constant_s = prior.time_constant_s;
  }
  AbiPrior(const AbiPrior&) = delete;
  AbiPrior& operator=(const AbiPrior&) = delete;

  static const double* Diagonal(const std::vector<double>& diagonal, std::vector<double>& matrix) {
    const std::size_t n = diagonal.size();
    matrix.assign(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) matrix[i * n + i] = diagonal[i];
    return n > 0 ? matrix.data() : nullptr;
  }

  Owned prior;
  std::vector<double> sqrt_prior, sqrt_density;
  AlidadeOwned c{};
};

/// Model with its description. AlidadeInstance::self points to the Holder.
template <class Model>
struct Holder {
  explicit Holder(Params& p) : Holder(Model(p)) {}
  explicit Holder(Model m) : model(std::move(m)) { description.struct_size = sizeof(description); }
  Holder(const Holder&) = delete;
  Holder& operator=(const Holder&) = delete;

  template <class Quantities>
  void DescribeRoles(const Quantities& quantities) {
    static_assert(std::tuple_size<Quantities>::value == Blocks<Model>::kCount,
                  "kRoles or kBlocks needs one Quantity for each role or block");
    const auto describe = [&](auto index) {
      constexpr int i = decltype(index)::value;
      using G = SpaceAt<i, Model>;
      if constexpr (HasSize<Model>::value) {
        roles[i] = Describe(quantities[i], G::kGeometry, model.Size(i), model.Size(i));
      } else {
        roles[i] = Describe(quantities[i], G::kGeometry, G::kAmbient, G::kTangent);
      }
    };
    ForEach(describe, typename Blocks<Model>::Indices{});
    description.role_count = Blocks<Model>::kCount;
    description.role_stride = sizeof(AlidadeSpace);
    description.roles = roles;
  }

  void DescribeMeasurement() {
    using Z = typename Model::Measurement;
    constexpr Quantity measurement = Model::kMeasurement;
    space = Describe(measurement, Z::kGeometry, Z::kAmbient, Z::kTangent);
    if constexpr (Z::kGeometry == ALIDADE_PRODUCT) {
      constexpr auto quantities = Model::kParts;
      static_assert(quantities.size() == Z::kParts, "kParts needs one Quantity for each part");
      parts.reserve(Z::kParts);
      Z::ForEachPart([&](auto part, int, int) {
        using G = decltype(part);
        parts.push_back(Describe(quantities[parts.size()], G::kGeometry, G::kAmbient, G::kTangent));
      });
      space.parts = parts.data();
      space.part_count = Z::kParts;
      space.part_stride = sizeof(AlidadeSpace);
    }
    description.output = &space;
  }

  /// Describes the prior and dynamics of each role that is a model parameter state of the sensor.
  void DescribeOwned() {
    if constexpr (HasOwnedRole<Model>::value) {
      for (int i = 0; i < Blocks<Model>::kCount; ++i) {
        if ((roles[i].flags & ALIDADE_ROLE_OWNED) == 0) continue;
        Owned prior = model.OwnedRole(i);
        const auto has_valid_size = [](const std::vector<double>& values, int size) {
          return values.empty() || values.size() == static_cast<std::size_t>(size);
        };
        if (!has_valid_size(prior.mean, roles[i].ambient) ||
            !has_valid_size(prior.sigma, roles[i].tangent) ||
            !has_valid_size(prior.density, roles[i].tangent)) {
          prior = Owned{ALIDADE_STAYS, {std::nan("")}, {}, {}, 0.0};  // the host rejects this mean
          prior.mean.resize(static_cast<std::size_t>(roles[i].ambient));
        }
        priors[i] = std::make_unique<AbiPrior>(std::move(prior));
        roles[i].owned = &priors[i]->c;
      }
    }
  }
  /// Describes the known numbers of each measurement.
  void DescribeKnown() {
    using Known = typename Model::Known;
    static_assert(Known::kGeometry == ALIDADE_VECTOR, "known numbers must be a vector");
    if constexpr (kHasKnown<Model>) {
      constexpr Quantity quantity = Model::kKnown;
      known = Describe(quantity, Known::kGeometry, Known::kAmbient, Known::kTangent);
      description.known = &known;
    }
  }

  Model model;
  AlidadeDescription description{};
  AlidadeSpace roles[Blocks<Model>::kCount];
  AlidadeSpace space;               ///< the measurement, or the control input
  AlidadeSpace known;               ///< known numbers of a sensor
  std::vector<AlidadeSpace> parts;  ///< parts of the measurement
  std::unique_ptr<AbiPrior> priors[Blocks<Model>::kCount];
};

/// Text of the last ALIDADE_ERROR in this thread. The symbol is hidden, so that each plugin has its
/// own text.
struct __attribute__((visibility("hidden"))) LastError {
  static char* Text() {
    static thread_local char text[256] = "";
    return text;
  }
  static void Set(const char* text) { std::snprintf(Text(), 256, "%s", text); }
};

/// Calls f with the model that `self` points to. Converts an exception to ALIDADE_ERROR and stores
/// its text in LastError.
template <class Model, class F>
std::int32_t CallGuarded(const void* self, const F& f) noexcept {
  const auto* holder = static_cast<const Holder<Model>*>(self);
#if defined(__cpp_exceptions)
  try {
    return f(holder->model);
  } catch (const std::exception& e) {
    LastError::Set(e.what());
  } catch (...) {
    LastError::Set("an exception of unknown type");
  }
  return ALIDADE_ERROR;
#else
  return f(holder->model);
#endif
}

/// Returns the known numbers of a measurement. If the model does not use known numbers, returns
/// null without reading `observation`.
template <class Model>
const double* KnownOf(const AlidadeObservation* observation) {
  return kHasKnown<Model> ? observation->known : nullptr;
}

/// ABI functions of a sensor. The symbols of SensorCalls and MotionCalls are hidden. If kCalls were
/// exported, two plugins with a struct of the same name would both use the kCalls of the first
/// plugin (STB_GNU_UNIQUE). The flags of dlopen cannot prevent this.
template <class Model>
struct __attribute__((visibility("hidden"))) SensorCalls {
  static constexpr bool kInitialises = Model::kInitialises >= 0;

  ALIDADE_FLATTEN ALIDADE_SCALAR_LOOPS static std::int32_t Eval(
      const void* self, const AlidadeObservation* observation, const double* const* roles,
      double* z, double* const* jacobians, const std::int32_t* strides) noexcept {
    return CallGuarded<Model>(self, [&](const Model& model) {
      return static_cast<std::int32_t>(
          Evaluate(model, roles, z, jacobians, strides, KnownOf<Model>(observation)));
    });
  }
  ALIDADE_FLATTEN static std::int32_t SqrtNoise(const void* self,
                                                const AlidadeObservation* observation,
                                                const double* const* roles, double* l,
                                                std::int32_t stride) noexcept {
    return CallGuarded<Model>(self, [&](const Model& model) {
      constexpr int m = Model::Measurement::kTangent;
      double dense[m * m] = {};
      CallSqrtNoise(model, roles, KnownOf<Model>(observation), observation->z, dense,
                    typename Blocks<Model>::Indices{});
      for (int i = 0; i < m; ++i) std::copy_n(dense + i * m, m, l + i * stride);
      return std::int32_t{ALIDADE_OK};
    });
  }
  ALIDADE_FLATTEN static std::int32_t Valid(const void* self,
                                            const AlidadeObservation* observation) noexcept {
    return CallGuarded<Model>(self, [&](const Model& model) {
      if constexpr (HasValid<Model>::value) {
        const bool valid = CallValid(model, KnownOf<Model>(observation), observation->z);
        return std::int32_t{valid ? ALIDADE_OK : ALIDADE_INVALID};
      } else {
        static_cast<void>(model);
        return std::int32_t{ALIDADE_OK};
      }
    });
  }
  static std::int32_t Initialise(const void* self, const AlidadeObservation* observation,
                                 const double* const* roles, const double* prior, double* y,
                                 double* const* jx, const std::int32_t* jx_strides, double* jz,
                                 std::int32_t jz_stride, double* jp,
                                 std::int32_t jp_stride) noexcept {
    return CallGuarded<Model>(self, [&](const Model& model) {
      if constexpr (kInitialises) {
        return static_cast<std::int32_t>(
            InitialiseRole(model, roles, observation->z, prior, y, jx, jx_strides, {jz, jz_stride},
                           {jp, jp_stride}, KnownOf<Model>(observation)));
      } else {
        return std::int32_t{ALIDADE_ERROR};
      }
    });
  }
  static constexpr AlidadeSensor kCalls{sizeof(AlidadeSensor),
                                        0,
                                        Eval,
                                        SqrtNoise,
                                        HasValid<Model>::value ? Valid : nullptr,
                                        kInitialises ? Initialise : nullptr,
                                        nullptr,
                                        {}};
};

/// ABI functions of a motion model.
template <class Model>
struct __attribute__((visibility("hidden"))) MotionCalls {
  ALIDADE_FLATTEN static std::int32_t Step(const void* self, const double* const* blocks,
                                           const double* const* inputs, const double* w,
                                           double dt_s, double* const* next, double* f,
                                           std::int32_t f_stride, double* g, std::int32_t g_stride,
                                           double* b, std::int32_t b_stride) noexcept {
    return CallGuarded<Model>(self, [&](const Model& model) {
      const double* u = nullptr;
      if constexpr (Model::Input::kAmbient > 0) {
        u = inputs[0];
        if (b != nullptr) {
          return StepWithInput(model, blocks, u, w, dt_s, next, {f, f_stride}, {g, g_stride},
                               {b, b_stride});
        }
      }
      return static_cast<std::int32_t>(
          alidade::Step(model, blocks, u, w, dt_s, next, {f, f_stride}, {g, g_stride}));
    });
  }
  ALIDADE_FLATTEN static std::int32_t SqrtQ(const void* self, const double* const* blocks,
                                            const double* const*, double dt_s, double* l,
                                            std::int32_t stride) noexcept {
    return CallGuarded<Model>(self, [&](const Model& model) {
      constexpr typename Blocks<Model>::Indices indices{};
      if constexpr (Model::kNoise != kDynamic) {
        constexpr int n = Model::kNoise;
        double buffer[n * n + 1] = {};
        CallSqrtQ(model, blocks, dt_s, {buffer, n}, indices);
        Copy({buffer, n}, NoiseSizeOf(model), NoiseSizeOf(model), {l, stride});
      } else {
        const int n = NoiseSizeOf(model);
        Zero({l, stride}, n, n);
        CallSqrtQ(model, blocks, dt_s, {l, stride}, indices);
      }
      return std::int32_t{ALIDADE_OK};
    });
  }
  static constexpr AlidadeMotion kCalls{sizeof(AlidadeMotion), 0, Step, SqrtQ, {}};

 private:
  [[gnu::noinline]] static std::int32_t StepWithInput(const Model& model,
                                                      const double* const* blocks, const double* u,
                                                      const double* w, double dt_s,
                                                      double* const* next, MatrixRef f, MatrixRef g,
                                                      MatrixRef b) {
    return static_cast<std::int32_t>(alidade::Step(model, blocks, u, w, dt_s, next, f, g, b));
  }
};

}  // namespace detail
}  // namespace alidade
