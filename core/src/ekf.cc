// SPDX-License-Identifier: Apache-2.0
#include "alidade/ekf.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "alidade/metrics.h"

namespace alidade {
Outcome OutcomeOf(Status status) {
  switch (status) {
    case Status::kOk:
      return Outcome::kAccepted;
    case Status::kOutOfDomain:
      return Outcome::kOutOfDomain;
    case Status::kInvalid:
      return Outcome::kInvalid;
    case Status::kError:
      break;
  }
  return Outcome::kFailed;
}

const char* ToString(Outcome outcome) {
  constexpr const char* kNames[] = {"accepted",  "initialised", "gated",  "out_of_domain",
                                    "invalid",   "not_finite",  "not_pd", "stale",
                                    "not_ready", "failed"};
  return kNames[static_cast<int>(outcome)];
}

Ekf::Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams)
    : system_(std::move(system)),
      options_(options),
      sensors_of_stream_(streams.size()),
      state_(system_.InitialState()),
      rejections_(system_.sensors.size(), 0),
      inflated_(system_.sensors.size(), false),
      warned_(system_.sensors.size(), false) {
  for (const SensorBinding& sensor : system_.sensors) {
    gate_threshold_.push_back(
        options_.gate < 1.0
            ? ChiSquareQuantile(options_.gate, sensor.model.measurement().geometry.tangent)
            : std::numeric_limits<double>::infinity());
  }
  for (std::size_t i = 0; i < system_.sensors.size(); ++i) {
    for (std::size_t s = 0; s < streams.size(); ++s) {
      if (streams[s].name != system_.sensors[i].stream) continue;
      ALIDADE_EXPECTS(streams[s].size == system_.sensors[i].model.measurement().geometry.ambient);
      sensors_of_stream_[s].push_back(static_cast<int>(i));
    }
  }
}

bool AllFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

void Ekf::Start(Stamp stamp) { stamp_ = stamp; }

UpdateReport Ekf::Process(const Frame& frame) {
  UpdateReport report;
  if (stamp_ == kNoStamp) {
    Start(system_.start_s ? StampFromSeconds(*system_.start_s) : frame.stamp);
  }
  report.stale = frame.stamp < stamp_;
  if (!report.stale) StepTo(frame.stamp, report);
  for (Event& event : report.events) event.stamp = frame.stamp;  // also where it stays behind
  std::vector<Row> rows = Collect(frame, report);
  if (report.stale || failed_) {
    for (MeasurementReport& entry : report.measurements) {
      entry.outcome = report.stale ? Outcome::kStale : Outcome::kFailed;
    }
    return report;
  }
  InitialiseFrom(rows, report);
  std::vector<Row*> together;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (report.measurements[rows[i].report].outcome != Outcome::kAccepted) continue;
    const bool apart = options_.fuse == Fuse::kPerMeasurement ||
                       (options_.fuse == Fuse::kPerSensor && !together.empty() &&
                        together.back()->sensor != rows[i].sensor);
    if (apart) {
      FuseRows(together, report);
      together.clear();
    }
    together.push_back(&rows[i]);
  }
  FuseRows(together, report);
  CountRejections(rows, report);
  return report;
}

/// One row for each measurement and sensor bound to its stream, in the order of the sensors.
std::vector<Ekf::Row> Ekf::Collect(const Frame& frame, UpdateReport& report) {
  std::vector<Row> rows;
  for (const Measurement& m : frame.measurements) {
    ALIDADE_EXPECTS(m.stream >= 0 && m.stream < std::ssize(sensors_of_stream_));
    for (const int sensor : sensors_of_stream_[static_cast<std::size_t>(m.stream)]) {
      rows.push_back({&m, sensor, 0, {}, {}, {}, {}, {}});
    }
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.sensor < b.sensor; });
  for (Row& row : rows) {
    const SensorBinding& binding = BindingOf(row);
    const Geometry& geometry = binding.model.measurement().geometry;
    ALIDADE_EXPECTS(std::ssize(row.measurement->values) == geometry.ambient);
    ALIDADE_EXPECTS(row.measurement->covariance.empty() ||
                    std::ssize(row.measurement->covariance) == geometry.tangent * geometry.tangent);
    row.report = report.measurements.size();
    MeasurementReport& entry = report.measurements.emplace_back();
    entry.sensor = row.sensor;
    entry.landmark = row.measurement->landmark;
    entry.dof = geometry.tangent;
    entry.z = row.measurement->values;
    entry.outcome =
        AllFinite(entry.z) ? OutcomeOf(binding.model.Valid(entry.z.data())) : Outcome::kNotFinite;
    if (entry.outcome == Outcome::kFailed) NotePluginFailure(binding, report);
  }
  return rows;
}

/// Moves the state to `stamp`, in equal parts of at most max_dt_s. Where a part cannot be done the
/// state stays at the end of the one before.
void Ekf::StepTo(Stamp stamp, UpdateReport& report) {
  constexpr double kMostParts = 1e6;
  Stamp elapsed = 0;
  const bool overflow = __builtin_sub_overflow(stamp, stamp_, &elapsed);
  const double dt_s = Seconds(elapsed), parts = std::ceil(dt_s / options_.max_dt_s);
  if (elapsed == 0) return;
  if (overflow || parts > kMostParts) {
    char text[128];
    std::snprintf(text, sizeof(text), "a gap of %.6g s would need more than %g steps of %g s", dt_s,
                  kMostParts, options_.max_dt_s);
    return GiveUp(report, "gap", text);
  }
  const std::int64_t count = std::max<std::int64_t>(1, static_cast<std::int64_t>(parts));
  const Stamp start = stamp_;
  for (std::int64_t i = 1; i <= count; ++i) {
    if (!StepOnce(dt_s / static_cast<double>(count), report)) return;
    stamp_ = i == count ? stamp : start + elapsed / count * i;
  }
}

