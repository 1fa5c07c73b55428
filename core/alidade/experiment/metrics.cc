// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/base/text.h"
#include "alidade/experiment/frame_innovation.h"
#include "alidade/experiment/implied_state.h"
#include "alidade/experiment/joint_nees.h"
#include "alidade/experiment/similarity.h"
#include "alidade/experiment/time_series.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/model/geometry.h"
#include "alidade/state/element_names.h"

namespace alidade {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kInconsistentSigmas = 10.0;
constexpr int kInconsistentTimestamps = 20;
constexpr double kFarSigmas = 100.0;
constexpr double kFarAngleSigmas = 5.0;

/// Whether the innovation of an angle, which is never beyond pi, looks like one of another unit:
/// far beyond its sigma, and either spread over the circle, or of a measurement beyond a turn.
bool IsFarAngle(const MeasurementReport& m) {
  if (!(m.nis > kFarAngleSigmas * kFarAngleSigmas)) return false;
  if (m.innovation.empty() || m.z.empty()) return false;
  return std::abs(m.innovation[0]) > 0.25 * std::numbers::pi ||
         std::abs(m.z[0]) > 2.0 * std::numbers::pi;
}

}  // namespace

struct Metrics::Impl {
  /// Mean of a quantity, and the share of it that lies inside a bound.
  struct Tally {
    double sum = 0.0;
    std::int64_t count = 0, inside = 0;

    void Add(double value, bool is_inside = false) {
      sum += value;
      ++count;
      inside += is_inside;
    }
    double mean() const { return sum / static_cast<double>(count); }
    double share() const { return static_cast<double>(inside) / static_cast<double>(count); }
  };

  /// Sums over all timestamps, or over those of one segment.
  struct Sums {
    std::string suffix;                   ///< "" or `@SEGMENT`
    std::vector<Tally> squares, covered;  ///< by tracked block
    std::vector<Tally> nees;              ///< by owner
    std::vector<Tally> nis, implied;      ///< by sensor
  };

  /// Estimate and truth of a scalar block over evenly spaced timestamps, for its lag. Only the
  /// first ones are kept, so that memory and time of a long run do not grow with it.
  struct LagSeries {
    static constexpr std::size_t kMost = 100'000;

    std::vector<double> estimate, truth;
    Timestamp first = 0, last = 0;
    Timestamp shortest = INT64_MAX, longest = 0;

    void Add(Timestamp timestamp, double true_value, double error) {
      if (truth.size() == kMost) return;
      if (truth.empty()) {
        first = timestamp;
      } else {
        shortest = std::min(shortest, timestamp - last);
        longest = std::max(longest, timestamp - last);
      }
      last = timestamp;
      truth.push_back(true_value);
      estimate.push_back(true_value - error);
    }
    double step_ms() const {
      return 1e-6 * static_cast<double>(last - first) / static_cast<double>(truth.size() - 1);
    }
    /// Within 5 % of the mean step: what a camera's clock does.
    bool even() const {
      if (truth.size() < 2 || shortest <= 0) return false;
      return 1e-6 * static_cast<double>(longest) < 1.05 * step_ms() &&
             1e-6 * static_cast<double>(shortest) > 0.95 * step_ms();
    }
  };

  /// A block whose truth is known.
  struct Tracked {
    BlockId id;
    std::size_t truth;
    std::string name, unit;
    Geometry geometry;
    std::vector<std::string> elements;  ///< of the tangent
    std::vector<int> outside;  ///< timestamps on end beyond 10 sigma, by element; -1: reported
    bool scalar;
    double truth_variance;  ///< of each element
    LagSeries series;       ///< where scalar
    double last_error = -1.0;

    bool known = false;  ///< at this timestamp, and so is what follows
    Eigen::VectorXd error;
  };

  /// Every n-th value of a series, n so that there are not too many for their autocorrelation.
  struct Thinned {
    static constexpr std::size_t kMost = 10'000;
    std::vector<double> values;
    std::size_t count = 0, stride = 1;

