// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/motions.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/all_finite.h"

namespace alidade::internal {
namespace {

/// Computes gl = G L. G is n x w, L is w x w.
void SpreadNoise(const double* g, const double* l, int n, int w, double* gl) {
  for (int i = 0; i < n; ++i, g += w, gl += w) {
    for (int c = 0; c < w; ++c) {
      double sum = 0.0;
      for (int k = 0; k < w; ++k) sum += g[k] * l[k * w + c];
      gl[c] = sum;
    }
  }
}

/// Computes the same as StepAt, but does not check whether F, G and L are finite.
[[gnu::always_inline]] inline Outcome CallStep(const MotionBinding& motion,
                                               const MotionPlace& place, const double* x,
                                               const double* u, const double* w, double dt_s,
                                               const StepOutput& output) {
  std::array<const double*, kMaxRoles> blocks;
  std::array<double*, kMaxRoles> next;
  for (std::size_t k = 0, count = place.values.size(); k < count; ++k) {
    blocks[k] = x + place.values[k];
    next[k] = output.next + place.values[k];
  }
  double* const* const x_next = output.next == nullptr ? nullptr : next.data();
  const Status status =
      motion.model->Step(blocks.data(), u, w, dt_s, {x_next, output.f, output.g, output.l});
  if (status != Status::kOk) return OutcomeOf(status);
  if (output.next == nullptr) return Outcome::kAccepted;
  double defect = 0.0;
  for (const auto& [offset, size, geometry] : place.block_ranges) {
    defect += ZeroIfFinite({output.next + offset, static_cast<std::size_t>(size)});
  }
  return defect == 0.0 ? Outcome::kAccepted : Outcome::kNotFinite;
}

}  // namespace

Outcome StepAt(const MotionBinding& motion, const MotionPlace& place, const double* x,
               const double* u, const double* w, double dt_s, const StepOutput& output) {
  const Outcome outcome = CallStep(motion, place, x, u, w, dt_s, output);
  if (outcome != Outcome::kAccepted) return outcome;
  const std::size_t n = place.at.size();
  const auto n_w = static_cast<std::size_t>(motion.model->noise_size());
  const auto is_finite = [](const double* numbers, std::size_t count) {
    return numbers == nullptr || AllFinite({numbers, count});
  };
  return is_finite(output.f, n * n) && is_finite(output.g, n * n_w) &&
                 is_finite(output.l, n_w * n_w)
             ? Outcome::kAccepted
             : Outcome::kNotFinite;
}

[[gnu::noinline]] StepError StepErrorOf(const MotionBinding& motion, Outcome outcome) {
  if (outcome == Outcome::kAccepted) return {};
  const std::string model = "the motion model of '" + motion.name + "' ";
  if (outcome == Outcome::kNotFinite) {
    return {EventKind::kNotFinite, model + "predicts a state that is not finite"};
  }
  const bool failed = outcome == Outcome::kFailed;
  return {
      failed ? EventKind::kPluginFailed : EventKind::kDiverged,
      model + "cannot predict the state: " +
          (failed ? motion.model->error_text() : "the state is outside the domain of the model")};
}

Motions::Motions(const ProblemIndex& index)
    : index_(&index),
      steps_(index.problem.motions.size()),
      next_(index.initial.values().size(), kNotANumber) {
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    const MotionModel& model = *index.problem.motions[i].model;
    const auto n = static_cast<std::size_t>(model.tangent_size());
    const auto n_w = static_cast<std::size_t>(model.noise_size());
    Step& step = steps_[i];
    step.f.resize(n * n, kNotANumber);  // NaN reveals elements that the model does not write
    step.g.resize(n * n_w, kNotANumber);
    step.l.resize(n_w * n_w, kNotANumber);
    step.gl.resize(n * n_w);
    if (index.motion_places[i].holds) step.cross.resize(n * n);
    if (index.motion_places[i].holds) step.m.resize(n * n_w);
  }
}

void Motions::Activate(const StateLayout& layout) {
  has_discrete_noise_ = false;
  active_.clear();
  for (std::size_t i = 0, count = steps_.size(); i < count; ++i) {
    const MotionBinding& motion = index_->problem.motions[i];
    steps_[i].active =
        !motion.model->stationary() &&
        std::ranges::all_of(motion.blocks, [&](BlockId id) { return layout[id].present; });
    if (steps_[i].active) active_.push_back(i);
    has_discrete_noise_ =
        has_discrete_noise_ || (steps_[i].active && index_->motion_places[i].holds);
  }
}

