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
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_table.h"
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
  /// The samples of one metric of one subject.
  struct Accumulator {
    double sum = 0.0, max = 0.0, last = 0.0;
    std::int64_t count = 0;

    void Add(double value) {
      sum += value;
      max = count == 0 ? value : std::max(max, value);
      last = value;
      ++count;
    }
    double Reduce(MetricReduction reduction) const {
      const double mean = sum / static_cast<double>(count);
      switch (reduction) {
        case MetricReduction::kRootMean:
          return std::sqrt(mean);
        case MetricReduction::kMax:
          return max;
        case MetricReduction::kLast:
          return last;
        case MetricReduction::kMean:
          break;
      }
      return mean;
    }
  };

  /// The sampled metrics over all timestamps, or over those of one segment: for each of kMetrics
  /// one accumulator a subject.
  struct Sums {
    std::string segment;
    std::array<std::vector<Accumulator>, kMetrics.size()> metrics;

    /// Adds the sample of subject `index` to each metric that has this member function.
    template <class Sample>
    void Add(std::optional<double> (*MetricInfo::*function)(const Sample&), std::size_t index,
             const Sample& sample) {
      for (std::size_t m = 0; m < kMetrics.size(); ++m) {
        const auto sampled = kMetrics[m].*function;
        if (sampled == nullptr || (!segment.empty() && !kMetrics[m].has_segments)) continue;
        const std::optional<double> value = sampled(sample);
        if (!value) continue;
        if (metrics[m].size() <= index) metrics[m].resize(index + 1);
        metrics[m][index].Add(*value);
      }
    }
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
    bool was_known = false;

    bool known = false;  ///< at this timestamp, and so are the members below
    Eigen::VectorXd error;
    double square;
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
  /// Measurements of a sensor that were accepted or gated, and those of them that are far off.
  struct FarOff {
    std::int64_t count = 0, far = 0;
  };
  std::vector<FarOff> far_off;       ///< by sensor
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
  void FindErrors(Timestamp timestamp, const Truth& truth, const ValueOf& value_of);
  void AddErrors(Timestamp timestamp, const std::vector<Sums*>& into, const State* state);
  void CheckElement(Timestamp timestamp, Tracked& block, int element, double sigma);
  void AddNees(Owner& owner, std::size_t index, const std::vector<Sums*>& into, const State& state);
  void AddReport(const std::vector<Sums*>& into, const UpdateReport& report);
  void AddInnovation(std::size_t sensor, const MeasurementReport& m);
  /// The sums over all timestamps, and over the segments that a frame is in.
  std::vector<Sums*> SumsOf(const std::vector<bool>& in_segment);
  const std::string& SubjectOf(const MetricInfo& metric, std::size_t index) const;
  void Write(const Sums& sums_of, std::map<std::string, double>& metrics) const;
  void WriteBounds(std::map<std::string, double>& metrics) const;
};

namespace {

/// Unit of the error of a block: rad for an orientation or a direction, else the unit of the block.
std::string UnitOfError(const Problem& problem, BlockId id) {
  return problem.layout[id].geometry().is_angular() ? "rad" : internal::UnitOf(problem, id);
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
    const Implied& state = found->second;
    if (state.truth >= truth.size() || truth[state.truth].empty()) continue;
    const std::optional<double> value = state.state.From(truth, m.z.data());
    if (!value) continue;
    double error = 0.0;
    state.geometry.Minus(truth[state.truth].data(), &*value, &error);
    for (Sums* sums_of : into) {
      sums_of->Add<ImpliedSample>(&MetricInfo::implied, static_cast<std::size_t>(m.sensor),
                                  {error * error});
    }
  }
}

