// SPDX-License-Identifier: Apache-2.0
#include "alidade/ukf.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>

#include "ekf_kept.h"
#include "filter_options.h"
#include "square_root.h"

namespace alidade {
namespace {

constexpr int kMostHalvings = 30;

/// Mean of the points that `centre` and the columns of `points` are, and f_i = (y_i (-) mean) -
/// (centre (-) mean): `f` (tangent x 2N) and m = w sum f_i.
void MeanOf(const Geometry& geometry, const double* centre, const Eigen::MatrixXd& points, double w,
            double* mean, Eigen::Ref<Eigen::MatrixXd> f, Eigen::Ref<Eigen::VectorXd> m) {
  constexpr int kMostIterations = 50;
  constexpr double kSettled = 1e-14;
  std::copy_n(centre, geometry.ambient, mean);
  Eigen::VectorXd from_mean(geometry.tangent), d(geometry.tangent);
  for (int k = 0; k < kMostIterations; ++k) {
    geometry.Minus(centre, mean, from_mean.data());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      geometry.Minus(points.col(i).data(), mean, d.data());
      f.col(i) = d - from_mean;
    }
    m = w * f.rowwise().sum();
    if (geometry.kind == GeometryKind::kVector) {
      geometry.Plus(centre, m.eval().data(), mean);
      return;
    }
    const Eigen::VectorXd more = from_mean + m;
    geometry.Plus(mean, more.data(), mean);
    if (!(more.norm() > kSettled)) return;
  }
}

UkfOptions Read(Params& p) {
  UkfOptions options;
  options.alpha =
      p.Number("alpha", "", "spread of the sigma points", {0.0, 1.0, true, false}, options.alpha);
  options.beta = p.NonNegative("beta", "", "weight of what the centre adds; 2: best for a Gaussian",
                               options.beta);
  options.kappa =
      p.NonNegative("kappa", "", "spread beyond the number of directions", options.kappa);
  options.filter = internal::ReadCommonOptions(p);
  return options;
}

}  // namespace

UkfOptions UkfOptions::FromNode(const Node& entry) {
  return internal::OptionsFromNode(entry, "ukf", Read);
}

std::vector<ParamInfo> UkfOptions::Schema() { return internal::SchemaOf(Read); }

Ukf::Ukf(System system, const UkfOptions& options, const std::vector<StreamInfo>& streams)
    : Ekf(std::move(system), internal::WithoutRecovery(options.filter), streams),
      spread_(options),
      guarded_(system_.sensors.size() + 1, false) {
  ALIDADE_EXPECTS(!considering_ && !waiting_ && !system_.landmarks);
}

struct Ukf::Kept : Ekf::Kept {
  explicit Kept(const Ukf& ukf)
      : Ekf::Kept(ukf),
        root(ukf.root_),
        root_is_current(ukf.root_is_current_),
        guarded(ukf.guarded_) {}

  Eigen::MatrixXd root;
  bool root_is_current;
  std::vector<bool> guarded;
};

std::unique_ptr<Estimator::Snapshot> Ukf::Save() const { return std::make_unique<Kept>(*this); }

void Ukf::Restore(const Snapshot& snapshot) {
  Ekf::Restore(snapshot);
  const auto& kept = dynamic_cast<const Kept&>(snapshot);
  root_ = kept.root;
  root_is_current_ = kept.root_is_current;
  guarded_ = kept.guarded;
}

Ukf::Transform Ukf::TransformOf(Eigen::Index directions, int halvings) const {
  const double alpha = std::ldexp(spread_.alpha, -halvings);
  const double c2 = alpha * alpha * (static_cast<double>(directions) + spread_.kappa);
  return {std::sqrt(c2), 0.5 / c2, spread_.beta - alpha * alpha};
}