    void Add(double value) {
      if (count++ % stride != 0) return;
      values.push_back(value);
      if (values.size() < kMost) return;
      for (std::size_t i = 0; 2 * i < kMost; ++i) values[i] = values[2 * i];
      values.resize(kMost / 2);
      stride *= 2;
    }
  };

  /// The state that single measurements of a sensor imply, where its truth is known.
  struct Implied {
    internal::ImpliedState state;
    std::size_t truth;
    Geometry geometry;
  };

  struct Owner {
    std::string name;
    std::vector<std::size_t> tracked;
    Thinned nees = {};  ///< per dof
    double dofs = 0.0;  ///< sum over all timestamps
  };

  /// What the bounds of a sensor's NIS need.
  struct Whiteness {
    bool told = false;  ///< its innovations are those of a filter, without a robust loss
    int dof = 0;
    std::int64_t frames = 0, last_frame = -1;  ///< with an accepted measurement
    double cut = kInfinity;                    ///< the least NIS that was gated
  };

  std::vector<Tracked> tracked;
  std::vector<Owner> owners;
  std::vector<std::string> sensors, motions;
  std::map<int, Implied> implied;  ///< by sensor
  bool has_landmarks = false, has_ransac = false;
  std::vector<Tally> far;            ///< inside: far off
  std::vector<bool> angle;           ///< sensors that measure one
  std::vector<Whiteness> whiteness;  ///< by sensor
  std::int64_t reports = 0;
  std::map<int, std::vector<double>> reprojection;  ///< rms of each frame, by sensor
  std::vector<Sums> sums;                           ///< all timestamps, then the segments
  std::vector<std::array<std::int64_t*, kOutcomes.size()>> count_of;  ///< into counts, by sensor
  std::map<std::string, std::int64_t> counts;
  std::map<std::string, std::string> units;
  std::map<int, double> quantiles;  ///< chi2(0.95, dof)
  BlockId path = -1;                ///< that landmarks are seen from
  internal::TrajectoryAlignment alignment;
  std::vector<Event> events;

  void Track(const Problem& problem, const std::vector<StreamInfo>& truths);
  void FindImplied(const Problem& problem, const std::vector<StreamInfo>& truths);
  void AddImplied(const Truth& truth, const std::vector<Sums*>& into, const UpdateReport& report);
  template <class ValueOf>
  void AddErrors(Timestamp timestamp, const Truth& truth, const std::vector<Sums*>& into,
                 const ValueOf& value_of);
  void AddConsistency(Timestamp timestamp, const std::vector<Sums*>& into, const State& state);
  void CheckElement(Timestamp timestamp, Tracked& block, int element, double sigma);
  void AddNees(Owner& owner, std::size_t index, const std::vector<Sums*>& into, const State& state);
  void AddReport(const std::vector<Sums*>& into, const UpdateReport& report);
  void AddInnovation(std::size_t sensor, const MeasurementReport& m);
  /// The sums over all timestamps, and over the segments that a frame is in.
  std::vector<Sums*> SumsOf(const std::vector<bool>& in_segment);
  void Write(const Sums& sums_of, std::map<std::string, double>& metrics) const;
  void WriteBounds(std::map<std::string, double>& metrics) const;
};

namespace {

/// Unit of the error of a block: rad for an orientation or a direction, else the unit of the block.
std::string UnitOfError(const Problem& problem, BlockId id) {
  const Geometry& geometry = problem.layout[id].geometry();
  bool all_angular = true;
  for (int i = 0; i < geometry.tangent; ++i) all_angular = all_angular && geometry.IsAngular(i);
  return all_angular ? "rad" : internal::UnitOf(problem, id);
}

}  // namespace

