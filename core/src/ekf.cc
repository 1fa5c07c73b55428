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

EkfOptions EkfOptions::FromNode(const Node& entry) {
  EkfOptions options;
  if (const auto gate = entry.Find("gate")) options.gate = gate->Number(0.0, 1.0, true);
  if (const auto fuse = entry.Find("fuse")) {
    options.fuse =
        static_cast<alidade::Fuse>(fuse->Choice({"joint", "per_sensor", "per_measurement"}));
  }
  if (const auto dt = entry.Find("max_dt_s")) {
    options.max_dt_s = dt->Number(0.0, std::numeric_limits<double>::infinity(), true);
  }
  if (const auto lockout = entry.Find("lockout")) {
    if (const auto after = lockout->Find("after")) {
      options.lockout_after = static_cast<int>(after->Integer(1, 1'000'000));
    }
    if (const auto action = lockout->Find("action")) {
      options.lockout = static_cast<Lockout>(action->Choice({"reset", "inflate", "none"}));
    }
    lockout->RejectUnread();
  }
  return options;
}

Ekf::Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams)
    : system_(std::move(system)),
      options_(options),
      sensors_of_stream_(streams.size()),
      state_(system_.InitialState()),
      rejections_(system_.sensors.size(), 0),
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

void Ekf::Start(Stamp stamp) { stamp_ = stamp; }

UpdateReport Ekf::Process(const Frame& frame) {
  UpdateReport report;
  if (stamp_ == kNoStamp) {
    Start(system_.start_s ? StampFromSeconds(*system_.start_s) : frame.stamp);
  }
  const bool stale = frame.stamp < stamp_;
  if (!stale) StepTo(frame.stamp, report);
  std::vector<Row> rows = Collect(frame, report);
  if (stale || failed_) {
    for (MeasurementReport& entry : report.measurements) {
      entry.outcome = stale ? Outcome::kStale : Outcome::kFailed;
    }
    return report;
  }
  InitialiseFrom(rows, report);
  std::vector<Row*> together;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (report.measurements[rows[i].report].outcome != Outcome::kAccepted) continue;
    together.push_back(&rows[i]);
    const bool last_of_sensor = i + 1 == rows.size() || rows[i + 1].sensor != rows[i].sensor;
    if (options_.fuse == Fuse::kPerMeasurement ||
        (options_.fuse == Fuse::kPerSensor && last_of_sensor)) {
      FuseRows(together, report);
      together.clear();
    }
  }
  FuseRows(together, report);
  CountRejections(rows, report);
  return report;
}

/// One row for each measurement and sensor bound to its stream, in the order of the sensors.
std::vector<Ekf::Row> Ekf::Collect(const Frame& frame, UpdateReport& report) {
  std::vector<Row> rows;
  for (const Measurement& m : frame.measurements) {
    for (const int sensor : sensors_of_stream_[static_cast<std::size_t>(m.stream)]) {
      rows.push_back({&m, sensor, 0, {}, {}, {}, {}, {}});
    }
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.sensor < b.sensor; });
  for (Row& row : rows) {
    const SensorBinding& binding = system_.sensors[static_cast<std::size_t>(row.sensor)];
    row.report = report.measurements.size();
    MeasurementReport& entry = report.measurements.emplace_back();
    entry.sensor = row.sensor;
    entry.landmark = row.measurement->landmark;
    entry.dof = binding.model.measurement().geometry.tangent;
    entry.z = row.measurement->values;
    const bool finite =
        std::all_of(entry.z.begin(), entry.z.end(), [](double v) { return std::isfinite(v); });
    entry.outcome = finite ? OutcomeOf(binding.model.Valid(entry.z.data())) : Outcome::kNotFinite;
  }
  return rows;
}

void Ekf::StepTo(Stamp stamp, UpdateReport& report) {
  const double dt_s = Seconds(stamp - stamp_);
  if (!(dt_s > 0.0)) return;
  const double parts = std::ceil(dt_s / options_.max_dt_s);
  const int count = parts > 1.0 ? static_cast<int>(parts) : 1;
  for (int i = 0; i < count && !failed_; ++i) {
    for (const MotionBinding& motion : system_.motions) {
      if (!StepModel(motion, dt_s / count, report)) break;
    }
  }
  if (!failed_) stamp_ = stamp;
}

/// Moves the blocks of one motion model. Fixed blocks stay; a model with a block that has no value
/// yet waits. False where the filter cannot go on.
bool Ekf::StepModel(const MotionBinding& motion, double dt_s, UpdateReport& report) {
  const int n = motion.model.tangent_size(), n_w = motion.model.noise_size();
  std::vector<const double*> x;
  std::vector<std::vector<double>> next;
  std::vector<double*> y;
  std::vector<std::pair<int, int>> segments;
  std::vector<Eigen::Index> rows;  // of F that have a covariance
  int row = 0;
  for (const BlockId id : motion.blocks) {
    const Block& block = state_.layout()[id];
    if (!block.present) return true;
    x.push_back(state_.value(id));
    next.emplace_back(block.geometry().ambient);
    if (block.has_covariance())
      segments.emplace_back(block.tangent_offset, block.geometry().tangent);
    for (int i = 0; i < block.geometry().tangent; ++i, ++row) {
      if (block.has_covariance()) rows.push_back(row);
    }
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
  const Eigen::MatrixXd f_used = f(rows, rows), q_used = (gl * gl.transpose())(rows, rows);
  bool finite = f_used.allFinite() && q_used.allFinite();
  for (const auto& value : next) {
    for (const double v : value) finite = finite && std::isfinite(v);
  }
  if (!finite) {
    GiveUp(report, "not_finite",
           "motion model of '" + motion.name + "' steps to a state that is not finite");
    return false;
  }
  state_.covariance().Propagate(segments, f_used, q_used);
  for (std::size_t i = 0; i < next.size(); ++i) {
    if (state_.layout()[motion.blocks[i]].status == BlockStatus::kFixed) continue;
    std::copy(next[i].begin(), next[i].end(), state_.value(motion.blocks[i]));
  }
  return true;
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