StepError Motions::Evaluate(const State& state, double dt_s, bool derivatives) {
  for (const std::size_t i : active_) {
    if (StepError error = EvaluateModel(i, state, dt_s, derivatives)) return error;
  }
  return {};
}

StepError Motions::EvaluateModel(std::size_t i, const State& state, double dt_s, bool derivatives) {
  const MotionBinding& motion = index_->problem.motions[i];
  const MotionPlace& place = index_->motion_places[i];
  Step& step = steps_[i];
  const bool continues_interval = place.holds && in_interval();
  StepOutput output{next_.data()};
  if (derivatives) {
    output.f = step.f.data();
    output.g = step.g.data();
  }
  if (!continues_interval) output.l = step.l.data();
  // Apply detects that F, G or L is not finite, because P is then not finite either.
  const double* const x = state.values().data();
  const Outcome outcome = derivatives
                              ? CallStep(motion, place, x, step.u.data(), nullptr, dt_s, output)
                              : StepAt(motion, place, x, step.u.data(), nullptr, dt_s, output);
  if (outcome != Outcome::kAccepted) return StepErrorOf(motion, outcome);
  if (!derivatives) return {};
  SpreadNoise(step.g.data(), step.l.data(), motion.model->tangent_size(),
              motion.model->noise_size(), step.gl.data());
  step.continues_interval = continues_interval;
  if (continues_interval) {
    PropagateDiscreteNoise(*motion.model, place, step);
  } else if (place.holds) {
    for (std::size_t k = 0; k < step.m.size(); ++k) step.m[k] = step.gl[k];
  }
  return {};
}

/// Computes C = A N' and M <- A + N, with A = F M and N = G Lq. The rows of M that belong to blocks
/// without a covariance are zero.
[[gnu::noinline]] void Motions::PropagateDiscreteNoise(const MotionModel& model,
                                                       const MotionPlace& place, Step& step) {
  const Workspace::Use use(memory_);
  const Eigen::Index n = model.tangent_size(), w = model.noise_size();
  const Eigen::Map<const RowMajor> f(step.f.data(), n, n), input(step.gl.data(), n, w);
  Eigen::Map<RowMajor> m(step.m.data(), n, w), cross(step.cross.data(), n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (place.at[static_cast<std::size_t>(i)] < 0) m.row(i).setZero();
  }
  Workspace::Matrix moved = memory_.Take(n, w);
  moved.noalias() = f * m;
  cross.noalias() = moved * input.transpose();
  m = moved + input;
}

StepError Motions::Apply(State& state) {
  Covariance& p = state.covariance();
  if (active_.size() <= 1) {  // if the propagation by the only model fails, P is unchanged
    if (!Propagate(p)) return FindNotFinite();
  } else if (IsBounded(p)) {
    Propagate(p);
  } else {
    const Covariance before = p;
    if (!Propagate(p)) {
      p = before;
      return FindNotFinite();
    }
  }
  Move(state);
  return {};
}

void Motions::Move(State& state) const {
  for (const std::size_t i : active_) {
    TakeStep(index_->motion_places[i], next_.data(), state.values().data());
  }
}

[[gnu::noinline]] StepError Motions::FindNotFinite() const {
  for (const std::size_t i : active_) {
    const Step& step = steps_[i];
    if (AllFinite(step.f) && AllFinite(step.g) && AllFinite(step.l)) continue;
    return StepErrorOf(index_->problem.motions[i], Outcome::kNotFinite);
  }
  return {EventKind::kNotFinite, "the covariance after the step is not finite"};
}

