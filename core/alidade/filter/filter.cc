// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/filter.h"

#include <algorithm>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/words.h"
#include "alidade/filter/consensus.h"
#include "alidade/filter/evaluate_models.h"
#include "alidade/filter/fast_path.h"
#include "alidade/filter/first_values.h"
#include "alidade/filter/gate.h"
#include "alidade/filter/landmarks.h"
#include "alidade/filter/linear.h"
#include "alidade/filter/method.h"
#include "alidade/filter/recovery.h"
#include "alidade/filter/timeline.h"

namespace alidade {

using internal::Binding;
using internal::Consensus;
using internal::FastParts;
using internal::FastPath;
using internal::FilterState;
using internal::Gate;
using internal::Landmarks;
using internal::Method;
using internal::Recovery;
using internal::Row;
using internal::Rows;
using internal::Timeline;
using internal::Trouble;

namespace {

/// A method by value.
class AnyMethod {
 public:
  explicit AnyMethod(std::unique_ptr<Method> method) : method_(std::move(method)) {}
  AnyMethod(const AnyMethod& other) : method_(other.method_->Clone()) {}
  AnyMethod& operator=(const AnyMethod& other) {
    method_ = other.method_->Clone();
    return *this;
  }
  Method& operator*() const { return *method_; }
  Method* operator->() const { return method_.get(); }

 private:
  std::unique_ptr<Method> method_;
};

/// The fast path, as long as the blocks are those that it was made for.
struct CurrentPath {
  std::unique_ptr<FastPath> path;
  int made_at = -1;  ///< FilterState::activations
};

/// One group of rows, and what becomes of it.
struct Groups {
  std::vector<Row*> group, passed, agreed, rest;
};

}  // namespace

/// What a filter is made of. No part points into another: a copy is a filter by itself.
struct Filter::Parts {
  Parts(System system, const EkfOptions& of, std::vector<StreamInfo> from,
        std::unique_ptr<Method> by)
      : options(of),
        streams(std::move(from)),
        f(std::make_shared<const Binding>(std::move(system), streams),
          options.jacobian == JacobianPolicy::kFirstEstimate),
        time(f.binding->system, streams, options.max_dt_s),
        gate(f.binding->system, options.gate),
        consensus(f.binding->system),
        recovery(f.binding->system, options),
        method(std::move(by)) {
    if (f.binding->system.landmarks) {
      landmarks.emplace(*f.binding);
      landmarks->AddKnown(f);
    }
    method->Begin(f);
  }

  void Process(const Frame& frame);
  void Run(const Frame& frame);
  void StepTo(Timestamp timestamp);
  void Fuse(std::span<Row> rows);
  void Update(std::span<Row* const> group);
  void Pass(std::span<Row* const> group, std::vector<Row*>& passed);
  void Correct(std::span<Row* const> rows);
  FastPath* Fast();