/// One step of all motion models: all of it happens or nothing.
bool Ekf::StepOnce(double dt_s, UpdateReport& report) {
  std::vector<Move> moves;
  for (const MotionBinding& motion : system_.motions) {
    if (!StepModel(motion, dt_s, moves, report)) return false;
  }
  for (const Move& move : moves) {
    state_.covariance().Propagate(move.segments, move.f, move.q);
  }
  for (int i = 0; i < state_.covariance().size(); ++i) {
    if (std::isfinite(state_.covariance().Variance(i))) continue;
    GiveUp(report, "not_finite", "the covariance steps to what is not finite");
    return false;
  }
  for (const Move& move : moves) {
    for (const auto& [id, value] : move.next)
      std::copy(value.begin(), value.end(), state_.value(id));
  }
  return true;
}

/// What one motion model makes of its blocks, added to `moves`. Fixed blocks stay; a model with a
/// block that has no value yet waits. False where the filter cannot go on.
bool Ekf::StepModel(const MotionBinding& motion, double dt_s, std::vector<Move>& moves,
                    UpdateReport& report) {
  const int n = motion.model.tangent_size(), n_w = motion.model.noise_size();
  std::vector<const double*> x;
  std::vector<std::vector<double>> next;
  std::vector<double*> y;
  std::vector<Eigen::Index> rows;  // of F that have a covariance
  Move move;
  int row = 0;
  for (const BlockId id : motion.blocks) {
    const Block& block = state_.layout()[id];
    if (!block.present) return true;
    const int size = block.geometry().tangent;
    x.push_back(state_.value(id));
    next.emplace_back(block.geometry().ambient);
    if (block.has_covariance()) {
      move.segments.emplace_back(block.tangent_offset, size);
      for (int i = 0; i < size; ++i) rows.push_back(row + i);
    }
    row += size;
  }
  for (std::vector<double>& value : next) y.push_back(value.data());
  RowMajor f = RowMajor::Constant(n, n, std::nan("")), g = RowMajor::Constant(n, n_w, std::nan(""));
  RowMajor l = RowMajor::Zero(n_w, n_w);
  Status status = motion.model.Step(x.data(), nullptr, nullptr, dt_s, y.data(), f.data(), g.data());
  if (status == Status::kOk) status = motion.model.SqrtQ(x.data(), dt_s, l.data());
  if (status != Status::kOk) {
    GiveUp(report, status == Status::kError ? "plugin_failed" : "diverged",
           "motion model of '" + motion.name + "' cannot step: " +
               (status == Status::kError ? motion.model.error_text() : "out of its domain"));
    return false;
  }
  const RowMajor gl = g * l;
  move.f = f(rows, rows);
  move.q = (gl * gl.transpose())(rows, rows);
  if (!move.f.allFinite() || !move.q.allFinite() ||
      !std::all_of(next.begin(), next.end(), AllFinite)) {
    GiveUp(report, "not_finite",
           "motion model of '" + motion.name + "' steps to a state that is not finite");
    return false;
  }
  for (std::size_t i = 0; i < next.size(); ++i) {
    if (state_.layout()[motion.blocks[i]].status == BlockStatus::kFixed) continue;
    move.next.emplace_back(motion.blocks[i], std::move(next[i]));
  }
  moves.push_back(std::move(move));
  return true;
}

void Ekf::NotePluginFailure(const SensorBinding& sensor, UpdateReport& report) const {
  Note(report, "plugin_failed", "sensor '" + sensor.name + "': " + sensor.model.error_text());
}

void Ekf::Note(UpdateReport& report, const char* kind, std::string text) const {
  report.events.push_back({stamp_, kind, std::move(text)});
}

/// `block = value, ...` for the given blocks that have one.
std::string Ekf::Describe(const std::vector<BlockId>& blocks) const {
  std::string text;
  char number[32];
  for (const BlockId id : blocks) {
    if (id < 0 || !state_.layout()[id].present) continue;
    const Block& block = state_.layout()[id];
    text += (text.empty() ? "" : ", ") + block.name + " =";
    for (int i = 0; i < block.geometry().ambient; ++i) {
      std::snprintf(number, sizeof(number), " %.6g", state_.value(id)[i]);
      text += number;
    }
  }
  return text;
}

/// Ends the filter: what happened, the state that is left, the measurement that led there.
void Ekf::GiveUp(UpdateReport& report, const char* kind, const std::string& what) {
  failed_ = diverged_ = true;
  std::vector<BlockId> all(state_.layout().blocks().size());
  std::iota(all.begin(), all.end(), 0);
  char at[48];
  std::snprintf(at, sizeof(at), "; last good state at %.6f s: ", Seconds(stamp_));
  std::string text = what + at + Describe(all);
  if (last_used_.sensor >= 0) {
    std::snprintf(at, sizeof(at), " at %.6f s", Seconds(last_used_.stamp));
    text += "; last measurement used: sensor '" +
            system_.sensors[static_cast<std::size_t>(last_used_.sensor)].name + "'" + at + ", z =";
    for (const double z : last_used_.z) {
      char number[32];
      std::snprintf(number, sizeof(number), " %.6g", z);
      text += number;
    }
  }
  Note(report, kind, text);
}

}  // namespace alidade