void Metrics::Impl::Track(const Problem& problem, const std::vector<StreamInfo>& truths) {
  const std::vector<int> match = internal::MatchTruths(problem.layout, truths);
  for (BlockId id = 0; id < static_cast<int>(match.size()); ++id) {
    if (match[id] < 0) continue;
    const Block& block = problem.layout[id];
    Tracked one;
    one.id = id;
    one.truth = static_cast<std::size_t>(match[id]);
    one.name = block.name;
    one.unit = UnitOfError(problem, id);
    one.geometry = block.geometry();
    one.elements = internal::TangentNames(block.name, block.space);
    one.outside.assign(block.geometry().tangent, 0);
    one.scalar = block.geometry().tangent == 1;
    one.truth_variance = truths[one.truth].sigma * truths[one.truth].sigma;
    one.error.resize(block.geometry().tangent);
    if (!one.unit.empty()) units[one.name] = one.unit;
    auto owner = std::find_if(owners.begin(), owners.end(),
                              [&](const Owner& o) { return o.name == block.owner; });
    if (owner == owners.end()) owner = owners.insert(owner, {block.owner, {}});
    owner->tracked.push_back(tracked.size());
    tracked.push_back(std::move(one));
  }
}

void Metrics::Impl::FindImplied(const Problem& problem, const std::vector<StreamInfo>& truths) {
  const std::vector<int> match = internal::MatchTruths(problem.layout, truths);
  for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
    const SensorBinding& sensor = problem.sensors[s];
    const auto state = internal::ImpliedState::Of(problem, sensor, truths);
    if (!state) continue;
    const int truth = match[static_cast<std::size_t>(state->block())];
    if (truth < 0) continue;
    implied.emplace(static_cast<int>(s), Implied{*state, static_cast<std::size_t>(truth),
                                                 problem.layout[state->block()].geometry()});
    const std::string unit = internal::UnitOf(problem, state->block());
    if (!unit.empty()) units.emplace(sensor.name, unit);
  }
}

void Metrics::Impl::AddImplied(const Truth& truth, const std::vector<Sums*>& into,
                               const UpdateReport& report) {
  if (implied.empty()) return;
  for (const MeasurementReport& m : report.measurements()) {
    const auto found = implied.find(m.sensor);
    if (found == implied.end() || m.z.empty()) continue;
    const Implied& one = found->second;
    if (one.truth >= truth.size() || truth[one.truth].empty()) continue;
    const std::optional<double> value = one.state.From(truth, m.z.data());
    if (!value) continue;
    double error = 0.0;
    one.geometry.Minus(truth[one.truth].data(), &*value, &error);
    for (Sums* s : into) s->implied[static_cast<std::size_t>(m.sensor)].Add(error * error);
  }
}

/// value_of(id): the estimate of a block; null: there is none.
template <class ValueOf>
void Metrics::Impl::AddErrors(Timestamp timestamp, const Truth& truth,
                              const std::vector<Sums*>& into, const ValueOf& value_of) {
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    Tracked& block = tracked[i];
    const double* const estimate = value_of(block.id);
    block.known = estimate != nullptr && block.truth < truth.size() && !truth[block.truth].empty();
    if (!block.known) continue;
    const double* const is = truth[block.truth].data();
    // In the tangent at the estimate, where P is.
    block.geometry.Minus(is, estimate, block.error.data());
    const double square = block.error.allFinite() ? block.error.squaredNorm() : kInfinity;
    block.last_error = std::sqrt(square);
    if (block.id == path && std::isfinite(square)) {
      alignment.Add(Eigen::Map<const Eigen::Vector3d>(estimate),
                    Eigen::Map<const Eigen::Vector3d>(is));
    }
    for (Sums* s : into) s->squares[i].Add(square);
    if (!block.scalar) continue;
    double value = is[0];
    if (block.geometry.is_angle() && !block.series.truth.empty()) {
      const double before = block.series.truth.back();  // unwrapped: lag needs no jumps
      value = before + Angle::Wrap(is[0] - before);
    }
    block.series.Add(timestamp, value, block.error[0]);
  }
}

void Metrics::Impl::CheckElement(Timestamp timestamp, Tracked& block, int element, double sigma) {
  int& outside = block.outside[element];
  if (outside < 0) return;
  const double error = std::abs(block.error[element]);
  // A sigma of zero is a value taken as known: its errors are not the filter's.
  const bool inside = sigma == 0.0 || error <= kInconsistentSigmas * sigma;
  outside = inside ? 0 : outside + 1;
  if (outside < kInconsistentTimestamps) return;
  outside = -1;
  const std::string unit = block.unit.empty() ? "" : ' ' + block.unit;
  events.push_back({timestamp, EventKind::kInconsistent,
                    block.elements[element] + ": the error, " + internal::RoundedText(error, 4) +
                        unit + ", has been beyond " + internal::NumberText(kInconsistentSigmas) +
                        " sigma for " + std::to_string(kInconsistentTimestamps) +
                        " timestamps; sigma is " + internal::RoundedText(sigma, 4) + unit});
}

