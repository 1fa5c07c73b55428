// SPDX-License-Identifier: Apache-2.0
#include "sparse_solve.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/state/dense_algebra.h"
#include "kkt_covariance.h"

namespace alidade::ceres_batch {

SparseSolve::SparseSolve(CondensedRun& run, const SolveOptions& options)
    : run_(run), options_(options), kkt_(run) {}

void SparseSolve::HeedStop() const {
  if (stop_ && stop_()) throw Error(ExitCode::kStopped, "stopped while the batch was solved");
}

void SparseSolve::Note(Timestamp timestamp, std::vector<Event>& events) const {
  if (!note_.empty()) events.push_back({timestamp, EventKind::kNotConverged, note_});
}

void SparseSolve::NoteNew(Timestamp timestamp, std::string& told,
                          std::vector<Event>& events) const {
  Note(timestamp, events);
  if (at_edge_ != told && !at_edge_.empty()) {
    events.push_back({timestamp, EventKind::kEdgeOfDomain, at_edge_});
  }
  told = at_edge_;
}

void SparseSolve::NoteInexact(Timestamp timestamp, std::vector<Event>& events) const {
  constexpr double kMost = 0.01;
  if (!(inexactness_ > kMost)) return;
  events.push_back({timestamp, EventKind::kInexact,
                    "variances may be wrong by " +
                        internal::RoundedText(std::min(100.0, 100.0 * inexactness_), 1) +
                        " % and more, by rounding: a prior is very vague of what nothing else "
                        "tells; a smaller sigma costs fewer digits"});
}

bool SparseSolve::TooLarge() {
  constexpr double kMostBytes = 16e9, kMostFlops = 1e13;
  if (kkt_.bytes() <= kMostBytes && flops() <= kMostFlops) return false;
  summary_ = "an iteration would take " + internal::RoundedText(flops(), 2) + " flops and " +
             internal::RoundedText(kkt_.bytes() * 1e-9, 2) +
             " GB, more than the batch is made for (1e13, 16 GB): a shorter series has fewer";
  return true;
}

bool SparseSolve::SolveAll(const Trajectory& about) {
  return Solve([&] { return Start(about); });
}

bool SparseSolve::SolveAnew(const Trajectory& about, Eigen::VectorXd e) {
  const RunShape shape = run_.shape();
  e.conservativeResizeLike(Eigen::VectorXd::Zero(shape.inputs));
  return Solve([&] {
    z_ = kkt_.Join(e);
    return (!shape.has_unit_vector && kkt_.Freeze(z_) && kkt_.Cost(z_)) || Start(about);
  });
}

/// From where `start` leaves z_, which says whether the models are defined there.
bool SparseSolve::Solve(const std::function<bool()>& start) {
  note_.clear();
  iterations_ = solves_ = undefined_ = 0;
  if (TooLarge()) {
    failed_ = true;
    return false;
  }
  if (!start()) {
    failed_ = true;
    summary_ = "nowhere to start: " + run_.problem();
    return false;
  }
  failed_ = !Minimise();
  const std::string cost = "cost " + internal::RoundedText(kkt_.step().cost, 9) + ", " +
                           std::to_string(iterations_) + " iterations in " +
                           std::to_string(solves_) + (solves_ == 1 ? " solve: " : " solves: ");
  at_edge_ = TextOfEdge();
  const bool held = !at_edge_.empty();
  summary_ =
      cost + (failed_ ? summary_ : ended_) + (held ? ", " : "") + at_edge_ + "; sparse, " +
      (kkt_.in_time_order() ? "from the last frame back, " : "in order of minimum degree, ") +
      internal::RoundedText(flops(), 2) + " flops an iteration";
  kkt_.edge().Free();  // the covariance is that of a landmark that is free there
  if ((!failed_ && !held) || (kkt_.Linearise(z_, 0.0) && kkt_.Solve())) return true;
  failed_ = true;
  summary_ += "; then " + run_.problem();
  return false;
}

/// Landmarks at the edge of their domain, by their ids.
std::string SparseSolve::TextOfEdge() const {
  constexpr std::size_t kMost = 10;  // names
  const std::vector<std::int64_t> ids = kkt_.edge().Held();
  if (ids.empty()) return "";
  std::string text =
      std::to_string(ids.size()) + (ids.size() == 1 ? " landmark at the edge of its domain: "
                                                    : " landmarks at the edge of their domain: ");
  for (std::size_t i = 0; i < std::min(ids.size(), kMost); ++i) {
    text += (i == 0 ? "" : ", ") + std::to_string(ids[i]);
  }
  return text + (ids.size() > kMost ? " and others" : "");
}

/// From the problem linearised about the filter, the landmarks where they cost least; where that
/// leaves the domain of a model, from z = 0.
bool SparseSolve::Start(const Trajectory& about) {
  constexpr int kMostPasses = 20;
  constexpr double kSettled = 1e-9;
  const RunShape shape = run_.shape();
  Trajectory trajectory = about;
  z_ = kkt_.Join(Eigen::VectorXd::Zero(shape.inputs));
  bool linearised = false;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    if (!kkt_.LineariseAbout(trajectory, z_) || !kkt_.Solve()) break;
    linearised = true;
    z_.head(shape.inputs) += kkt_.step().dz.head(shape.inputs);
    if (!shape.has_unit_vector || kkt_.step().dz.norm() <= kSettled) break;
    kkt_.Move(trajectory);
  }
  if (linearised && kkt_.Settle(z_, false, 0.0) && kkt_.Freeze(z_) && kkt_.Cost(z_)) return true;
  z_.setZero();
  return kkt_.Freeze(z_) && kkt_.Settle(z_, false, 0.0) && kkt_.Freeze(z_) && kkt_.Cost(z_);
}

