// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/models.h"

#include <cmath>
#include <new>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"

namespace alidade {
namespace {

struct ModelError {
  const void* model;
  std::string text;
};

/// Latest error text of each model in this thread.
thread_local std::vector<ModelError> model_errors;

std::string ErrorTextOf(const void* model) {
  const auto found = std::ranges::find(model_errors, model, &ModelError::model);
  return found == model_errors.end() ? "" : found->text;
}

}  // namespace

std::string internal::CheckOwned(const Geometry& geometry, OwnedRole& owned) {
  const std::ptrdiff_t n = geometry.tangent;
  const auto has_size = [](const std::vector<double>& values, std::ptrdiff_t size) {
    return values.empty() || std::ssize(values) == size;
  };
  if (!has_size(owned.mean, geometry.ambient) || !has_size(owned.sqrt_prior, n * n) ||
      !has_size(owned.sqrt_density, n * n)) {
    return "do not have the size of the role; expected one element for each element of the role";
  }
  if (owned.mean.empty()) owned.mean = geometry.Identity();
  if (!AllFinite(owned.mean) || !AllFinite(owned.sqrt_prior) || !AllFinite(owned.sqrt_density) ||
      !std::isfinite(owned.time_constant_s)) {
    return "are not finite; expected finite numbers";
  }
  if (DistanceFrom(geometry, owned.mean.data()) > kUnitTolerance) {
    return "have a mean whose length is not 1; expected a mean of unit length";
  }
  geometry.Normalise(owned.mean.data());
  if (owned.dynamics != OwnedDynamics::kGaussMarkov) owned.time_constant_s = 0.0;
  if (owned.dynamics == OwnedDynamics::kGaussMarkov && !(owned.time_constant_s > 0.0)) {
    return "have a time constant of 0 s or less; expected a time constant > 0 s";
  }
  return {};
}

Status internal::RecordModelError(const void* model, const std::string& text) noexcept {
  constexpr std::size_t kMaxErrors = 64;
  try {
    std::erase_if(model_errors, [&](const ModelError& error) { return error.model == model; });
    if (model_errors.size() == kMaxErrors) model_errors.erase(model_errors.begin());
    model_errors.push_back({model, text});
  } catch (const std::bad_alloc&) {  // the error text is then empty
  }
  return Status::kError;
}

SensorModel::SensorModel(Description description) : description_(std::move(description)) {
  if (!known().name.empty()) known_size_ = known().geometry.ambient;
  for (const Space& role : roles()) tangents_.push_back(role.geometry.tangent);
}

SensorModel::~SensorModel() = default;

bool SensorModel::has_landmark() const { return std::ranges::any_of(roles(), &Space::landmark); }

OwnedRole SensorModel::owned(std::size_t role) const {
  const auto found = description_.owned.find(role);
  if (found != description_.owned.end()) return found->second;
  OwnedRole neutral;
  neutral.mean = roles()[role].geometry.Identity();
  return neutral;
}

Status SensorModel::Initialise(const double* const* roles, const Observation& observation,
                               const double* prior, InverseOutput out) const {
  ALIDADE_EXPECTS(inverse().role >= 0);
  if (out.strides == nullptr) out.strides = tangents_.data();
  return DoInitialise(roles, observation, prior, out);
}

std::string SensorModel::error_text() const { return ErrorTextOf(this); }

MotionModel::MotionModel(Description description)
    : description_(std::move(description)),
      zero_noise_(static_cast<std::size_t>(description_.noise_size) + 1) {
  for (const Space& block : blocks()) tangent_size_ += block.geometry.tangent;
}

MotionModel::~MotionModel() = default;

std::string MotionModel::error_text() const { return ErrorTextOf(this); }

}  // namespace alidade