void Metrics::Impl::AddConsistency(Timestamp timestamp, const std::vector<Sums*>& into,
                                   const State& state) {
  constexpr double kNormal95 = 1.959963984540054;
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    Tracked& block = tracked[i];
    const Block& place = state.layout()[block.id];
    if (!block.known || !place.has_covariance()) continue;
    for (int e = 0; e < place.geometry().tangent; ++e) {
      const double sigma =
          std::sqrt(state.covariance().Variance(place.tangent_offset + e) + block.truth_variance);
      CheckElement(timestamp, block, e, sigma);
      if (!block.scalar) continue;
      const bool covered = std::abs(block.error[0]) <= kNormal95 * sigma;
      for (Sums* s : into) s->covered[i].Add(0.0, covered);
    }
  }
  for (std::size_t o = 0; o < owners.size(); ++o) AddNees(owners[o], o, into, state);
}

void Metrics::Impl::AddNees(Owner& owner, std::size_t index, const std::vector<Sums*>& into,
                            const State& state) {
  std::vector<internal::BlockError> errors;
  for (const std::size_t i : owner.tracked) {
    const Tracked& block = tracked[i];
    if (block.known) errors.push_back({block.id, &block.error, block.truth_variance});
  }
  const auto [nees, dof] = internal::JointNees(state, errors);
  if (dof == 0 || std::isnan(nees)) return;
  const auto [bound, is_new] = quantiles.try_emplace(dof, 0.0);
  if (is_new) bound->second = ChiSquareQuantile(0.95, dof);
  for (Sums* s : into) s->nees[index].Add(nees / dof, nees <= bound->second);
  owner.dofs += dof;
  owner.nees.Add(nees / dof);
}

void Metrics::Impl::AddInnovation(std::size_t sensor, const MeasurementReport& m) {
  const bool far_off = m.nis > kFarSigmas * kFarSigmas * m.dof || (angle[sensor] && IsFarAngle(m));
  far[sensor].Add(0.0, far_off);
  Whiteness& white = whiteness[sensor];
  white.dof = m.dof;
  if (m.outcome == Outcome::kGated) {
    if (m.nis > 0.0) white.cut = std::min(white.cut, m.nis);
  } else if (white.last_frame != reports) {
    white.last_frame = reports;
    ++white.frames;
  }
}

void Metrics::Impl::AddReport(const std::vector<Sums*>& into, const UpdateReport& report) {
  ++reports;
  if (has_landmarks) {
    counts["landmarks.initialised"] += report.landmarks.initialised;
    counts["landmarks.deleted"] += report.landmarks.deleted;
    counts["landmarks.converted"] += report.landmarks.converted;
    counts["landmarks.negative"] += report.landmarks.negative;
  }
  if (has_ransac) {
    counts["landmarks.hypotheses"] += report.landmarks.hypotheses;
    counts["landmarks.rescued"] += report.landmarks.rescued;
  }
  for (const MeasurementReport& m : report.measurements()) {
    if (m.sensor < 0 || m.sensor >= static_cast<int>(sensors.size())) continue;
    const auto sensor = static_cast<std::size_t>(m.sensor);
    std::int64_t*& count = count_of[sensor][static_cast<std::size_t>(m.outcome)];
    if (count == nullptr) count = &counts[std::string(ToString(m.outcome)) + ':' + sensors[sensor]];
    ++*count;
    const bool compared = m.outcome == Outcome::kAccepted || m.outcome == Outcome::kGated;
    if (compared && m.dof > 0) AddInnovation(sensor, m);
    if (m.outcome != Outcome::kAccepted || m.dof <= 0 || !std::isfinite(m.nis)) continue;
    for (Sums* s : into) s->nis[sensor].Add(m.nis / m.dof);
  }
  for (auto& [sensor, frames] : reprojection) {
    const double rms = internal::FrameInnovationOf(report, sensor).rms;
    if (std::isfinite(rms)) frames.push_back(rms);
  }
  for (const int motion : report.inputs) {
    ++counts["inputs:" + motions[static_cast<std::size_t>(motion)]];
  }
}

