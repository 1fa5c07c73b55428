// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/motions.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/all_finite.h"

namespace alidade::internal {
namespace {

/// gl = G L, n x w, and the lower triangle of q = G L L' G', n x n, for G n x w and L w x w. W: w,
/// if the compiler is to know it.
template <int W>
void SpreadNoise(const double* g, const double* l, int n, int w, double* gl, double* q) {
  if (W > 0) w = W;
  for (int i = 0; i < n; ++i, g += w, q += n) {
    double* const own = gl + i * w;
    for (int c = 0; c < w; ++c) {
      double sum = 0.0;
      for (int k = 0; k < w; ++k) sum += g[k] * l[k * w + c];
      own[c] = sum;
    }
    const double* other = gl;
    for (int j = 0; j <= i; ++j, other += w) {
      double sum = 0.0;
      for (int c = 0; c < w; ++c) sum += own[c] * other[c];
      q[j] = sum;
    }
  }
}

}  // namespace

Outcome StepAt(const MotionBinding& motion, const MotionPlace& place, const double* x,
               const double* u, const double* w, double dt_s, const StepOutput& to) {
  const MotionModel& model = *motion.model;
  const std::size_t n = place.at.size(), blocks = place.values.size();
  const auto n_w = static_cast<std::size_t>(model.noise_size());
  const std::span<double> f(to.f, to.f == nullptr ? 0 : n * n),
      g(to.g, to.g == nullptr ? 0 : n * n_w), l(to.l, to.l == nullptr ? 0 : n_w * n_w);
  std::array<const double*, kMaxRoles> from;
  std::array<double*, kMaxRoles> next;
  for (std::size_t k = 0; k < blocks; ++k) {
    from[k] = x + place.values[k];
    next[k] = to.next + place.values[k];
  }
  double* const* const x_next = to.next == nullptr ? nullptr : next.data();
  const Status status = model.Step(from.data(), u, w, dt_s, {x_next, to.f, to.g, to.l});
  if (status != Status::kOk) return OutcomeOf(status);
  double defect = ZeroIfFinite(f) + ZeroIfFinite(g) + ZeroIfFinite(l);
  for (std::size_t k = 0; k < blocks && to.next != nullptr; ++k) {
    defect += ZeroIfFinite({next[k], static_cast<std::size_t>(place.sizes[k])});
  }
  return defect == 0.0 ? Outcome::kAccepted : Outcome::kNotFinite;
}

Trouble TroubleOf(const MotionBinding& motion, Outcome outcome) {
  if (outcome == Outcome::kAccepted) return {};
  const std::string who = "motion model of '" + motion.name + "' ";
  if (outcome == Outcome::kNotFinite) {
    return {"not_finite", who + "steps to a state that is not finite"};
  }
  const bool failed = outcome == Outcome::kFailed;
  return {failed ? "plugin_failed" : "diverged",
          who + "cannot step: " + (failed ? motion.model->error_text() : "out of its domain")};
}

void TakeStep(const MotionBinding& motion, const MotionPlace& place, const double* next,
              double* x) {
  for (std::size_t k = 0, count = place.values.size(); k < count; ++k) {
    if (place.constant[k] != 0) continue;
    const int at = place.values[k];
    for (int i = at; i < at + place.sizes[k]; ++i) x[i] = next[i];
    const Geometry& geometry = motion.model->blocks()[k].geometry;
    if (geometry.kind != GeometryKind::kVector) geometry.Normalise(x + at);
  }
}

Motions::Motions(const Binding& binding)
    : binding_(&binding),
      steps_(binding.system.motions.size()),
      next_(binding.initial.values().size()) {
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    const MotionModel& model = *binding.system.motions[i].model;
    const auto n = static_cast<std::size_t>(model.tangent_size());
    const auto n_w = static_cast<std::size_t>(model.noise_size());
    Step& step = steps_[i];
    step.f.resize(n * n);
    step.g.resize(n * n_w);
    step.l.resize(n_w * n_w);
    step.gl.resize(n * n_w);
    step.q.resize(n * n);
    if (binding.motion_places[i].holds) step.m.resize(n * n_w);
  }
}

void Motions::Activate(const StateLayout& layout) {
  holds_ = false;
  active_ = 0;
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    const MotionBinding& motion = binding_->system.motions[i];
    steps_[i].active =
        !motion.model->stationary() &&
        std::ranges::all_of(motion.blocks, [&](BlockId id) { return layout[id].present; });
    active_ += steps_[i].active ? 1 : 0;
    holds_ = holds_ || (steps_[i].active && binding_->motion_places[i].holds);
  }
}

Trouble Motions::Evaluate(const State& state, double dt_s, bool derivatives) {
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    if (!steps_[i].active) continue;
    if (Trouble trouble = EvaluateOne(i, state, dt_s, derivatives)) return trouble;
  }
  return {};
}