/// Computes the error of each tracked block. value_of(id) is the estimate of a block, or null.
template <class ValueOf>
void Metrics::Impl::FindErrors(Timestamp timestamp, const Truth& truth, const ValueOf& value_of) {
  for (Tracked& block : tracked) {
    const double* const estimate = value_of(block.id);
    block.known = estimate != nullptr && block.truth < truth.size() && !truth[block.truth].empty();
    if (!block.known) continue;
    const double* const is = truth[block.truth].data();
    // In the tangent at the estimate, where P is.
    block.geometry.Minus(is, estimate, block.error.data());
    block.square = block.error.allFinite() ? block.error.squaredNorm() : kInfinity;
    block.was_known = true;
    if (block.id == path && std::isfinite(block.square)) {
      alignment.Add(Eigen::Map<const Eigen::Vector3d>(estimate),
                    Eigen::Map<const Eigen::Vector3d>(is));
    }
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

/// Adds the errors that FindErrors found. `state` has the covariance; null: it is unknown.
void Metrics::Impl::AddErrors(Timestamp timestamp, const std::vector<Sums*>& into,
                              const State* state) {
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    Tracked& block = tracked[i];
    if (!block.known) continue;
    std::optional<double> sigma;
    const Block* const place = state == nullptr ? nullptr : &state->layout()[block.id];
    for (int e = 0; place != nullptr && place->has_covariance() && e < block.geometry.tangent;
         ++e) {
      sigma =
          std::sqrt(state->covariance().Variance(place->tangent_offset + e) + block.truth_variance);
      CheckElement(timestamp, block, e, *sigma);
    }
    if (!block.scalar) sigma.reset();
    for (Sums* sums_of : into) {
      sums_of->Add<BlockSample>(&MetricInfo::block, i, {block.square, block.error[0], sigma});
    }
  }
  if (state == nullptr) return;
  for (std::size_t o = 0; o < owners.size(); ++o) AddNees(owners[o], o, into, *state);
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
  for (Sums* sums_of : into) {
    sums_of->Add<OwnerSample>(&MetricInfo::owner, index, {nees, dof, bound->second});
  }
  owner.nees.Add(nees / dof);
}

void Metrics::Impl::AddInnovation(std::size_t sensor, const MeasurementReport& m) {
  ++far_off[sensor].count;
  far_off[sensor].far +=
      m.nis > kFarSigmas * kFarSigmas * m.dof || (angle[sensor] && IsFarAngle(m));
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
    if (count == nullptr)
      count = &counts[MetricKey{ToString(m.outcome), sensors[sensor], ""}.text()];
    ++*count;
    const bool compared = m.outcome == Outcome::kAccepted || m.outcome == Outcome::kGated;
    if (compared && m.dof > 0) AddInnovation(sensor, m);
    if (m.outcome != Outcome::kAccepted || m.dof <= 0 || !std::isfinite(m.nis)) continue;
    for (Sums* sums_of : into) {
      sums_of->Add<SensorSample>(&MetricInfo::sensor, sensor, {m.nis, m.dof});
    }
  }
  for (auto& [sensor, frames] : reprojection) {
    const double rms = internal::FrameInnovationOf(report, sensor).rms;
    if (std::isfinite(rms)) frames.push_back(rms);
  }
  for (const int motion : report.inputs) {
    ++counts[MetricKey{"inputs", motions[static_cast<std::size_t>(motion)], ""}.text()];
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

/// The name of subject `index` of a metric.
const std::string& Metrics::Impl::SubjectOf(const MetricInfo& metric, std::size_t index) const {
  switch (metric.subject) {
    case MetricSubject::kOwner:
      return owners[index].name;
    case MetricSubject::kSensor:
      return sensors[index];
    case MetricSubject::kBlock:
    case MetricSubject::kRun:
      break;
  }
  return tracked[index].name;
}

void Metrics::Impl::Write(const Sums& sums_of, std::map<std::string, double>& metrics) const {
  for (std::size_t m = 0; m < kMetrics.size(); ++m) {
    const MetricInfo& metric = kMetrics[m];
    for (std::size_t i = 0; i < sums_of.metrics[m].size(); ++i) {
      const Accumulator& accumulator = sums_of.metrics[m][i];
      if (accumulator.count == 0) continue;
      metrics[MetricKey{metric.name, SubjectOf(metric, i), sums_of.segment}.text()] =
          accumulator.Reduce(metric.reduction);
    }
  }
}

void Metrics::Impl::WriteBounds(std::map<std::string, double>& metrics) const {
  const auto write = [&](const std::string& kind, const std::string& name, const Interval& bounds) {
    metrics[MetricKey{kind + ".low", name, ""}.text()] = bounds.low;
    metrics[MetricKey{kind + ".high", name, ""}.text()] = bounds.high;
  };
  for (std::size_t o = 0; o < owners.size(); ++o) {
    const Owner& owner = owners[o];
    const std::vector<double>& nees = owner.nees.values;
    if (nees.empty()) continue;
    const double dof = metrics.at(MetricKey{"nees.dof", owner.name, ""}.text());
    const double samples = static_cast<double>(nees.size()) / AutocorrelationTime(nees, 1.0);
    write("nees", owner.name, ConsistencyBounds(dof, samples));
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
  impl_->far_off.resize(impl_->sensors.size());
  const bool filters = spec.estimator == nullptr || !spec.estimator->offline();
  for (const SensorBinding& sensor : spec.problem.sensors) {
    const Geometry& measured = sensor.model->measurement().geometry;
    impl_->angle.push_back(measured.is_angle());
    impl_->whiteness.emplace_back().told = filters && sensor.loss.kind == LossKind::kNone;
  }
  impl_->sums.resize(1 + segments.size());
  for (std::size_t i = 0; i < segments.size(); ++i) impl_->sums[i + 1].segment = segments[i].name;
}

Metrics::~Metrics() = default;
Metrics::Metrics(Metrics&&) noexcept = default;

void Metrics::Add(const SourceFrame& frame, const std::vector<bool>& in_segment, const State& state,
                  const UpdateReport& report) {
  const std::vector<Impl::Sums*> into = impl_->SumsOf(in_segment);
  if (!report.stale) {
    impl_->FindErrors(frame.timestamp, frame.truth, [&](BlockId id) {
      return state.layout()[id].present ? state.value(id) : nullptr;
    });
    impl_->AddErrors(frame.timestamp, into, &state);
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
  impl_->FindErrors(timestamp, reference, value_of);
  impl_->AddErrors(timestamp, impl_->SumsOf(in_segment), nullptr);
}

std::vector<std::string> Metrics::without_truth() const {
  std::vector<std::string> names;
  for (const Impl::Tracked& block : impl_->tracked) {
    if (!block.was_known) names.push_back(block.name);
  }
  return names;
}

std::vector<int> Metrics::far_off() const {
  std::vector<int> sensors;
  for (std::size_t i = 0; i < impl_->far_off.size(); ++i) {
    const Impl::FarOff& far_off = impl_->far_off[i];
    if (2 * far_off.far > far_off.count) sensors.push_back(static_cast<int>(i));
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
    if (!block.series.even()) continue;
    const double lag = Lag(block.series.estimate, block.series.truth, block.series.step_ms());
    if (std::isfinite(lag)) metrics[MetricKey{"lag_ms", block.name, ""}.text()] = lag;
  }
  if (const auto aligned = impl_->alignment.Result()) {
    metrics["trajectory.sim3.rmse"] = aligned->rmse;
    metrics["trajectory.sim3.scale"] = aligned->scale;
  }
  for (const auto& [sensor, frames] : impl_->reprojection) {
    const Settling settling = SettlingOf(frames);
    if (std::isnan(settling.level)) continue;
    const std::string& name = impl_->sensors[static_cast<std::size_t>(sensor)];
    metrics[MetricKey{"reprojection", name, ""}.text()] = settling.level;
    metrics[MetricKey{"settling_frames", name, ""}.text()] = settling.count;
  }
  return metrics;
}

}  // namespace alidade
