// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/compression.h"

#include <algorithm>

#include "alidade/base/error.h"

namespace alidade::internal {
namespace {

/// Where many small steps are the same as one.
bool IsFlat(const Geometry& geometry) {
  bool flat = true;
  geometry.ForEachPart([&](const Geometry& part, int, int) {
    flat = flat && (part.kind == GeometryKind::kVector || part.kind == GeometryKind::kAngle);
  });
  return flat;
}

double Squared(double x) { return x * x; }

/// N.
double SizeOf(const State& state) {
  const Postponed* const postponed = state.postponed();
  return postponed == nullptr ? state.covariance().size() : postponed->p.size();
}

/// C.
double CatchUpCost(const State& state) {
  const Postponed* const postponed = state.postponed();
  if (postponed == nullptr) return 0.0;
  const double whole = SizeOf(state), k = postponed->basis();
  return whole * k * (whole + 2.0 * k);
}

}  // namespace

std::string WhyNotCompressed(const System& system) {
  if (!system.landmarks) return {};
  if (system.landmarks->negative_depth == LandmarkOptions::NegativeDepth::kDelete) {
    return "`negative_depth: delete` asks for the depth of every landmark in each frame";
  }
  for (const SensorBinding& sensor : system.sensors) {
    for (const Space& role : sensor.model->roles()) {
      if (!role.landmark() || IsFlat(role.geometry)) continue;
      const auto representation = RepresentationOf(sensor.model->roles());
      const std::string why = "the role '" + role.name + "', of geometry " +
                              ToString(role.geometry) +
                              ", where many small corrections are not one";
      if (!representation) return "sensor '" + sensor.name + "' has " + why;
      return std::string("those of `landmarks.representation: ") + ToString(*representation) +
             "` have " + why + "; those of `inverse_depth` can";
    }
  }
  return {};
}

Compression::Compression(const System& system, const EkfOptions& options)
    : form_(options.covariance) {
  if (form_ == CovarianceForm::kFull) return;
  const std::string why = WhyNotCompressed(system);
  ALIDADE_EXPECTS(form_ == CovarianceForm::kAuto || why.empty());
  if (!why.empty()) form_ = CovarianceForm::kFull;
}

void Compression::Apply(FilterState& f, const LandmarkMap& landmarks, std::span<const Row> rows) {
  constexpr double kBegin = 4.0, kEnd = 3.0;  // N over what is needed, of `auto`
  constexpr int kPause = 100;
  if (form_ == CovarianceForm::kFull) return;
  const bool chooses = form_ == CovarianceForm::kAuto;
  const double whole = SizeOf(f.state);
  Count(f, rows);
  if (frame_.rows == 0.0) return;
  if (f.state.postponed() == nullptr) {
    if (pause_ > 0) {
      --pause_;
    } else if (!chooses || whole >= kBegin * frame_.needed) {
      Begin(f, landmarks);
    }
    return;
  }
  const bool shrinks = chooses && whole < kEnd * f.state.postponed()->basis();
  if (!IsDue(f.state) && !shrinks) return;
  const double cost = since_.cost + CatchUpCost(f.state);
  if (chooses && (whole < kEnd * frame_.needed || cost > since_.rows * Squared(whole))) {
    f.state.Recall();
    pause_ = kPause;
    return;
  }
  Begin(f, landmarks);
}

/// The rows of the frame, and those of P that they need.
void Compression::Count(const FilterState& f, std::span<const Row> rows) {
  frame_ = {0.0, static_cast<double>(f.binding->initial.covariance().size())};
  for (const Row& row : rows) {
    if (row.report->outcome == Outcome::kAccepted) frame_.rows += row.report->dof;
    if (!row.on_landmark()) continue;
    const auto own = f.binding->sensor_places[static_cast<std::size_t>(row.sensor)].parts.size();
    for (const JacobianPart& part : std::span(row.place->parts).subspan(own)) {
      frame_.needed += part.size;
    }
  }
}

/// Whether it pays to catch up now; counts the frame.
bool Compression::IsDue(const State& state) {
  const double n = state.covariance().size(), k = state.postponed()->basis();
  since_.frames += 1.0;
  since_.rows += frame_.rows;
  since_.needed += frame_.needed;
  since_.cost += frame_.rows * Squared(n + k);
  const double m = since_.rows / since_.frames, needed = since_.needed / since_.frames;
  const double excess = std::max(0.0, m * (Squared(n + k) - Squared(2.0 * needed)));
  since_.excess += excess;
  const double grown = 2.0 * SizeOf(state) * Squared(k - since_.basis);
  return since_.excess >= CatchUpCost(state) ||
         since_.frames * excess - since_.excess + grown >= since_.catch_up;
}

void Compression::Begin(FilterState& f, const LandmarkMap& landmarks) {
  landmarks.FindUnseen(f, leaving_);
  if (leaving_.empty() && f.state.postponed() == nullptr) return;
  f.state.Postpone(leaving_);
  since_ = {};
  since_.basis = f.state.postponed()->basis();
  since_.catch_up = CatchUpCost(f.state);
}

}  // namespace alidade::internal