/// Returns true if P cannot overflow in this step. The bounds are |F P F'|_ij <= (n max|F|)^2
/// max|P| and |N N'|_ij <= n_w max|N|^2.
[[gnu::noinline]] bool Motions::IsBounded(const Covariance& covariance) const {
  constexpr double kSafe = 1e300;
  double f = 1.0, noise = 0.0, cross = 0.0, p = 0.0;
  const auto update_bound = [](double& bound, std::span<const double> values) {
    for (const double value : values) bound = std::max(bound, std::abs(value));
    return AllFinite(values);
  };
  for (const std::size_t i : active_) {
    const Step& step = steps_[i];
    if (!update_bound(f, step.f) || !update_bound(noise, step.gl)) return false;
    if (step.continues_interval && !update_bound(cross, step.cross)) return false;
  }
  const int n = covariance.size();
  for (int i = 0; i < n; ++i) p = std::max(p, covariance.Variance(i));
  const double rows = f * n;
  return rows * rows * p + noise_size() * noise * noise + 2.0 * cross <= kSafe;
}

/// Propagates P by all active models. Stops and returns false if a model would make P not finite.
bool Motions::Propagate(Covariance& p) {
  for (const std::size_t i : active_) {
    const MotionPlace& place = index_->motion_places[i];
    const Step& step = steps_[i];
    const int width = index_->problem.motions[i].model->noise_size();
    const double* const cross = step.continues_interval ? step.cross.data() : nullptr;
    const bool finite = place.rows.size() == place.at.size()
                            ? p.Propagate(place.rows, step.f.data(), step.gl.data(), width, cross)
                            : PropagatePart(p, place, step, width);
    if (!finite) return false;
  }
  return true;
}

/// Propagates P by a model that has blocks without rows in P.
[[gnu::noinline]] bool Motions::PropagatePart(Covariance& p, const MotionPlace& place,
                                              const Step& step, int width) {
  if (place.rows.empty()) return true;
  const Workspace::Use use(memory_);
  const Eigen::Index k = std::ssize(place.rows), n = std::ssize(place.at);
  const auto take = [&](Eigen::Index columns) {
    return Eigen::Map<RowMajor>(memory_.Take(k * columns).data(), k, columns);
  };
  Eigen::Map<RowMajor> f = take(k), noise = take(width), cross = take(k);
  const std::vector<int>& present = place.present;
  f = Eigen::Map<const RowMajor>(step.f.data(), n, n)(present, present);
  noise = Eigen::Map<const RowMajor>(step.gl.data(), n, width)(present, Eigen::all);
  if (!step.continues_interval) return p.Propagate(place.rows, f.data(), noise.data(), width);
  cross = Eigen::Map<const RowMajor>(step.cross.data(), n, n)(present, present);
  return p.Propagate(place.rows, f.data(), noise.data(), width, cross.data());
}

int Motions::noise_size() const {
  int size = 0;
  for (const std::size_t i : active_) size += index_->problem.motions[i].model->noise_size();
  return size;
}

Workspace::Matrix Motions::Transition(int n, Workspace& work) const {
  Workspace::Matrix transition = work.Take(n, n);
  transition.setIdentity();
  for (const std::size_t i : active_) {
    const double* f = steps_[i].f.data();
    for (const int row : index_->motion_places[i].at) {
      for (const int column : index_->motion_places[i].at) {
        if (row >= 0 && column >= 0) transition(row, column) = *f;
        ++f;
      }
    }
  }
  return transition;
}

Workspace::Matrix Motions::NoiseColumns(std::vector<double> Step::*matrix, bool is_discrete, int n,
                                        Workspace& work) const {
  Eigen::Index columns = 0;
  for (const std::size_t i : active_) {
    if (index_->motion_places[i].holds == is_discrete)
      columns += index_->problem.motions[i].model->noise_size();
  }
  Workspace::Matrix input = work.Take(n, columns);
  input.setZero();
  columns = 0;
  for (const std::size_t i : active_) {
    const Step& step = steps_[i];
    const MotionPlace& place = index_->motion_places[i];
    if (place.holds != is_discrete) continue;
    const MotionModel& model = *index_->problem.motions[i].model;
    const Eigen::Index width = model.noise_size();
    for (std::size_t row = 0; row < place.at.size(); ++row) {
      if (place.at[row] < 0) continue;
      const Eigen::Map<const RowMajor> block((step.*matrix).data(), model.tangent_size(), width);
      input.row(place.at[row]).segment(columns, width) = block.row(static_cast<Eigen::Index>(row));
    }
    columns += width;
  }
  return input;
}

}  // namespace alidade::internal