/// A with P = A A'; repairs P where it is not positive semi-definite.
const Eigen::MatrixXd& Ukf::Root() {
  constexpr double kRounding = 1e-12;
  if (root_is_current_) return root_;
  root_is_current_ = true;
  internal::SquareRoot result = internal::SquareRootOf(state_.covariance().Dense());
  root_ = std::move(result.root);
  if (result.defect < -kRounding) {
    state_.covariance().SetBlock(0, 0, root_ * root_.transpose());
    char text[160];
    std::snprintf(text, sizeof(text),
                  "the covariance has no square root: a pivot is %.3g of its largest variance; "
                  "negative pivots count as zero",
                  result.defect);
    Note("repaired", text);
  }
  return root_;
}

void Ukf::NoteGuard(const std::string& who, std::size_t index, int halvings) {
  if (halvings > 0 && !guarded_[index]) {
    Note("guarded", who + ": sigma points leave its domain; their spread is divided by " +
                        std::to_string(1 << halvings));
  }
  guarded_[index] = halvings > 0;
}

/// The model's x' at the values `from`, with `noise` (over all active models) in w, in `to`.
Status Ukf::StepPoint(const std::vector<double>& from, const Eigen::VectorXd& noise, double dt_s,
                      std::vector<double>& to) const {
  to = from;
  Eigen::Index at = 0;
  std::vector<const double*> x;
  std::vector<double*> next;
  std::vector<double> unused(from.size());
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (!motions_[i].active) continue;
    const MotionBinding& motion = system_.motions[i];
    x.clear();
    next.clear();
    for (const BlockId id : motion.blocks) {
      const Block& block = state_.layout()[id];
      const bool fixed = block.status == BlockStatus::kFixed;
      x.push_back(from.data() + block.value_offset);
      next.push_back((fixed ? unused : to).data() + block.value_offset);
    }
    const Eigen::Index size = motion.model.noise_size();
    const Eigen::Map<const RowMajor> l(motions_[i].l.data(), size, size);
    const Eigen::VectorXd w = l * noise.segment(at, size);
    const Status status =
        motion.model.Step(x.data(), nullptr, w.data(), dt_s, next.data(), nullptr, nullptr);
    if (status != Status::kOk) return status;
    at += size;
  }
  return AllFinite(to) ? Status::kOk : Status::kOutOfDomain;
}

/// Moves state and covariance, which stay as they are where a point is out of its domain.
Status Ukf::StepPoints(const Eigen::MatrixXd& root, int halvings, double dt_s) {
  const Eigen::Index n = root.cols(), noises = NoiseInput().cols(), all = n + noises;
  const Transform transform = TransformOf(all, halvings);
  std::vector<double> centre, from, to;
  Status status = StepPoint(state_.values(), Eigen::VectorXd::Zero(noises), dt_s, centre);
  Eigen::MatrixXd points(static_cast<Eigen::Index>(centre.size()), 2 * all);
  for (Eigen::Index i = 0; i < 2 * all && status == Status::kOk; ++i) {
    const double c = i < all ? transform.c : -transform.c;
    const Eigen::Index direction = i % all;
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(n), noise = Eigen::VectorXd::Zero(noises);
    if (direction < n) {
      dx = c * root.col(direction);
    } else {
      noise[direction - n] = c;
    }
    state_.Retract(dx.data(), from);
    status = StepPoint(from, noise, dt_s, to);
    points.col(i) = Eigen::Map<const Eigen::VectorXd>(to.data(), points.rows());
  }
  if (status != Status::kOk) return status;
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(n, 2 * all);
  Eigen::VectorXd m = Eigen::VectorXd::Zero(n);
  std::vector<double> mean = centre;
  for (const Block& block : state_.layout().blocks()) {
    if (!block.has_covariance()) continue;
    const Geometry& geometry = block.geometry();
    MeanOf(geometry, centre.data() + block.value_offset,
           points.middleRows(block.value_offset, geometry.ambient), transform.w,
           mean.data() + block.value_offset, f.middleRows(block.tangent_offset, geometry.tangent),
           m.segment(block.tangent_offset, geometry.tangent));
  }
  const Eigen::MatrixXd p = transform.w * f * f.transpose() + transform.centre * m * m.transpose();
  if (!AllFinite(mean) || !p.allFinite()) return Status::kOutOfDomain;
  state_.values().assign(mean.begin(), mean.end());
  state_.covariance().SetBlock(0, 0, p);
  root_is_current_ = false;
  return Status::kOk;
}

