// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/ekf_small.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "alidade/state/small_kernels.h"

#define ALIDADE_INLINE [[gnu::always_inline]] inline

namespace alidade {
namespace {

ALIDADE_INLINE void Fit(std::vector<double>& values, int size) {
  if (std::ssize(values) != size) values.resize(static_cast<std::size_t>(size));
}

/// Makes room in the report of an accepted measurement of m rows in a filter of n states.
[[gnu::noinline]] void Fit(MeasurementReport& entry, int m, int n) {
  Fit(entry.z, m);
  Fit(entry.h, m);
  Fit(entry.innovation, m);
  Fit(entry.s, m * m);
  Fit(entry.gain, m * n);
}

/// One by one: with std::copy_n and AllFinite in place of the two below a step takes 15 % longer
/// (bench_small_filter).
ALIDADE_INLINE void Copy(const double* from, int size, std::vector<double>& to) {
  double* const at = to.data();
  for (int i = 0; i < size; ++i) at[i] = from[i];
}

/// What a model has not written yet.
constexpr double kUnwritten = std::numeric_limits<double>::quiet_NaN();

/// 0 where all are finite, else not a number.
ALIDADE_INLINE double Defect(const double* values, int size) {
  double sum = 0.0;
  for (int i = 0; i < size; ++i) sum += 0.0 * values[i];
  return sum;
}

}  // namespace

/// What one motion model makes of its blocks and of P. K rows and W noise inputs, or 0 where they
/// are known at run time only.
template <int N, int K, int W>
ALIDADE_INLINE bool Ekf::Small::StepModel(const Motion& motion, double dt_s, double (&p)[N][N]) {
  MotionPlan& plan = *motion.plan;
  double* const f = plan.f.data();
  double* const l = plan.l.data();
  double* const g = plan.g.data();
  const int k = K > 0 ? K : motion.size, w = W > 0 ? W : motion.noise;
  double* const next = ekf_.next_.data() + motion.offset;
  for (int i = 0; i < k; ++i) next[i] = kUnwritten;
  for (int i = 0; i < k * k; ++i) f[i] = kUnwritten;
  for (int i = 0; i < k * w; ++i) g[i] = kUnwritten;
  for (int i = 0; i < w * w; ++i) l[i] = kUnwritten;
  if (motion.model->Step(plan.x.data(), plan.u, nullptr, dt_s, plan.next.data(), f, g) !=
          Status::kOk ||
      motion.model->SqrtQ(plan.x.data(), dt_s, l) != Status::kOk) {
    return false;
  }
  double own[K > 0 ? K * K : 1];
  double* const q = K > 0 ? own : plan.q.data();
  internal::SpreadNoise(g, l, k, w, plan.gl.data(), q);
  internal::Propagate<N, K>(p, motion.offset, k, f, q);
  return Defect(ekf_.next_.data() + motion.offset, k) == 0.0;
}

/// All motion models, or nothing.
template <int N>
ALIDADE_INLINE bool Ekf::Small::Step(double dt_s) {
  Covariance& covariance = ekf_.state_.covariance();
  double p[N][N];
  internal::Load(covariance.data(), covariance.stride(), p);
  for (const Motion& motion : motions_) {
    bool done = false;
    if constexpr (N >= 2) {
      done = motion.size == 2 && motion.noise == 1 ? StepModel<N, 2, 1>(motion, dt_s, p)
                                                   : StepModel<N, 0, 0>(motion, dt_s, p);
    } else {
      done = StepModel<N, 0, 0>(motion, dt_s, p);
    }
    if (!done) return false;
  }
  double defect = 0.0;
  for (int i = 0; i < N; ++i) defect += 0.0 * p[i][i];
  if (defect != 0.0) return false;
  internal::Store(p, covariance.data(), covariance.stride());
  double* const x = ekf_.state_.values().data();
  const double* const next = ekf_.next_.data();
  for (const Motion& motion : motions_) {
    for (int i = motion.offset; i < motion.offset + motion.size; ++i) x[i] = next[i];
  }
  return true;
}

/// h, H, R, S and NIS of one measurement of M rows (0: known at run time only), with P H' at
/// `pht`; false where anything is unusual.
template <int N, int M>
ALIDADE_INLINE bool Ekf::Small::Linearise(Sensor& sensor, const double* z, MeasurementReport& entry,
                                          double* pht) {
  constexpr double kTiny = 1e-13;
  constexpr int kMost = M > 0 ? M : kMostOfOne;
  const int m = M > 0 ? M : sensor.rows;
  const Covariance& p = ekf_.state_.covariance();
  double h[kMost], l[kMost * kMost], r[kMost], noise[kMost], s[kMost * kMost];
  for (int i = 0; i < m; ++i) h[i] = kUnwritten;
  for (int i = 0; i < m * m; ++i) l[i] = kUnwritten;
  for (int i = 0; i < m * N; ++i) sensor.h.data()[i] = sensor.blank.data()[i];
  const double* const* const roles = sensor.roles.data();
  if (sensor.model->Linearise(roles, h, sensor.jacobians.data(), sensor.strides.data()) !=
          Status::kOk ||
      sensor.model->SqrtNoise(roles, z, l) != Status::kOk) {
    return false;
  }
  for (int i = 0; i < m; ++i) {
    r[i] = z[i] - h[i];
    for (int j = 0; j <= i; ++j) {
      double sum = l[i * m] * l[j * m];
      for (int c = 1; c < m; ++c) sum += l[i * m + c] * l[j * m + c];
      s[i * m + j] = s[j * m + i] = sum;
    }
    noise[i] = s[i * m + i];
  }
  internal::Project<N>(p.data(), p.stride(), sensor.h.data(), m, pht, s);
  bool tiny = false;
  for (int i = 0; i < m; ++i) tiny |= !(noise[i] > kTiny * s[i * m + i]);
  if (tiny && !ekf_.warned_[static_cast<std::size_t>(entry.sensor)]) return false;
  double work[kMost * (kMost + 1)];
  entry.nis = internal::SquaredMahalanobis(s, r, m, work);
  if (Defect(s, m * m) + 0.0 * entry.nis != 0.0) return false;
  Copy(z, m, entry.z);
  Copy(h, m, entry.h);
  Copy(r, m, entry.innovation);
  Copy(s, m * m, entry.s);
  return true;
}

/// Puts a measurement that passed its gate below the `at` rows before it; their P H' is there.
template <int N, int M>
ALIDADE_INLINE void Ekf::Small::Stack(const Sensor& sensor, MeasurementReport& entry, Rows<N>& rows,
                                      int at) {
  const int m = M > 0 ? M : sensor.rows;
  const double* const own = entry.s.data();
  for (int i = 0; i < m; ++i) {
    const double* const h = sensor.h.data() + i * N;
    double* const s = rows.s + (at + i) * kRows;
    for (int j = 0; j < at; ++j) {
      double sum = h[0] * rows.pht[j * N];
      for (int c = 1; c < N; ++c) sum += h[c] * rows.pht[j * N + c];
      s[j] = sum;
    }
    for (int j = 0; j <= i; ++j) s[at + j] = own[i * m + j];
    rows.innovation[at + i] = entry.innovation[static_cast<std::size_t>(i)];
    rows.gain[at + i] = entry.gain.data() + i * N;
  }
}

/// The update with M rows (0: known at run time only), or nothing.
template <int N, int M>
ALIDADE_INLINE bool Ekf::Small::Correct(const Rows<N>& rows, int count) {
  constexpr int kMost = M > 0 ? M : kRows;
  const int m = M > 0 ? M : count;
  Covariance& p = ekf_.state_.covariance();
  double w[kMost * N], inverse_d[kMost], dx[N], gain[kMost * N], moved[N], updated[N * N];
  if (!internal::Solve<N, M>(m, rows.pht, rows.s, kRows, rows.innovation, w, inverse_d, dx, gain) ||
      !internal::Downdate<N, M>(p.data(), p.stride(), m, w, inverse_d, updated)) {
    return false;
  }
  double* const x = ekf_.state_.values().data();
  for (int i = 0; i < N; ++i) moved[i] = x[i] + dx[i];
  if (Defect(moved, N) != 0.0) return false;
  for (int c = 0; c < N; ++c) {
    for (int r = c; r < N; ++r) p.data()[c * p.stride() + r] = updated[c * N + r];
  }
  for (int i = 0; i < N; ++i) x[i] = moved[i];
  ekf_.interval_steps_ = 0;
  for (int i = 0; i < m; ++i) {
    for (int n = 0; n < N; ++n) rows.gain[i][n] = gain[i * N + n];
  }
  return true;
}

/// Reports a measurement of M rows (0: known at run time only) and stacks it below the `at` rows
/// before it, where it passes its gate.
template <int N, int M>
ALIDADE_INLINE Ekf::Small::Taken Ekf::Small::Take(Sensor& sensor, const Measurement& measurement,
                                                  Rows<N>& rows, int at) {
  const int m = M > 0 ? M : sensor.rows;
  const double* const z = measurement.values.data();
  if (std::ssize(measurement.values) != m || !measurement.covariance.empty() ||
      Defect(z, m) != 0.0 || at + m > kRows) {
    return Taken::kUnusual;
  }
  const Status valid = sensor.model->Valid(z);
  if (valid != Status::kOk && valid != Status::kInvalid) return Taken::kUnusual;
  MeasurementReport& entry = ekf_.report_.Add();
  if (valid == Status::kInvalid) {
    entry.Reset(sensor.index, measurement.landmark, m);
    entry.z.assign(z, z + m);
    entry.outcome = Outcome::kInvalid;
    return Taken::kLeftOut;
  }
  if (std::ssize(entry.gain) != m * N || std::ssize(entry.z) != m) Fit(entry, m, N);
  entry.sensor = sensor.index;
  entry.landmark = measurement.landmark;
  entry.dof = m;
  entry.outcome = Outcome::kAccepted;
  if (!Linearise<N, M>(sensor, z, entry, rows.pht + at * N)) return Taken::kUnusual;
  if (!(entry.nis <= sensor.gate)) {
    if (*sensor.rejections + 1 >= ekf_.options_.rejection_recovery_after) return Taken::kUnusual;
    entry.outcome = Outcome::kGated;
    entry.gain.clear();
    return Taken::kLeftOut;
  }
  Stack<N, M>(sensor, entry, rows, at);
  return Taken::kStacked;
}

/// The measurements of a frame as one update, or nothing.
template <int N>
ALIDADE_INLINE bool Ekf::Small::Update(const Frame& frame) {
  Rows<N> rows;
  int m = 0, last_sensor = -1;
  const Measurement* last = nullptr;
  ekf_.report_.ClearMeasurements();
  for (Sensor& sensor : sensors_) {
    const Measurement* found = nullptr;
    for (const Measurement& one : frame.measurements) {
      if (one.stream != sensor.stream) continue;
      if (found != nullptr) return false;
      found = &one;
    }
    if (found == nullptr) continue;
    const Taken taken = sensor.rows == 1 ? Take<N, 1>(sensor, *found, rows, m)
                                         : Take<N, 0>(sensor, *found, rows, m);
    if (taken == Taken::kUnusual) return false;
    if (taken == Taken::kLeftOut) continue;
    m += sensor.rows;
    last = found;
    last_sensor = sensor.index;
  }
  if (m > 0) {
    const bool done = m == 1   ? Correct<N, 1>(rows, m)
                      : m == 2 ? Correct<N, 2>(rows, m)
                               : Correct<N, 0>(rows, m);
    if (!done) return false;
    ekf_.last_used_.sensor = last_sensor;
    ekf_.last_used_.timestamp = last->timestamp;
    Fit(ekf_.last_used_.z, static_cast<int>(std::ssize(last->values)));
    Copy(last->values.data(), static_cast<int>(std::ssize(last->values)), ekf_.last_used_.z);
  }
  CountRejections();
  return true;
}

void Ekf::Small::CountRejections() {
  for (const MeasurementReport& entry : ekf_.report_.measurements()) {
    const auto k = static_cast<std::size_t>(entry.sensor);
    if (entry.outcome == Outcome::kAccepted) {
      ekf_.rejections_[k] = 0;
      ekf_.inflated_[k] = false;
      ekf_.out_of_domain_[k] = false;
    } else if (entry.outcome == Outcome::kGated) {
      ++ekf_.rejections_[k];
    }
  }
}

template <int N>
bool Ekf::Small::ProcessSized(const Frame& frame) {
  Timestamp elapsed = 0;
  if (ekf_.failed_ || ekf_.timestamp_ == kNoTimestamp || frame.timestamp < ekf_.timestamp_ ||
      __builtin_sub_overflow(frame.timestamp, ekf_.timestamp_, &elapsed)) {
    return false;
  }
  if (elapsed > 0) {
    if (ekf_.InInterval()) return false;
    const double dt_s = Seconds(elapsed);
    if (!ekf_.inputs_.empty()) {
      if (!ekf_.inputs_.AllAct(ekf_.timestamp_, frame.timestamp)) return false;
      ekf_.UseInputs();
    }
    if (!(dt_s <= ekf_.options_.max_dt_s) || !Step<N>(dt_s)) return false;
    ekf_.timestamp_ = frame.timestamp;
    ++ekf_.interval_steps_;
  }
  return Update<N>(frame);
}

bool Ekf::Small::AddMotions() {
  for (std::size_t i = 0; i < ekf_.motions_.size(); ++i) {
    MotionPlan& plan = ekf_.motions_[i];
    if (!plan.active) continue;
    if (plan.segments.size() != 1 || !plan.rows.empty()) return false;
    const MotionModel& model = ekf_.system_.motions[i].model;
    motions_.push_back(
        {&model, &plan, plan.segments[0].first, plan.segments[0].second, model.noise_size()});
  }
  return true;
}

bool Ekf::Small::AddSensors() {
  sensors_.reserve(ekf_.plans_.size());  // they hold pointers into themselves
  for (std::size_t k = 0; k < ekf_.plans_.size(); ++k) {
    const SensorPlan& plan = ekf_.plans_[k];
    const SensorModel& model = ekf_.system_.sensors[k].model;
    const Geometry& geometry = model.measurement().geometry;
    if (geometry.kind != GeometryKind::kVector || geometry.tangent > kMostOfOne || !plan.whole ||
        plan.linearised_elsewhere || ekf_.system_.sensors[k].loss.kind != LossKind::kNone ||
        std::ranges::count(plan.consider, true) > 0) {
      return false;
    }
    Sensor& sensor = sensors_.emplace_back();
    sensor.index = static_cast<int>(k);
    sensor.rejections = &ekf_.rejections_[k];
    sensor.model = &model;
    sensor.roles = plan.roles;
    sensor.strides = plan.strides;
    for (const JacobianPart& part : plan.parts) {
      for (int i = 0; i < geometry.tangent * part.size; ++i) {
        const int at = i / part.size * plan.width + part.column + i % part.size;
        sensor.blank[static_cast<std::size_t>(at)] = kUnwritten;
      }
    }
    for (const int column : plan.columns) {
      sensor.jacobians.push_back(column < 0 ? nullptr : sensor.h.data() + column);
    }
    sensor.stream = ekf_.stream_of_sensor_[k];
    sensor.rows = geometry.tangent;
    sensor.gate = ekf_.gate_threshold_[k];
  }
  return true;
}

std::unique_ptr<Ekf::Small> Ekf::Small::For(Ekf& ekf) {
  const int n = ekf.state_.covariance().size();
  const auto plain = [](const Block& block) {
    return block.has_covariance() && block.geometry().kind == GeometryKind::kVector &&
           block.value_offset == block.tangent_offset;
  };
  if (ekf.landmarks_ != nullptr || !ekf.state_.covariance().small() ||
      ekf.options_.fuse != Fuse::kJoint || ekf.waiting_ || ekf.considering_ ||
      !ekf.order_.empty() || std::ssize(ekf.state_.values()) != n ||
      !std::ranges::all_of(ekf.state_.layout().blocks(), plain)) {
    return nullptr;
  }
  std::unique_ptr<Small> small(new Small(ekf));
  if (!small->AddMotions() || !small->AddSensors()) return nullptr;
  const auto choose = [&]<int... I>(std::integer_sequence<int, I...>) {
    ((n == I + 1 ? (small->process_ = &Small::ProcessSized<I + 1>, 0) : 0), ...);
  };
  choose(std::make_integer_sequence<int, Covariance::kSmall>{});
  return small;
}

}  // namespace alidade
