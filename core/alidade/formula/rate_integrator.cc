// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/rate_integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "alidade/formula/formula_keys.h"

namespace alidade::internal {
namespace {

constexpr int kStages = 4;
constexpr int kMaxSize = CompiledFunction::kMaxElements;
/// Times of the stages as fractions of the step, and their weights.
constexpr std::array<double, kStages> kTimes = {0.0, 0.5, 0.5, 1.0};
constexpr std::array<double, kStages> kWeights = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};

/// Returns sqrt(2 k + 1) P_k at a fraction of the step. P_2 has the factor 2/5.
double Legendre(int k, double fraction) {
  const double x = 2.0 * fraction - 1.0;
  if (k == 0) return 1.0;
  if (k == 1) return std::sqrt(3.0) * x;
  return std::sqrt(5.0) * (1.5 * x * x - 0.5) * 0.4;
}

/// Divides the unit quaternions in y, and their rows of the Jacobian, by their length. Blocks of
/// other geometries are vectors, angles, or constant.
void NormaliseRows(const std::vector<Geometry>& blocks, double* y, double* jacobian, int columns) {
  int row = 0;
  for (const Geometry& block : blocks) {
    if (block == Geometry::UnitQuaternion()) {
      double squared = 0.0;
      for (int i = 0; i < block.ambient; ++i) squared += y[row + i] * y[row + i];
      const double inverse = 1.0 / std::sqrt(squared);
      for (int i = row * columns; jacobian != nullptr && i < (row + block.ambient) * columns; ++i)
        jacobian[i] *= inverse;
    }
    block.Normalise(y + row);
    row += block.ambient;
  }
}

}  // namespace

RateIntegrator::RateIntegrator(CompiledFunction rate, const std::vector<Space>& blocks,
                               bool has_input, bool is_discrete)
    : rate_(std::move(rate)), blocks_(GeometriesOf(blocks)) {
  for (const Geometry& block : blocks_) {
    states_ += block.ambient;
    tangent_ += block.tangent;
  }
  const std::size_t noise = blocks.size() + (has_input ? 1 : 0);
  inputs_ = rate_.offset(noise) - states_;
  noises_ = rate_.inputs()[noise].ambient;
  if (!is_discrete) terms_ = CountTerms();
  differentiated_ = blocks_;
  if (noises_ > 0) differentiated_.push_back(Geometry::Vector(noises_ * terms_));
}

int RateIntegrator::CountTerms() const {
  const auto n = static_cast<std::size_t>(states_);
  std::vector<int> integrators(n, 0);  // between a noise and each element
  const int first_noise = states_ + inputs_;
  for (int round = 0; round < kMaxTerms; ++round) {
    for (std::size_t i = 0; i < n; ++i) {
      int count = 0;
      for (const int node : rate_.sweeps()[i]) {
        const bool is_noise = node >= first_noise && node < first_noise + noises_;
        if (is_noise) count = std::max(count, 1);
        if (node >= states_) continue;
        const int before = integrators[static_cast<std::size_t>(node)];
        if (before > 0) count = std::max(count, before + 1);
      }
      integrators[i] = std::min(count, kMaxTerms);
    }
  }
  return std::max(1, *std::ranges::max_element(integrators));
}

void RateIntegrator::AdvanceSlope(const double* partial,
                                  const std::array<double, kMaxTerms>& legendre, double shift_s,
                                  const double* slope, double* moved) const {
  const int n = states_, columns = n + noises_ * terms_;
  for (int i = 0; i < n; ++i) {
    double* const row = moved + i * columns;
    const double* const a = partial + i * rate_.program().variables();
    std::copy_n(a, n, row);
    for (int j = 0; j < noises_; ++j) {
      for (int k = 0; k < terms_; ++k)
        row[n + j * terms_ + k] = a[n + inputs_ + j] * legendre[static_cast<std::size_t>(k)];
    }
    for (int j = 0; j < n && shift_s != 0.0; ++j) {
      const double factor = shift_s * a[j];
      if (factor == 0.0) continue;
      for (int c = 0; c < columns; ++c) row[c] += factor * slope[j * columns + c];
    }
  }
}

Status RateIntegrator::Step(const double* const* blocks, const double* input, const double* w,
                            double dt_s, double* next, double* f, double* g) const {
  const int n = states_, first_noise = n + inputs_;
  const int columns = n + noises_ * terms_;
  const bool has_jacobians = f != nullptr || g != nullptr;
  double x[kMaxSize], start[kMaxSize], rate[kMaxSize] = {}, sum[kMaxSize];
  double partial[kMaxSize * kMaxSize];  // of the rate, n x variables
  double slope[kMaxSize * kMaxSize];    // of the rate of the last stage, n x columns
  double moved[kMaxSize * kMaxSize];    // slope of this stage, n x columns
  double total[kMaxSize * kMaxSize];    // of the result, n x columns
  double* position = start;
  for (std::size_t k = 0; k < blocks_.size(); ++k)
    position = std::copy_n(blocks[k], blocks_[k].ambient, position);
  if (inputs_ > 0) std::copy_n(input, inputs_, x + n);
  std::copy_n(start, n, sum);
  if (has_jacobians) {
    std::fill_n(total, n * columns, 0.0);
    for (int i = 0; i < n; ++i) total[i * columns + i] = 1.0;
  }
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    const double shift = kTimes[stage] * dt_s;
    for (int i = 0; i < n; ++i) x[i] = start[i] + (stage == 0 ? 0.0 : shift * rate[i]);
    std::array<double, kMaxTerms> legendre{};
    for (int k = 0; k < terms_; ++k)
      legendre[static_cast<std::size_t>(k)] = Legendre(k, kTimes[stage]);
    for (int i = 0; i < noises_; ++i) {
      x[first_noise + i] = 0.0;
      for (int k = 0; k < terms_; ++k)
        x[first_noise + i] += w[i * terms_ + k] * legendre[static_cast<std::size_t>(k)];
    }
    if (!rate_.EvaluateAmbient(x, rate, has_jacobians ? partial : nullptr))
      return Status::kOutOfDomain;
    for (int i = 0; i < n; ++i) sum[i] += kWeights[stage] * dt_s * rate[i];
    if (!has_jacobians) continue;
    AdvanceSlope(partial, legendre, stage == 0 ? 0.0 : shift, slope, moved);
    for (int i = 0; i < n * columns; ++i) total[i] += kWeights[stage] * dt_s * moved[i];
    std::copy_n(moved, n * columns, slope);
  }
  if (!std::all_of(sum, sum + n, [](double value) { return std::isfinite(value); }))
    return Status::kOutOfDomain;
  NormaliseRows(blocks_, sum, has_jacobians ? total : nullptr, columns);
  std::copy_n(sum, n, next);
  if (!has_jacobians) return Status::kOk;
  std::array<double*, kMaxSize> jacobians{};
  std::array<int, kMaxSize> strides{};
  int column = 0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    if (f != nullptr) jacobians[k] = f + column;
    strides[k] = tangent_;
    column += blocks_[k].tangent;
  }
  jacobians[blocks_.size()] = g;
  strides[blocks_.size()] = noises_ * terms_;
  ToTangent(blocks_, sum, differentiated_, blocks, total, jacobians.data(), strides.data());
  return Status::kOk;
}

}  // namespace alidade::internal