bool Ukf::StepOnce(double dt_s) {
  bool moves = false;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (!motions_[i].active) continue;
    moves = true;
    if (!StepModel(system_.motions[i], motions_[i], dt_s)) return false;  // the centre, and Lq
  }
  if (!moves) return true;
  const Eigen::MatrixXd root = Root();
  for (int halvings = 0; halvings <= kMostHalvings; ++halvings) {
    const Status status = StepPoints(root, halvings, dt_s);
    if (status == Status::kOk) {
      NoteGuard("motion", guarded_.size() - 1, halvings);
      return true;
    }
    if (status == Status::kError) break;
  }
  GiveUp("diverged", "the sigma points cannot step, however near the estimate");
  return false;
}

/// h at the sigma points of one measurement: its mean, in the report, and its deviations.
Outcome Ukf::Predict(Row& row, int halvings) {
  const SensorBinding& binding = BindingOf(row);
  const Geometry& geometry = binding.model.measurement().geometry;
  const Eigen::MatrixXd& root = Root();
  const Eigen::Index n = root.cols();
  const Transform transform = TransformOf(n, halvings);
  std::vector<const double*> roles = PlanOf(row).roles;  // as held, or fixed
  Eigen::VectorXd centre(geometry.ambient);
  const Outcome at_centre = OutcomeOf(binding.model.Predict(roles.data(), centre.data()));
  if (at_centre != Outcome::kAccepted) return at_centre;
  Eigen::MatrixXd points(geometry.ambient, 2 * n);
  std::vector<double> values;
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    const Eigen::VectorXd dx = (i < n ? transform.c : -transform.c) * root.col(i % n);
    state_.Retract(dx.data(), values);
    for (std::size_t k = 0; k < roles.size(); ++k) {
      const RoleBinding& role = binding.roles[k];
      if (role.block < 0 || role.mode == RoleMode::kHold) continue;
      roles[k] = values.data() + state_.layout()[role.block].value_offset;
    }
    const Outcome outcome = OutcomeOf(binding.model.Predict(roles.data(), points.col(i).data()));
    if (outcome != Outcome::kAccepted) return outcome;
  }
  Predicted& predicted = PredictedOf(row);
  predicted.halvings = halvings;
  predicted.f.resize(geometry.tangent, 2 * n);
  predicted.m.resize(geometry.tangent);
  MeasurementReport& entry = EntryOf(row);
  entry.h.resize(static_cast<std::size_t>(geometry.ambient));
  MeanOf(geometry, centre.data(), points, transform.w, entry.h.data(), predicted.f, predicted.m);
  entry.innovation.resize(static_cast<std::size_t>(geometry.tangent));
  geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
  return Outcome::kAccepted;
}

Outcome Ukf::Linearise(Row& row) {
  const SensorBinding& binding = BindingOf(row);
  const SensorPlan& plan = PlanOf(row);
  if (predicted_.size() <= row.report) predicted_.resize(row.report + 1);
  int halvings = 0;
  Outcome outcome = Predict(row, halvings);
  std::vector<double> centre(
      static_cast<std::size_t>(binding.model.measurement().geometry.ambient));
  while (outcome == Outcome::kOutOfDomain && halvings < kMostHalvings &&
         binding.model.Predict(plan.roles.data(), centre.data()) == Status::kOk) {
    outcome = Predict(row, ++halvings);
  }
  if (outcome == Outcome::kAccepted) {
    NoteGuard("sensor '" + binding.name + "'", static_cast<std::size_t>(row.sensor), halvings);
    outcome = NoiseOf(row, plan.roles.data());
  }
  if (outcome == Outcome::kAccepted) return outcome;
  EntryOf(row).h.clear();
  EntryOf(row).innovation.clear();
  NoteRefusal(row, outcome);
  return outcome;
}