std::vector<Metrics::Impl::Sums*> Metrics::Impl::SumsOf(const std::vector<bool>& in_segment) {
  ALIDADE_EXPECTS(in_segment.size() + 1 == sums.size());
  std::vector<Sums*> into = {&sums[0]};
  for (std::size_t i = 0; i < in_segment.size(); ++i) {
    if (in_segment[i]) into.push_back(&sums[i + 1]);
  }
  return into;
}

void Metrics::Impl::Write(const Sums& s, std::map<std::string, double>& metrics) const {
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    const std::string key = tracked[i].name + s.suffix;
    if (s.squares[i].count > 0) metrics["rmse:" + key] = std::sqrt(s.squares[i].mean());
    if (s.covered[i].count > 0) metrics["coverage95:" + key] = s.covered[i].share();
  }
  for (std::size_t o = 0; o < owners.size(); ++o) {
    if (s.nees[o].count == 0) continue;
    metrics["nees.mean:" + owners[o].name + s.suffix] = s.nees[o].mean();
    metrics["nees.within95:" + owners[o].name + s.suffix] = s.nees[o].share();
  }
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const std::string key = sensors[i] + s.suffix;
    if (s.nis[i].count > 0) metrics["nis.mean:" + key] = s.nis[i].mean();
    if (s.implied[i].count > 0) metrics["implied.rmse:" + key] = std::sqrt(s.implied[i].mean());
  }
}

void Metrics::Impl::WriteBounds(std::map<std::string, double>& metrics) const {
  const auto write = [&](const std::string& kind, const std::string& name, const Interval& bounds) {
    metrics[kind + ".low:" + name] = bounds.low;
    metrics[kind + ".high:" + name] = bounds.high;
  };
  for (std::size_t o = 0; o < owners.size(); ++o) {
    const Owner& owner = owners[o];
    const std::vector<double>& nees = owner.nees.values;
    if (nees.empty()) continue;
    const double dof = owner.dofs / static_cast<double>(sums[0].nees[o].count);
    const double samples = static_cast<double>(nees.size()) / AutocorrelationTime(nees, 1.0);
    write("nees", owner.name, ConsistencyBounds(dof, samples));
    metrics["nees.dof:" + owner.name] = dof;
  }
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const Whiteness& white = whiteness[i];
    if (!white.told || white.frames == 0) continue;
    write("nis", sensors[i],
          ConsistencyBounds(white.dof, static_cast<double>(white.frames), white.cut));
  }
}

Metrics::Metrics(const EstimatorSpec& spec, const std::vector<StreamInfo>& truths,
                 const std::vector<Segment>& segments)
    : impl_(std::make_unique<Impl>()) {
  impl_->Track(spec.problem, truths);
  impl_->FindImplied(spec.problem, truths);
  impl_->sensors = internal::NamesOf(spec.problem.sensors);
  impl_->path = internal::PositionBlockOf(spec.problem);
  impl_->motions = internal::NamesOf(spec.problem.motions);
  impl_->has_landmarks = spec.problem.landmarks.has_value();
  impl_->has_ransac = std::ranges::any_of(
      spec.problem.sensors, [](const SensorBinding& s) { return s.outlier_rejection.has_value(); });
  for (std::size_t s = 0; s < spec.problem.sensors.size(); ++s) {
    if (!internal::HasReprojection(spec.problem.sensors[s])) continue;
    impl_->reprojection[static_cast<int>(s)] = {};
  }
  impl_->count_of.resize(impl_->sensors.size());
  impl_->far.resize(impl_->sensors.size());
  const bool filters = spec.estimator == nullptr || !spec.estimator->offline();
  for (const SensorBinding& sensor : spec.problem.sensors) {
    const Geometry& measured = sensor.model->measurement().geometry;
    impl_->angle.push_back(measured.is_angle());
    impl_->whiteness.emplace_back().told = filters && sensor.loss.kind == LossKind::kNone;
  }
  const auto add_sums = [&](std::string suffix) {
    const std::vector<Impl::Tally> blocks(impl_->tracked.size());
    impl_->sums.push_back({std::move(suffix), blocks, blocks,
                           std::vector<Impl::Tally>(impl_->owners.size()),
                           std::vector<Impl::Tally>(impl_->sensors.size()),
                           std::vector<Impl::Tally>(impl_->sensors.size())});
  };
  add_sums("");
  for (const Segment& segment : segments) add_sums('@' + segment.name);
}