/// Until Q and R settle, and no observation that is defined is left out. In summary_, why it
/// failed.
bool SparseSolve::Minimise() {
  constexpr double kSettled = 1e-9;
  while (true) {
    ++solves_;
    if (!Descend()) return false;
    const std::optional<KktSystem::Frozen> frozen = kkt_.Freeze(z_);
    if (!frozen) {
      summary_ = run_.problem();
      return false;
    }
    if (frozen->change <= kSettled && !frozen->joined) return true;
    if (solves_ >= options_.max_outer_iterations) {
      summary_ = "the noise that depends on the state did not settle; a larger " +
                 SettingText("max_outer_iterations", options_.max_outer_iterations) + " may do";
      return false;
    }
  }
}

namespace {

constexpr double kTells = 1e-8;      // sigma, of a step
constexpr double kRounding = 1e-13;  // of the cost

}  // namespace

/// Where the step leads. Where the cost falls by less than it should, landmarks move to where they
/// cost least given e.
SparseSolve::Trial SparseSolve::AfterStep(double predicted) {
  constexpr double kLinear = 0.75;  // gain ratio below which landmarks are settled on their own
  constexpr double kLeft = 1e-4;    // of what the step promises, to the next one
  const double cost = kkt_.step().cost;
  Trial next;
  next.z = z_ + kkt_.step().dz;
  next.cost = CostAt(next.z);
  if (!next.cost) {
    ++undefined_;
    kkt_.NoteUndefined(next.z);
  }
  if (!run_.shape().has_landmarks || predicted <= kRounding * (1.0 + cost)) return next;
  if (next.cost && cost - *next.cost > kLinear * predicted) return next;
  Trial settled = next;
  const Eigen::Index map = z_.size() - run_.shape().inputs;
  if (!next.cost) settled.z.tail(map) = z_.tail(map);
  const double left = kLeft * predicted;
  settled.cost = kkt_.Settle(settled.z, true, left) ? CostAt(settled.z) : std::nullopt;
  return settled.cost && !(next.cost && *next.cost < *settled.cost) ? settled : next;
}