  EkfOptions options;
  std::vector<StreamInfo> streams;
  FilterState f;
  Timeline time;
  Gate gate;
  Consensus consensus;
  Recovery recovery;
  std::optional<Landmarks> landmarks;
  AnyMethod method;
  Scratch<Rows> rows;
  Scratch<Groups> groups;
  Scratch<CurrentPath> fast;
  bool took_fast_path = false;
};

/// Null where the frame loop is the only way.
FastPath* Filter::Parts::Fast() {
  if (fast.made_at != f.activations) {
    const bool linear = dynamic_cast<const internal::Linear*>(&*method) != nullptr;
    fast.path = linear ? FastPath::For(FastParts{f, time, gate, recovery, options}) : nullptr;
    fast.made_at = f.activations;
  }
  return fast.path.get();
}

void Filter::Parts::Process(const Frame& frame) {
  f.report.Clear();
  FastPath* const path = Fast();
  took_fast_path = path != nullptr && path->Process(frame);
  if (!took_fast_path) Run(frame);
  if (!time.inputs().empty()) time.inputs().Take(frame, f.report);
}

/// What a frame goes through.
void Filter::Parts::Run(const Frame& frame) {
  if (f.timestamp == kNoTimestamp) {
    const std::optional<double>& initial = f.binding->system.initial_time_s;
    f.timestamp = initial ? TimestampFromSeconds(*initial) : frame.timestamp;
  }
  f.report.stale = frame.timestamp < f.timestamp;
  if (!f.report.stale && !f.ended) StepTo(frame.timestamp);
  for (Event& event : f.report.events)
    event.timestamp = frame.timestamp;  // also where it fell short
  rows.Collect(frame, *f.binding, f.report);
  const std::span<Row> all = rows.all();
  for (const Row& row : all) {
    if (row.report->outcome == Outcome::kFailed) f.NotePluginFailure(*row.binding);
  }
  if (f.report.stale || f.ended) {
    for (const Row& row : all) {
      row.report->outcome = f.report.stale ? Outcome::kStale : Outcome::kFailed;
    }
    return;
  }
  if (f.waiting) internal::InitialiseWaiting(f, all);
  if (landmarks) landmarks->Attach(f, all);
  Fuse(all);
  recovery.RepairCovariance(f, all);
  recovery.CountRejections(f, all);
  if (landmarks) landmarks->KeepHouse(f, all);
}

/// Moves the state to `timestamp`; where a step cannot be done it stays at the end of the one
/// before, and the filter has ended.
void Filter::Parts::StepTo(Timestamp timestamp) {
  while (f.timestamp < timestamp) {
    time.UseInputs(f.timestamp, f.motions, f.report.events);
    Timeline::Piece piece;
    Trouble trouble = time.First(f.timestamp, timestamp, f.report.events, piece);
    for (Timestamp i = 1; i <= piece.steps && !trouble; ++i) {
      trouble = method->Step(f, piece.dt_s);
      if (trouble) break;
      f.motions.CountStep();
      f.timestamp = piece.EndOf(i);
    }
    if (trouble) return f.End(trouble.kind, trouble.text);
  }
}

/// The updates of a frame, group by group.
void Filter::Parts::Fuse(std::span<Row> all) {
  std::vector<Row*>& group = groups.group;
  group.clear();
  for (Row& row : all) {
    if (row.report->outcome != Outcome::kAccepted) continue;
    const bool apart =
        options.fuse == Fuse::kPerMeasurement ||
        (options.fuse == Fuse::kPerSensor && !group.empty() && group.back()->sensor != row.sensor);
    if (apart) {
      Update(group);
      group.clear();
    }
    group.push_back(&row);
  }
  Update(group);
}

/// One update by those of a group that pass; with a consensus a second one by those that it rescues.
void Filter::Parts::Update(std::span<Row* const> group) {
  Pass(group, groups.passed);
  if (!landmarks || !Consensus::IsAsked(groups.passed)) return Correct(groups.passed);
  groups.agreed.clear();
  groups.rest.clear();
  consensus.Split(f, groups.passed, static_cast<std::uint64_t>(landmarks->frame()), groups.agreed,
                  groups.rest);
  Correct(groups.agreed);
  Pass(groups.rest, groups.passed);
  std::erase_if(groups.passed, [&](const Row* row) {
    if (consensus.Rescues(*row)) return false;
    row->report->outcome = Outcome::kGated;
    return true;
  });
  f.report.landmarks.rescued += static_cast<int>(groups.passed.size());
  Correct(groups.passed);
}

/// Predicts all rows of a group at the state, and finds those that pass the gate, each by itself.
void Filter::Parts::Pass(std::span<Row* const> group, std::vector<Row*>& passed) {
  passed.clear();
  for (Row* const row : group) {
    Outcome& outcome = row->report->outcome;
    outcome = method->Predict(f, *row);
    if (outcome == Outcome::kAccepted) outcome = gate.Pass(f, *row);
    if (outcome == Outcome::kAccepted) passed.push_back(row);
  }
}

void Filter::Parts::Correct(std::span<Row* const> rows_of_update) {
  if (rows_of_update.empty()) return;
  for (Row* const row : rows_of_update) Gate::Weigh(*row);
  const Outcome outcome = method->Correct(f, rows_of_update);
  for (const Row* const row : rows_of_update) row->report->outcome = outcome;
}

Filter::Filter(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams,
               std::unique_ptr<Method> method)
    : parts_(std::make_unique<Parts>(std::move(system), options, streams, std::move(method))) {}
Filter::Filter(const Filter& other) : parts_(std::make_unique<Parts>(*other.parts_)) {}
Filter& Filter::operator=(const Filter& other) {
  *parts_ = *other.parts_;
  return *this;
}
Filter::Filter(Filter&& other) noexcept = default;
Filter& Filter::operator=(Filter&& other) noexcept = default;
Filter::~Filter() = default;

void Filter::Start(Timestamp timestamp) { parts_->f.timestamp = timestamp; }

const UpdateReport& Filter::Process(const Frame& frame) {
  parts_->Process(frame);
  return parts_->f.report;
}

const System& Filter::system() const { return parts_->f.binding->system; }
const State& Filter::state() const { return parts_->f.state; }
Timestamp Filter::timestamp() const { return parts_->f.timestamp; }
bool Filter::diverged() const { return parts_->f.diverged; }
bool Filter::failed() const { return parts_->f.ended; }
Method& Filter::method() { return *parts_->method; }
bool Filter::took_fast_path() const { return parts_->took_fast_path; }
const Method& Filter::method() const { return *parts_->method; }
FilterState& Filter::internals() { return parts_->f; }
const FilterState& Filter::internals() const { return parts_->f; }

std::vector<LandmarkEstimate> Filter::landmarks() const {
  if (!parts_->landmarks) return {};
  return parts_->landmarks->Estimates(parts_->f.state);
}

namespace {

[[noreturn]] void RefuseName(const char* what, std::string_view name,
                             const std::vector<std::string>& known) {
  throw Error(ExitCode::kBadConfig, "no " + std::string(what) + " '" + std::string(name) +
                                        "'; the filter has " + internal::Join(known));
}

}  // namespace

int Filter::stream(std::string_view name) const {
  std::vector<std::string> known;
  for (std::size_t i = 0; i < parts_->streams.size(); ++i) {
    if (parts_->streams[i].name == name) return static_cast<int>(i);
    known.push_back(parts_->streams[i].name);
  }
  RefuseName("stream", name, known);
}

BlockId Filter::block(std::string_view name) const {
  const BlockId id = parts_->f.state.layout().Find(name);
  if (id >= 0) return id;
  std::vector<std::string> known;
  for (const Block& block : parts_->f.state.layout().blocks()) known.push_back(block.name);
  RefuseName("block", name, known);
}

const UpdateReport& Filter::Push(Timestamp timestamp, const std::vector<Reading>& readings) {
  Frame frame;
  frame.timestamp = timestamp;
  for (const Reading& one : readings) {
    frame.measurements.push_back({timestamp, one.stream, one.landmark, one.values, one.covariance});
  }
  return Process(frame);
}

State Filter::At(Timestamp timestamp) const {
  Parts later(*parts_);
  Frame frame;
  frame.timestamp = timestamp;
  later.Process(frame);
  return later.f.state;
}

std::optional<Prediction> Filter::Expect(std::string_view sensor, Timestamp timestamp,
                                         std::int64_t landmark) const {
  const System& system = parts_->f.binding->system;
  const int index = system.FindSensor(sensor);
  if (index < 0) {
    std::vector<std::string> known;
    for (const SensorBinding& one : system.sensors) known.push_back(one.name);
    RefuseName("sensor", sensor, known);
  }
  Parts later(*parts_);
  Frame frame;
  frame.timestamp = timestamp;
  later.Process(frame);
  if (later.f.ended || later.f.report.stale) return std::nullopt;
  const SensorModel& model = system.sensors[static_cast<std::size_t>(index)].model;
  Measurement& one = frame.measurements.emplace_back();
  one.timestamp = timestamp;
  one.stream = later.f.binding->stream_of_sensor[static_cast<std::size_t>(index)];
  one.landmark = landmark;
  one.values.resize(static_cast<std::size_t>(model.measurement().geometry.ambient));
  model.measurement().geometry.Identity(one.values.data());
  later.rows.Collect(frame, *later.f.binding, later.f.report);
  for (Row& row : later.rows.all()) {
    if (row.sensor != index) continue;
    row.report->outcome = Outcome::kAccepted;  // whatever Valid says of no measurement
    if (later.landmarks) later.landmarks->Attach(later.f, {&row, 1});
    if (row.report->outcome != Outcome::kAccepted || !internal::IsReady(later.f, row) ||
        row.model->Predict(internal::RolesAt(later.f, row, later.f.state.values()),
                           one.values.data()) != Status::kOk) {
      return std::nullopt;
    }
    row.report->z = one.values;  // as if it measured what it expects
    if (later.method->Predict(later.f, row) != Outcome::kAccepted) return std::nullopt;
    const Eigen::Index m = row.report->dof;
    return Prediction{row.report->h, Eigen::Map<const RowMajor>(row.report->s.data(), m, m)};
  }
  return std::nullopt;
}

}  // namespace alidade