Metrics::~Metrics() = default;
Metrics::Metrics(Metrics&&) noexcept = default;

void Metrics::Add(const SourceFrame& frame, const std::vector<bool>& in_segment, const State& state,
                  const UpdateReport& report) {
  const std::vector<Impl::Sums*> into = impl_->SumsOf(in_segment);
  if (!report.stale) {
    impl_->AddErrors(frame.timestamp, frame.truth, into, [&](BlockId id) {
      return state.layout()[id].present ? state.value(id) : nullptr;
    });
    impl_->AddConsistency(frame.timestamp, into, state);
    impl_->AddImplied(frame.truth, into, report);
  }
  impl_->AddReport(into, report);
}

void Metrics::AddReport(const std::vector<bool>& in_segment, const UpdateReport& report) {
  impl_->AddReport(impl_->SumsOf(in_segment), report);
}

void Metrics::AddDifference(Timestamp timestamp, const std::vector<std::vector<double>>& reference,
                            const std::vector<bool>& in_segment,
                            const std::vector<std::vector<double>>& estimate) {
  const auto value_of = [&](BlockId id) -> const double* {
    const std::vector<double>& value = estimate[static_cast<std::size_t>(id)];
    return value.empty() ? nullptr : value.data();
  };
  impl_->AddErrors(timestamp, reference, impl_->SumsOf(in_segment), value_of);
}

std::vector<std::string> Metrics::without_truth() const {
  std::vector<std::string> names;
  for (const Impl::Tracked& block : impl_->tracked) {
    if (block.last_error < 0.0) names.push_back(block.name);
  }
  return names;
}

std::vector<int> Metrics::far_off() const {
  std::vector<int> sensors;
  for (std::size_t i = 0; i < impl_->far.size(); ++i) {
    const Impl::Tally& far = impl_->far[i];
    if (2 * far.inside > far.count) sensors.push_back(static_cast<int>(i));
  }
  return sensors;
}

const std::vector<Event>& Metrics::events() const { return impl_->events; }

const std::map<std::string, std::int64_t>& Metrics::counts() const { return impl_->counts; }

const std::map<std::string, std::string>& Metrics::units() const { return impl_->units; }

std::map<std::string, double> Metrics::Finish() const {
  std::map<std::string, double> metrics;
  for (const Impl::Sums& sums : impl_->sums) impl_->Write(sums, metrics);
  impl_->WriteBounds(metrics);
  for (const Impl::Tracked& block : impl_->tracked) {
    if (block.last_error >= 0.0) metrics["final_error:" + block.name] = block.last_error;
    if (!block.series.even()) continue;
    const double lag = Lag(block.series.estimate, block.series.truth, block.series.step_ms());
    if (std::isfinite(lag)) metrics["lag_ms:" + block.name] = lag;
  }
  if (const auto aligned = impl_->alignment.Result()) {
    metrics["trajectory.sim3.rmse"] = aligned->rmse;
    metrics["trajectory.sim3.scale"] = aligned->scale;
  }
  for (const auto& [sensor, frames] : impl_->reprojection) {
    const Settling settling = SettlingOf(frames);
    if (std::isnan(settling.level)) continue;
    const std::string& name = impl_->sensors[static_cast<std::size_t>(sensor)];
    metrics["reprojection:" + name] = settling.level;
    metrics["settling_frames:" + name] = settling.count;
  }
  return metrics;
}

}  // namespace alidade