/// Gauss-Newton steps s(z) shrink slowly, or do not shrink at all, where the Hessian is far from
/// theirs: each error in its direction is left times some factor. From the last few of them, where
/// a step that is a combination of them is least [Anderson1965]; ds and dz from one to the next:
///
///   z + s - (dZ + dS) t,   t = argmin |s - dS t|
std::optional<SparseSolve::Trial> SparseSolve::Extrapolated(double predicted) {
  constexpr double kEnough = 0.1;  // of what the step promises
  const auto count = static_cast<Eigen::Index>(last_.size());
  Eigen::MatrixXd dz(z_.size(), count), ds(z_.size(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Stepped& from = last_[static_cast<std::size_t>(i)];
    const bool newest = i + 1 == count;
    const Stepped* const next = newest ? nullptr : &last_[static_cast<std::size_t>(i) + 1];
    dz.col(i) = (newest ? z_ : next->z) - from.z;
    ds.col(i) = (newest ? kkt_.step().dz : next->step) - from.step;
  }
  const Eigen::VectorXd t = internal::SolveByPivoting(ds, kkt_.step().dz);
  Trial trial;
  trial.z = z_ + kkt_.step().dz - (dz + ds) * t;
  if (!trial.z.allFinite()) return {};
  trial.cost = CostAt(trial.z);
  const double cost = kkt_.step().cost,
               most = cost + kRounding * (1.0 + cost) - kEnough * predicted;
  return trial.cost && *trial.cost <= most ? std::optional(std::move(trial)) : std::nullopt;
}

/// Extrapolated where that is as good, or where the step leads.
SparseSolve::Trial SparseSolve::NextPoint(double mu, double predicted) {
  constexpr std::size_t kFrom = 5;  // points
  std::optional<Trial> extrapolated;
  if (mu == 0.0) {
    if (!last_.empty()) extrapolated = Extrapolated(predicted);
    last_.push_back({z_, kkt_.step().dz});
    if (last_.size() > kFrom) last_.pop_front();
  }
  return extrapolated ? *std::move(extrapolated) : AfterStep(predicted);
}

namespace {

/// How long the undamped steps of a descent are, in sigma, and whether they still get shorter.
struct Lengths {
  double left = 0.0, before = 1.0;  ///< the last one, and the one before it
  double shortest = 0.0;
  int same = 0;  ///< iterations since the shortest

  void Take(double length) {
    before = left > 0.0 ? left : 1.0;
    left = length;
  }
  /// An iteration. Whether rounding makes the steps: they are short, and for long no shorter.
  bool Rounded() {
    constexpr double kShort = 1e-3;
    constexpr int kMost = 20;
    if (left > kShort || same == 0 || left < 0.9 * shortest) {
      shortest = left;
      same = 0;
    }
    return ++same > kMost;
  }
  /// Whether what is left tells nothing. Steps that shrink by q leave left q / (1 - q) to go.
  bool Settled() const {
    constexpr double kSettled = 1e-9;
    constexpr int kMost = 5;
    const double rest = left < before ? left * left / (before - left) : left;
    return (left <= kSettled && rest <= kTells) || (left <= kTells && same > kMost);
  }
};

}  // namespace

/// Levenberg-Marquardt: with the gain ratio g of a step that is taken,
///
///   mu <- mu max(1/3, 1 - (2 g - 1)^3),   and of one that is not, mu <- mu nu, nu <- 2 nu
bool SparseSolve::Descend() {
  constexpr double kLeast = 1e-6, kMost = 1e30;  // damping: off, and none helps
  double mu = 0.0, nu = 2.0;
  Lengths lengths;
  last_.clear();
  note_.clear();
  ended_ = "converged";
  if (!kkt_.Linearise(z_, mu) || !kkt_.Solve()) {
    summary_ = run_.problem();
    return false;
  }
  for (int i = 0; i < options_.max_iterations; ++i) {
    HeedStop();
    const double cost = kkt_.step().cost, decrement = std::max(0.0, kkt_.step().decrement);
    const double squared = kkt_.step().dz.squaredNorm();
    if (mu == 0.0) lengths.Take(std::sqrt(decrement));
    if (lengths.Rounded()) return EndUnsettled(lengths.left, End::kRounding);
    const double predicted = 0.5 * (decrement + mu * squared);
    const bool unseen = predicted <= kRounding * (1.0 + cost);
    Trial next = NextPoint(mu, predicted);
    ++iterations_;
    if (next.cost && (*next.cost <= cost || (unseen && *next.cost <= cost * (1.0 + 1e-9)))) {
      z_ = std::move(next.z);
      if (mu == 0.0 && lengths.Settled()) {
        if (!kkt_.edge().LetGo(z_)) return true;
        last_.clear();
        lengths.same = 0;
      }
      const double gain = unseen ? 1.0 : (cost - *next.cost) / predicted;
      mu *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
      if (mu < kLeast) mu = 0.0;
      nu = 2.0;
    } else {
      // At first a tenth of the curvature along the step.
      if (mu == 0.0) mu = std::max(0.1 * decrement / squared, kLeast) / nu;
      mu *= nu;
      nu *= 2.0;
      if (!(mu < kMost)) break;
    }
    if (kkt_.edge().Hold(z_)) {
      mu = 0.0;
      nu = 2.0;
      last_.clear();
      lengths = {};
    }
    if (!kkt_.Linearise(z_, mu) || !kkt_.Solve()) {
      summary_ = run_.problem();
      return false;
    }
  }
  return EndUnsettled(lengths.left, mu < kMost ? End::kSpent : End::kNoneHelps);
}

/// Of a descent whose next step is `left` sigma long. Whether its end will do.
bool SparseSolve::EndUnsettled(double left, End end) {
  constexpr double kLong = 1e-3;   // sigma
  constexpr double kVague = 1e-2;  // as rounding may make steps
  const bool spent = end == End::kSpent;
  const std::string larger =
      "a larger " + SettingText("max_iterations", options_.max_iterations) + " may do";
  if (left <= kLong + 1e-6 * std::sqrt(2.0 * kkt_.step().cost) && (!spent || run_.shape().robust)) {
    if (end == End::kRounding) {
      ended_ = "converged to rounding, by steps of " + internal::RoundedText(left, 2) + " sigma";
    }
    if (left > kTells && (end != End::kRounding || run_.shape().robust)) {
      note_ = "the weights of the losses did not settle in " + std::to_string(iterations_) +
              " steps: the next one is " + internal::RoundedText(left, 3) + " sigma long; " +
              (spent ? larger : "it does not lower the cost");
    }
    return kkt_.Linearise(z_, 0.0) && kkt_.Solve();
  }
  summary_ = spent
                 ? "not converged, the next step is " + internal::RoundedText(left, 3) +
                       " sigma long; " + larger +
                       (left <= kVague ? ", or, where a prior is very vague, a smaller sigma" : "")
                 : "not converged: no step lowers the cost although the gradient is not zero; "
                   "check the models' Jacobians with alidade check";
  if (undefined_ > 0) {
    summary_ += ". Of " + std::to_string(iterations_) + " steps " + std::to_string(undefined_) +
                " led to where a model is not defined: " + run_.problem();
    if (2 * undefined_ > iterations_) {
      summary_ +=
          "; the optimum is probably at the edge of its domain: more iterations do not help";
    }
  }
  return false;
}

bool SparseSolve::PutAll(const Take& take, std::vector<LandmarkEstimate>& map) {
  const KktSystem::Covariances covariances(kkt_);
  inexactness_ = covariances.Inexactness();
  const Eigen::VectorXd e = z_.head(run_.shape().inputs);
  const auto put = [&](std::size_t k, const Point& point) {
    take(k, point.x, [&] { return covariances.OfFrame(k); });
  };
  if (!kkt_.TakeLandmarks(z_) || !run_.ForEachFrame(e, run_.shape().frames, put, false)) {
    failed_ = true;
    summary_ += "; then " + run_.problem();
    return false;
  }
  covariances.PutMap(map);
  return true;
}

}  // namespace alidade::ceres_batch
