// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/fast_path.h"

#include <algorithm>
#include <utility>

#include "alidade/base/all_finite.h"

#define ALIDADE_INLINE [[gnu::always_inline]] inline

namespace alidade::internal {
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
ALIDADE_INLINE bool FastPath::StepModel(const Motion& motion, double dt_s, double (&p)[N][N]) {
  Motions::Step& step = *motion.step;
  double* const f = step.f.data();
  double* const l = step.l.data();
  double* const g = step.g.data();
  const int k = K > 0 ? K : motion.size, w = W > 0 ? W : motion.noise;
  double* const next = f_.motions.next().data() + motion.offset;
  for (int i = 0; i < k; ++i) next[i] = kNotWritten;
  for (int i = 0; i < k * k; ++i) f[i] = kNotWritten;
  for (int i = 0; i < k * w; ++i) g[i] = kNotWritten;
  for (int i = 0; i < w * w; ++i) l[i] = kNotWritten;
  if (motion.model->Step(motion.x.data(), step.u.data(), nullptr, dt_s,
                         {motion.next.data(), f, g, l}) != Status::kOk) {
    return false;
  }
  double own[K > 0 ? K * K : 1];
  double* const q = K > 0 ? own : step.q.data();
  SpreadNoise(g, l, k, w, step.gl.data(), q);
  Propagate<N, K>(p, motion.offset, k, f, q);
  return Defect(f_.motions.next().data() + motion.offset, k) == 0.0;
}

/// All motion models, or nothing.
template <int N>
ALIDADE_INLINE bool FastPath::Step(double dt_s) {
  LowerTriangle lower = f_.state.covariance().lower();
  const int stride = static_cast<int>(lower.outerStride());
  double p[N][N];
  Load(lower.data(), stride, p);
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
  Store(p, lower.data(), stride);
  double* const x = f_.state.values().data();
  const double* const next = f_.motions.next().data();
  for (const Motion& motion : motions_) {
    for (int i = motion.offset; i < motion.offset + motion.size; ++i) x[i] = next[i];
  }
  return true;
}

/// h, H, R, S and NIS of one measurement of M rows (0: known at run time only), with P H' at
/// `pht`; false where anything is unusual.
template <int N, int M>
ALIDADE_INLINE bool FastPath::Linearise(Sensor& sensor, const double* z, MeasurementReport& entry,
                                        double* pht) {
  constexpr int kMost = M > 0 ? M : kMostOfOne;
  const int m = M > 0 ? M : sensor.rows;
  const LowerTriangle p = f_.state.covariance().lower();
  const int stride = static_cast<int>(p.outerStride());
  double h[kMost], l[kMost * kMost], r[kMost], noise[kMost], s[kMost * kMost];
  for (int i = 0; i < m; ++i) h[i] = kNotWritten;
  for (int i = 0; i < m * m; ++i) l[i] = kNotWritten;
  for (int i = 0; i < m * N; ++i) sensor.H.data()[i] = sensor.blank.data()[i];
  const double* const* const roles = sensor.roles.data();
  if (sensor.model->Evaluate({z}, roles, {h, sensor.jacobians.data(), sensor.strides.data(), l}) !=
      Status::kOk) {
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
  Project<N>(p.data(), stride, sensor.H.data(), m, pht, s);
  bool tiny = false;
  for (int i = 0; i < m; ++i) tiny |= Gate::Vanishes(noise[i], s[i * m + i]);
  if (tiny && !gate_.warned(static_cast<std::size_t>(entry.sensor))) return false;
  double work[kMost * (kMost + 1)];
  entry.nis = SquaredMahalanobis(s, r, m, work);
  if (Defect(s, m * m) + 0.0 * entry.nis != 0.0) return false;
  Copy(z, m, entry.z);
  Copy(h, m, entry.h);
  Copy(r, m, entry.innovation);
  Copy(s, m * m, entry.s);
  return true;
}

/// Puts a measurement that passed its gate below the `at` rows before it; their P H' is there.
template <int N, int M>
ALIDADE_INLINE void FastPath::Stack(const Sensor& sensor, MeasurementReport& entry,
                                    RowStack<N>& rows, int at) {
  const int m = M > 0 ? M : sensor.rows;
  const double* const own = entry.s.data();
  for (int i = 0; i < m; ++i) {
    const double* const h = sensor.H.data() + i * N;
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
ALIDADE_INLINE bool FastPath::Correct(const RowStack<N>& rows, int count) {
  constexpr int kMost = M > 0 ? M : kRows;
  const int m = M > 0 ? M : count;
  LowerTriangle p = f_.state.covariance().lower();
  const int stride = static_cast<int>(p.outerStride());
  double w[kMost * N], inverse_d[kMost], dx[N], gain[kMost * N], moved[N], updated[N * N];
  if (!Solve<N, M>(m, rows.pht, rows.s, kRows, rows.innovation, w, inverse_d, dx, gain) ||
      !Downdate<N, M>(p.data(), stride, m, w, inverse_d, updated)) {
    return false;
  }
  double* const x = f_.state.values().data();
  for (int i = 0; i < N; ++i) moved[i] = x[i] + dx[i];
  if (Defect(moved, N) != 0.0) return false;
  StoreLower<N>(updated, p.data(), stride);
  for (int i = 0; i < N; ++i) x[i] = moved[i];
  f_.motions.EndInterval();
  for (int i = 0; i < m; ++i) {
    for (int n = 0; n < N; ++n) rows.gain[i][n] = gain[i * N + n];
  }
  return true;
}

/// Reports a measurement of M rows (0: known at run time only) and stacks it below the `at` rows
/// before it, where it passes its gate.
template <int N, int M>
ALIDADE_INLINE FastPath::Taken FastPath::Take(Sensor& sensor, const Measurement& measurement,
                                              RowStack<N>& rows, int at) {
  const int m = M > 0 ? M : sensor.rows;
  const double* const z = measurement.values.data();
  if (std::ssize(measurement.values) != m || !measurement.covariance.empty() ||
      !measurement.known.empty() || Defect(z, m) != 0.0 || at + m > kRows) {
    return Taken::kUnusual;
  }
  const Status valid = sensor.model->Valid({z});
  if (valid != Status::kOk && valid != Status::kInvalid) return Taken::kUnusual;
  MeasurementReport& entry = f_.report.Add();
  if (valid == Status::kInvalid) {
    entry.Reset(sensor.index, measurement.landmark, m);
    entry.z.assign(z, z + m);
    entry.outcome = Outcome::kInvalid;
    return Taken::kLeftOut;
  }
  if (entry.dof != m || std::ssize(entry.gain) != m * N) Fit(entry, m, N);
  // Not Reset: vectors of the last frame have their size, and all numbers are written over.
  entry.sensor = sensor.index;
  entry.landmark = measurement.landmark;
  entry.dof = m;
  entry.outcome = Outcome::kAccepted;
  if (!Linearise<N, M>(sensor, z, entry, rows.pht + at * N)) return Taken::kUnusual;
  if (!(entry.nis <= sensor.threshold)) {
    if (gate_.IsDueNext(static_cast<std::size_t>(sensor.index))) return Taken::kUnusual;
    entry.outcome = Outcome::kGated;
    entry.gain.clear();
    return Taken::kLeftOut;
  }
  Stack<N, M>(sensor, entry, rows, at);
  return Taken::kStacked;
}

/// The measurements of a frame as one update, or nothing.
template <int N>
ALIDADE_INLINE bool FastPath::Update(const Frame& frame) {
  RowStack<N> rows;
  int m = 0, last_sensor = -1;
  const Measurement* last = nullptr;
  f_.report.ClearMeasurements();
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
    f_.health.last_used.sensor = last_sensor;
    f_.health.last_used.timestamp = last->timestamp;
    Fit(f_.health.last_used.z, static_cast<int>(std::ssize(last->values)));
    Copy(last->values.data(), static_cast<int>(std::ssize(last->values)), f_.health.last_used.z);
  }
  for (const MeasurementReport& entry : f_.report.measurements()) {
    gate_.Count(f_, entry);  // no sensor has to recover: Take asked IsDueNext
  }
  return true;
}

template <int N>
bool FastPath::ProcessSized(const Frame& frame) {
  Timestamp elapsed = 0;
  if (f_.health.ended || f_.timestamp == kNoTimestamp || frame.timestamp < f_.timestamp ||
      __builtin_sub_overflow(frame.timestamp, f_.timestamp, &elapsed)) {
    return false;
  }
  if (elapsed > 0) {
    if (f_.motions.in_interval()) return false;  // it keeps no M = Cov(x, w)
    const double dt_s = Seconds(elapsed);
    if (time_.has_inputs()) {
      if (!time_.InputsAct(f_.timestamp, frame.timestamp)) return false;
      time_.UseInputs(f_.timestamp, f_.motions, f_.report.events);
    }
    if (!(dt_s <= time_.max_dt_s()) || !Step<N>(dt_s)) return false;
    f_.timestamp = frame.timestamp;
    f_.motions.CountStep();
  }
  return Update<N>(frame);
}

bool FastPath::Process(const Frame& frame) {
  try {
    return (this->*process_)(frame);
  } catch (...) {  // by a model: the loop asks it again, and names it
    return false;
  }
}

bool FastPath::AddMotions() {
  const Binding& binding = *f_.binding;
  motions_.reserve(binding.motion_places.size());
  for (std::size_t i = 0; i < binding.motion_places.size(); ++i) {
    Motions::Step& step = f_.motions.steps()[i];
    const MotionPlace& place = binding.motion_places[i];
    if (!step.active) continue;
    if (place.parts.size() != 1 || std::ranges::count(place.at, -1) > 0) return false;
    const SharedMotion& model = binding.system.motions[i].model;
    const JacobianPart& part = place.parts[0];
    Motion& motion = motions_.emplace_back(
        Motion{model, &step, {}, {}, part.offset, part.size, model->noise_size()});
    for (const int value : place.values) {
      motion.x.push_back(f_.state.values().data() + value);
      motion.next.push_back(f_.motions.next().data() + value);
    }
  }
  return true;
}

bool FastPath::AddSensors() {
  const Binding& binding = *f_.binding;
  sensors_.reserve(binding.sensor_places.size());  // they hold pointers into themselves
  for (std::size_t k = 0; k < binding.sensor_places.size(); ++k) {
    const SensorPlace& place = binding.sensor_places[k];
    const SensorBinding& bound = binding.system.sensors[k];
    const Geometry& geometry = bound.model->measurement().geometry;
    const bool elsewhere = std::ranges::any_of(bound.roles, [&](const RoleBinding& role) {
      return role.block >= 0 && (role.jacobian_at == JacobianAt::kMeasurement ||
                                 !f_.first_estimates[static_cast<std::size_t>(role.block)].empty());
    });
    if (geometry.kind != GeometryKind::kVector || geometry.tangent > kMostOfOne || !place.whole ||
        elsewhere || bound.model->known_size() > 0 || bound.loss.kind != LossKind::kNone ||
        std::ranges::count(place.consider, true) > 0) {
      return false;
    }
    Sensor& sensor = sensors_.emplace_back(bound.model);
    sensor.index = static_cast<int>(k);
    for (const int value : place.values) {
      sensor.roles.push_back(value < 0 ? nullptr : f_.state.values().data() + value);
    }
    sensor.strides = place.strides;
    for (const JacobianPart& part : place.parts) {
      for (int i = 0; i < geometry.tangent * part.size; ++i) {
        const int at = i / part.size * place.width + part.column + i % part.size;
        sensor.blank[static_cast<std::size_t>(at)] = kNotWritten;
      }
    }
    for (const int column : place.columns) {
      sensor.jacobians.push_back(column < 0 ? nullptr : sensor.H.data() + column);
    }
    sensor.stream = binding.stream_of_sensor[k];
    sensor.rows = geometry.tangent;
    sensor.threshold = gate_.threshold(k);
  }
  return true;
}

std::unique_ptr<FastPath> FastPath::For(FilterState& f, Timeline& time, Gate& gate) {
  const int n = f.size();
  const auto plain = [](const Block& block) {
    return block.has_covariance() && block.geometry().kind == GeometryKind::kVector &&
           block.value_offset == block.tangent_offset;
  };
  if (f.binding->system.landmarks || !IsSmall(f.state.covariance()) || f.blocks.waiting ||
      f.blocks.considering || std::ssize(f.state.values()) != n ||
      !std::ranges::all_of(f.state.layout().blocks(), plain)) {
    return nullptr;
  }
  f.health.last_used.z.reserve(kMostOfOne);
  std::unique_ptr<FastPath> path(new FastPath(f, time, gate));
  if (!path->AddMotions() || !path->AddSensors()) return nullptr;
  const auto choose = [&]<int... I>(std::integer_sequence<int, I...>) {
    ((n == I + 1 ? (path->process_ = &FastPath::ProcessSized<I + 1>, 0) : 0), ...);
  };
  choose(std::make_integer_sequence<int, kSmall>{});
  return path;
}

}  // namespace alidade::internal