Trouble Motions::EvaluateOne(std::size_t i, const State& state, double dt_s, bool derivatives) {
  const MotionBinding& motion = binding_->system.motions[i];
  const MotionPlace& place = binding_->motion_places[i];
  Step& step = steps_[i];
  const bool goes_on = place.holds && in_interval();
  StepOutput to{next_.data()};
  if (derivatives) {
    to.f = step.f.data();
    to.g = step.g.data();
  }
  if (!goes_on) to.l = step.l.data();
  const Outcome outcome =
      StepAt(motion, place, state.values().data(), step.u.data(), nullptr, dt_s, to);
  if (outcome != Outcome::kAccepted || !derivatives) return TroubleOf(motion, outcome);
  const int w = motion.model->noise_size();
  (w == 1 ? SpreadNoise<1> : SpreadNoise<0>)(step.g.data(), step.l.data(),
                                             motion.model->tangent_size(), w, step.gl.data(),
                                             step.q.data());
  if (goes_on) {
    CarryHeld(*motion.model, place, step);
  } else if (place.holds) {
    step.m = step.gl;
  }
  return TroubleOf(motion, AllFinite(step.q) ? Outcome::kAccepted : Outcome::kNotFinite);
}

/// With A = F M and N = G Lq: q <- N N' + A N' + N A' (its lower triangle), M <- A + N. Blocks
/// without a covariance have no M.
void Motions::CarryHeld(const MotionModel& model, const MotionPlace& place, Step& step) {
  const Workspace::Use use(memory_);
  const Eigen::Index n = model.tangent_size(), w = model.noise_size();
  const Eigen::Map<const RowMajor> f(step.f.data(), n, n), input(step.gl.data(), n, w);
  Eigen::Map<RowMajor> m(step.m.data(), n, w), q(step.q.data(), n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (place.at[static_cast<std::size_t>(i)] < 0) m.row(i).setZero();
  }
  Workspace::Matrix moved = memory_.Take(n, w), both = memory_.Take(n, n);
  moved.noalias() = f * m;
  both.noalias() = moved * input.transpose();
  q.triangularView<Eigen::Lower>() += both;
  q.triangularView<Eigen::Lower>() += both.transpose();
  m = moved + input;
}

bool Motions::Apply(State& state) {
  Covariance& p = state.covariance();
  if (active_ <= 1) {  // all of it, or nothing
    if (!Propagate(p)) return false;
  } else if (IsBounded(p)) {
    Propagate(p);
  } else {
    const Covariance before = p;
    if (!Propagate(p)) {
      p = before;
      return false;
    }
  }
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    if (!steps_[i].active) continue;
    TakeStep(binding_->system.motions[i], binding_->motion_places[i], next_.data(),
             state.values().data());
  }
  return true;
}

/// Whether no F P F' + Q of this step can overflow, by |F P F'|_ij <= (n max|F|)^2 max|P|.
bool Motions::IsBounded(const Covariance& covariance) const {
  constexpr double kSafe = 1e300;
  double f = 1.0, q = 0.0, p = 0.0;
  for (const Step& step : steps_) {
    if (!step.active) continue;
    for (const double value : step.f) f = std::max(f, std::abs(value));
    for (const double value : step.q) q = std::max(q, std::abs(value));
  }
  const int n = covariance.size();
  for (int i = 0; i < n; ++i) p = std::max(p, covariance.Variance(i));
  const double sum = f * n;
  return sum * sum * p + q <= kSafe;
}

bool Motions::Propagate(Covariance& p) {
  const Workspace::Use use(memory_);
  bool finite = true;
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    const Step& step = steps_[i];
    const MotionPlace& place = binding_->motion_places[i];
    if (!step.active || place.rows.empty()) continue;
    const std::size_t n = place.at.size();
    const Eigen::Index k = std::ssize(place.rows);
    if (place.rows.size() == n) {
      finite = p.Propagate(place.rows, step.f.data(), step.q.data()) && finite;
      continue;
    }
    Workspace::Vector f = memory_.Take(k * k), q = memory_.Take(k * k);
    Eigen::Index at = 0;
    for (std::size_t element = 0; element < n * n; ++element) {
      if (place.at[element / n] < 0 || place.at[element % n] < 0) continue;
      f[at] = step.f[element];
      q[at++] = step.q[element];
    }
    finite = p.Propagate(place.rows, f.data(), q.data()) && finite;
  }
  return finite;
}

int Motions::noise_size() const {
  int size = 0;
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    if (steps_[i].active) size += binding_->system.motions[i].model->noise_size();
  }
  return size;
}

Workspace::Matrix Motions::Transition(int n, Workspace& work) const {
  Workspace::Matrix transition = work.Take(n, n);
  transition.setIdentity();
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    if (!steps_[i].active) continue;
    const double* f = steps_[i].f.data();
    for (const int row : binding_->motion_places[i].at) {
      for (const int column : binding_->motion_places[i].at) {
        if (row >= 0 && column >= 0) transition(row, column) = *f;
        ++f;
      }
    }
  }
  return transition;
}

Workspace::Matrix Motions::Held(std::vector<double> Step::*matrix, int n, Workspace& work,
                                bool all) const {
  Workspace::Matrix input = work.Take(n, noise_size());
  input.setZero();
  Eigen::Index columns = 0;
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    const Step& step = steps_[i];
    const MotionPlace& place = binding_->motion_places[i];
    if (!step.active) continue;
    const MotionModel& model = *binding_->system.motions[i].model;
    const Eigen::Index width = model.noise_size();
    for (std::size_t row = 0; row < place.at.size() && (place.holds || all); ++row) {
      if (place.at[row] < 0) continue;
      const Eigen::Map<const RowMajor> from((step.*matrix).data(), model.tangent_size(), width);
      input.row(place.at[row]).segment(columns, width) = from.row(static_cast<Eigen::Index>(row));
    }
    columns += width;
  }
  return input;
}

}  // namespace alidade::internal