/// S = Cov(h) + R.
void Ukf::Project(Row& row) {
  const Predicted& predicted = PredictedOf(row);
  const Transform transform = TransformOf(Root().cols(), predicted.halvings);
  const Eigen::Index m = predicted.m.size();
  const Eigen::MatrixXd s = transform.w * predicted.f * predicted.f.transpose() +
                            transform.centre * predicted.m * predicted.m.transpose() +
                            Eigen::Map<const RowMajor>(row.r.data(), m, m);
  EntryOf(row).s.assign(s.data(), s.data() + s.size());
  row.pht.clear();
}

/// All rows at the spread of the narrowest: f, m, R and innovation below one another.
Outcome Ukf::StackPoints(std::span<Row* const> rows, Stacked& all, Eigen::VectorXd& mean,
                         int& halvings) {
  Eigen::Index size = 0;
  halvings = 0;
  for (const Row* row : rows) {
    size += PredictedOf(*row).m.size();
    halvings = std::max(halvings, PredictedOf(*row).halvings);
  }
  all.h.resize(size, 2 * Root().cols());
  all.noise = Eigen::MatrixXd::Zero(size, size);
  all.innovation.resize(size);
  mean.resize(size);
  Eigen::Index at = 0;
  for (Row* row : rows) {
    if (PredictedOf(*row).halvings < halvings) {
      const Outcome outcome = Predict(*row, halvings);
      if (outcome != Outcome::kAccepted) return outcome;
    }
    const Predicted& predicted = PredictedOf(*row);
    const Eigen::Index k = predicted.m.size();
    all.h.middleRows(at, k) = predicted.f;
    all.noise.block(at, at, k, k) = Eigen::Map<const RowMajor>(row->r.data(), k, k);
    all.innovation.segment(at, k) =
        Eigen::Map<const Eigen::VectorXd>(EntryOf(*row).innovation.data(), k);
    mean.segment(at, k) = predicted.m;
    at += k;
  }
  return Outcome::kAccepted;
}

Outcome Ukf::Apply(std::span<Row* const> rows) {
  Stacked all;
  Eigen::VectorXd mean;
  int halvings = 0;
  const Outcome stacked = StackPoints(rows, all, mean, halvings);
  if (stacked != Outcome::kAccepted) return stacked;
  const Eigen::MatrixXd& root = Root();
  const Transform transform = TransformOf(root.cols(), halvings);
  Eigen::MatrixXd dx(root.rows(), 2 * root.cols());
  dx << transform.c * root, -transform.c * root;
  const Eigen::MatrixXd s = transform.w * all.h * all.h.transpose() +
                            transform.centre * mean * mean.transpose() + all.noise;
  const Eigen::LLT<Eigen::MatrixXd> llt(s);
  if (!s.allFinite() || llt.info() != Eigen::Success) {
    Note("not_pd", "the update would leave S not positive definite; rolled back");
    return Outcome::kNotPd;
  }
  const Eigen::MatrixXd cross = transform.w * dx * all.h.transpose();
  const Eigen::MatrixXd gain = llt.solve(cross.transpose()).transpose();
  const Eigen::MatrixXd rest = dx - gain * all.h;
  const Eigen::VectorXd centre = gain * mean, step = gain * all.innovation;
  const Eigen::MatrixXd p = transform.w * rest * rest.transpose() +
                            transform.centre * centre * centre.transpose() +
                            gain * all.noise * gain.transpose();
  state_.Retract(step.data(), moved_);
  if (!AllFinite(moved_) || !p.allFinite()) {
    Note("not_finite", "the update is not finite; rolled back");
    return Outcome::kNotFinite;
  }
  state_.covariance().SetBlock(0, 0, p);
  state_.MoveTo(moved_);
  root_is_current_ = false;
  RecordUpdate(rows, gain);
  return Outcome::kAccepted;
}

}  // namespace alidade
