// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/base/text.h"
#include "alidade/diagnosis/time_series.h"
#include "alidade/experiment/frame_innovation.h"
#include "alidade/experiment/implied_state.h"
#include "alidade/experiment/joint_nees.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/experiment/similarity.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/model/geometry.h"
#include "alidade/state/dense_algebra.h"
#include "alidade/state/element_names.h"

namespace alidade {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLostSigmas = 10.0;
constexpr int kLostTimestamps = 20;

}  // namespace

struct Metrics::Impl {
  /// Sums of the samples of one metric for one subject.
  struct Accumulator {
    double sum = 0.0, last = 0.0;
    std::int64_t count = 0;

    void Add(double value) {
      sum += value;
      last = value;
      ++count;
    }
    double Reduce(MetricReduction reduction) const {
      const double mean = sum / static_cast<double>(count);
      switch (reduction) {
        case MetricReduction::kRootMean:
          return std::sqrt(mean);
        case MetricReduction::kSum:
          return sum;
        case MetricReduction::kLast:
          return last;
        case MetricReduction::kMean:
          break;
      }
      return mean;
    }
  };

  /// Accumulators of the sampled metrics over one period, which is the whole run or one segment.
  /// Each entry of kMetrics has one accumulator for each subject.
  struct PeriodSums {
    std::string segment;  ///< "": the whole run
    std::array<std::vector<Accumulator>, kMetrics.size()> metrics;

    /// Adds the sample of subject `index` to each metric that has a sample function of this kind.
    template <class Sample>
    void Add(std::optional<double> (*MetricInfo::*function)(const Sample&), std::size_t index,
             const Sample& sample) {
      static const std::vector<std::size_t> sampled = [&] {  // depends only on Sample
        std::vector<std::size_t> metrics_of_type;
        for (std::size_t m = 0; m < kMetrics.size(); ++m) {
          if (kMetrics[m].*function != nullptr) metrics_of_type.push_back(m);
        }
        return metrics_of_type;
      }();
      for (const std::size_t m : sampled) {
        if (!segment.empty() && !kMetrics[m].has_segments) continue;
        const std::optional<double> value = (kMetrics[m].*function)(sample);
        if (!value) continue;
        if (metrics[m].size() <= index) metrics[m].resize(index + 1);
        metrics[m][index].Add(*value);
      }
    }
  };

  /// Estimate and truth of a scalar block over evenly spaced timestamps, from which its lag is
  /// computed. Retains only the first kMaxSize values, to limit memory and computing time.
  struct LagSeries {
    static constexpr std::size_t kMaxSize = 100'000;

    std::vector<double> estimate, truth;
    Timestamp first = 0, last = 0;
    Timestamp shortest_step = INT64_MAX, longest_step = 0;

    void Add(Timestamp timestamp, double true_value, double error) {
      if (truth.size() == kMaxSize) return;
      if (truth.empty()) {
        first = timestamp;
      } else {
        shortest_step = std::min(shortest_step, timestamp - last);
        longest_step = std::max(longest_step, timestamp - last);
      }
      last = timestamp;
      truth.push_back(true_value);
      estimate.push_back(true_value - error);
    }
    double step_ms() const {
      return 1e-6 * static_cast<double>(last - first) / static_cast<double>(truth.size() - 1);
    }
    /// Returns true if all time steps are within 5 % of their mean.
    bool is_even() const {
      if (truth.size() < 2 || shortest_step <= 0) return false;
      return 1e-6 * static_cast<double>(longest_step) < 1.05 * step_ms() &&
             1e-6 * static_cast<double>(shortest_step) > 0.95 * step_ms();
    }
  };

  /// Block whose truth the source provides.
  struct TrackedBlock {
    BlockId id;
    std::size_t truth;  ///< index into the truths
    std::string name, unit;
    Geometry geometry;
    std::vector<std::string> elements;  ///< names of the tangent elements
    /// Number of timestamps in a row at which the error of an element exceeded 10 sigma, for each
    /// element. -1 means that the event was already reported.
    std::vector<int> outside_counts;
    bool is_scalar;
    double truth_variance;  ///< variance of each element of the truth
    double prior_sigma;     ///< largest sigma of its prior; 0: it has none
    LagSeries series;       ///< used only for a scalar block
    bool was_ever_known = false;

    // Values at the current timestamp. `error` and `squared_error` are valid only if `is_known` is
    // true.
    bool is_known = false;
    Eigen::VectorXd error;
    double squared_error;
  };

  /// Every n-th value of a series. The stride n grows so that fewer than kMaxSize values are
  /// stored. This limits the cost of computing the autocorrelation of the series.
  struct ThinnedSeries {
    static constexpr std::size_t kMaxSize = 10'000;
    std::vector<double> values;
    std::size_t count = 0, stride = 1;

    void Add(double value) {
      if (count++ % stride != 0) return;
      values.push_back(value);
      if (values.size() < kMaxSize) return;
      for (std::size_t i = 0; 2 * i < kMaxSize; ++i) values[i] = values[2 * i];
      values.resize(kMaxSize / 2);
      stride *= 2;
    }
  };

  /// State that single measurements of a sensor imply. The source provides the truth of this state.
  struct ImpliedBlock {
    internal::ImpliedState state;
    std::size_t truth;  ///< index into the truths
    Geometry geometry;
  };

  struct Owner {
    std::string name;
    std::vector<std::size_t> blocks;  ///< indices into tracked_blocks
    ThinnedSeries nees = {};          ///< NEES divided by its dof
    std::int64_t dof_sum = 0, count = 0;
  };

  /// Data for the NIS bounds of a sensor.
  struct NisSamples {
    bool has_bounds = false;  ///< true if a filter without a robust loss provides the innovations
    int dof = 0;
    std::int64_t frames = 0, last_frame = -1;  ///< count and index of frames with accepted data
    double smallest_gated = kInfinity;         ///< smallest NIS of a gated measurement
  };

  std::vector<TrackedBlock> tracked_blocks;
  std::vector<Owner> owners;
  std::vector<std::string> sensors, motions;   ///< names of sensors and motion models
  std::map<int, ImpliedBlock> implied_blocks;  ///< key: index of the sensor
  bool has_landmarks = false, has_ransac = false;
  std::vector<NisSamples> nis_samples;  ///< one element per sensor
  std::int64_t report_count = 0;
  std::map<int, std::vector<double>> reprojection;  ///< rms of each frame, by sensor
  std::vector<PeriodSums> periods;  ///< element 0 is the whole run; the segments follow
  /// Pointers into `counts`, by sensor and outcome; null before the first measurement.
  std::vector<std::array<std::int64_t*, kOutcomes.size()>> outcome_counts;
  std::map<std::string, std::int64_t> counts;
  std::map<std::string, std::string> units;
  std::map<int, double> quantiles;  ///< chi2(0.95, dof), by dof
  BlockId position_block = -1;      ///< position from which landmarks are observed; -1: none
  internal::TrajectoryAlignment alignment;
  std::vector<Event> events;

  void TrackBlocks(const Problem& problem, const std::vector<StreamInfo>& truths);
  void FindImpliedBlocks(const Problem& problem, const std::vector<StreamInfo>& truths);
  void AddImplied(const Truth& truth, const std::vector<PeriodSums*>& destinations,
                  const UpdateReport& report);
  template <class ValueOf>
  void ComputeErrors(Timestamp timestamp, const Truth& truth, const ValueOf& value_of);
  void AddErrors(Timestamp timestamp, const std::vector<PeriodSums*>& destinations,
                 const State* state);
  void CheckElement(Timestamp timestamp, TrackedBlock& block, int element, double sigma);
  void AddNees(Owner& owner, std::size_t index, const std::vector<PeriodSums*>& destinations,
               const State& state);
  void AddReport(const std::vector<PeriodSums*>& destinations, const UpdateReport& report);
  void AddInnovation(std::size_t sensor, const MeasurementReport& measurement);
  /// Returns the accumulators of the whole run, and of each segment that contains the frame.
  std::vector<PeriodSums*> PeriodsOf(const std::vector<bool>& in_segment);
  const std::string& SubjectOf(const MetricInfo& metric, std::size_t index) const;
  void Write(const PeriodSums& sums, std::map<std::string, double>& metrics) const;
  void WriteBounds(std::map<std::string, double>& metrics) const;
};

namespace {

/// Returns the unit of the error of a block: rad for an orientation or a direction, else the unit
/// of the block.
std::string UnitOfError(const Problem& problem, BlockId id) {
  return problem.layout[id].geometry().is_angular() ? "rad" : internal::UnitOf(problem, id);
}

}  // namespace

void Metrics::Impl::TrackBlocks(const Problem& problem, const std::vector<StreamInfo>& truths) {
  const std::vector<int> match = internal::MatchTruths(problem.layout, truths);
  for (BlockId id = 0; id < static_cast<int>(match.size()); ++id) {
    if (match[id] < 0) continue;
    const Block& block = problem.layout[id];
    TrackedBlock tracked_block;
    tracked_block.id = id;
    tracked_block.truth = static_cast<std::size_t>(match[id]);
    tracked_block.name = block.name;
    tracked_block.unit = UnitOfError(problem, id);
    tracked_block.geometry = block.geometry();
    tracked_block.elements = internal::TangentNames(block.name, block.space);
    tracked_block.outside_counts.assign(block.geometry().tangent, 0);
    tracked_block.is_scalar = block.geometry().tangent == 1;
    tracked_block.truth_variance =
        truths[tracked_block.truth].sigma * truths[tracked_block.truth].sigma;
    tracked_block.prior_sigma = internal::LargestPriorSigma(problem, id);
    tracked_block.error.resize(block.geometry().tangent);
    if (!tracked_block.unit.empty()) units[tracked_block.name] = tracked_block.unit;
    auto owner = std::find_if(owners.begin(), owners.end(),
                              [&](const Owner& o) { return o.name == block.owner; });
    if (owner == owners.end()) owner = owners.insert(owner, {block.owner, {}});
    owner->blocks.push_back(tracked_blocks.size());
    tracked_blocks.push_back(std::move(tracked_block));
  }
}

void Metrics::Impl::FindImpliedBlocks(const Problem& problem,
                                      const std::vector<StreamInfo>& truths) {
  const std::vector<int> match = internal::MatchTruths(problem.layout, truths);
  for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
    const SensorBinding& sensor = problem.sensors[s];
    const auto state = internal::ImpliedState::Of(problem, sensor, truths);
    if (!state) continue;
    const int truth = match[static_cast<std::size_t>(state->block())];
    if (truth < 0) continue;
    implied_blocks.emplace(static_cast<int>(s),
                           ImpliedBlock{*state, static_cast<std::size_t>(truth),
                                        problem.layout[state->block()].geometry()});
    const std::string unit = internal::UnitOf(problem, state->block());
    if (!unit.empty()) units.emplace(sensor.name, unit);
  }
}

void Metrics::Impl::AddImplied(const Truth& truth, const std::vector<PeriodSums*>& destinations,
                               const UpdateReport& report) {
  if (implied_blocks.empty()) return;
  for (const MeasurementReport& measurement : report.measurements()) {
    const auto found = implied_blocks.find(measurement.sensor);
    if (found == implied_blocks.end() || measurement.z.empty()) continue;
    const ImpliedBlock& block = found->second;
    if (block.truth >= truth.size() || truth[block.truth].empty()) continue;
    const std::optional<double> value = block.state.From(truth, measurement.z.data());
    if (!value) continue;
    double error = 0.0;
    block.geometry.Minus(truth[block.truth].data(), &*value, &error);
    for (PeriodSums* sums : destinations) {
      sums->Add<ImpliedSample>(&MetricInfo::implied, static_cast<std::size_t>(measurement.sensor),
                               {error * error});
    }
  }
}

/// Computes the error of each tracked block. value_of(id) returns the estimate of a block, or null.
template <class ValueOf>
void Metrics::Impl::ComputeErrors(Timestamp timestamp, const Truth& truth,
                                  const ValueOf& value_of) {
  for (TrackedBlock& block : tracked_blocks) {
    const double* const estimate = value_of(block.id);
    block.is_known =
        estimate != nullptr && block.truth < truth.size() && !truth[block.truth].empty();
    if (!block.is_known) continue;
    const double* const true_value = truth[block.truth].data();
    // The error is in the tangent space at the estimate, like P.
    block.geometry.Minus(true_value, estimate, block.error.data());
    block.squared_error = block.error.allFinite() ? block.error.squaredNorm() : kInfinity;
    block.was_ever_known = true;
    if (block.id == position_block && std::isfinite(block.squared_error)) {
      alignment.Add(Eigen::Map<const Eigen::Vector3d>(estimate),
                    Eigen::Map<const Eigen::Vector3d>(true_value));
    }
    if (!block.is_scalar) continue;
    double unwrapped = true_value[0];
    if (block.geometry.is_angle() && !block.series.truth.empty()) {
      // The lag requires a series without jumps of 2 pi.
      const double previous = block.series.truth.back();
      unwrapped = previous + Angle::Wrap(true_value[0] - previous);
    }
    block.series.Add(timestamp, unwrapped, block.error[0]);
  }
}

void Metrics::Impl::CheckElement(Timestamp timestamp, TrackedBlock& block, int element,
                                 double sigma) {
  int& outside_count = block.outside_counts[element];
  if (outside_count < 0) return;
  const double error = std::abs(block.error[element]);
  // If sigma is zero but for rounding errors, the filter assumes that the value is known.
  const bool is_known = !(sigma > internal::kSmallestSigma * block.prior_sigma);
  const bool is_inside = is_known || error <= kLostSigmas * sigma;
  outside_count = is_inside ? 0 : outside_count + 1;
  if (outside_count < kLostTimestamps) return;
  outside_count = -1;
  const std::string unit = block.unit.empty() ? "" : ' ' + block.unit;
  events.push_back({timestamp, EventKind::kLost,
                    block.elements[element] + ": the error, " + internal::RoundedText(error, 4) +
                        unit + ", exceeded " + internal::NumberText(kLostSigmas) + " sigma for " +
                        std::to_string(kLostTimestamps) + " timestamps in a row; sigma is " +
                        internal::RoundedText(sigma, 4) + unit});
}

/// Adds the errors that ComputeErrors computed. `state` provides the covariance; null means that
/// the covariance is unknown.
void Metrics::Impl::AddErrors(Timestamp timestamp, const std::vector<PeriodSums*>& destinations,
                              const State* state) {
  for (std::size_t i = 0; i < tracked_blocks.size(); ++i) {
    TrackedBlock& block = tracked_blocks[i];
    if (!block.is_known) continue;
    std::optional<double> sigma;
    const Block* const state_block = state == nullptr ? nullptr : &state->layout()[block.id];
    for (int e = 0;
         state_block != nullptr && state_block->has_covariance() && e < block.geometry.tangent;
         ++e) {
      sigma = std::sqrt(state->covariance().Variance(state_block->tangent_offset + e) +
                        block.truth_variance);
      CheckElement(timestamp, block, e, *sigma);
    }
    if (!block.is_scalar) sigma.reset();
    for (PeriodSums* sums : destinations) {
      sums->Add<BlockSample>(&MetricInfo::block, i, {block.squared_error, block.error[0], sigma});
    }
  }
  if (state == nullptr) return;
  for (std::size_t o = 0; o < owners.size(); ++o) AddNees(owners[o], o, destinations, *state);
}

void Metrics::Impl::AddNees(Owner& owner, std::size_t index,
                            const std::vector<PeriodSums*>& destinations, const State& state) {
  std::vector<internal::BlockError> errors;
  for (const std::size_t i : owner.blocks) {
    const TrackedBlock& block = tracked_blocks[i];
    if (block.is_known)
      errors.push_back({block.id, &block.error, block.truth_variance, block.prior_sigma});
  }
  const auto [nees, dof] = internal::JointNees(state, errors);
  if (dof == 0 || std::isnan(nees)) return;
  const auto [bound, is_new] = quantiles.try_emplace(dof, 0.0);
  if (is_new) bound->second = ChiSquareQuantile(0.95, dof);
  for (PeriodSums* sums : destinations) {
    sums->Add<OwnerSample>(&MetricInfo::owner, index, {nees, dof, bound->second});
  }
  owner.nees.Add(nees / dof);
  owner.dof_sum += dof;
  ++owner.count;
}

void Metrics::Impl::AddInnovation(std::size_t sensor, const MeasurementReport& measurement) {
  NisSamples& samples = nis_samples[sensor];
  samples.dof = measurement.dof;
  if (measurement.outcome == Outcome::kGated) {
    if (measurement.nis > 0.0) {
      samples.smallest_gated = std::min(samples.smallest_gated, measurement.nis);
    }
  } else if (samples.last_frame != report_count) {
    samples.last_frame = report_count;
    ++samples.frames;
  }
}

void Metrics::Impl::AddReport(const std::vector<PeriodSums*>& destinations,
                              const UpdateReport& report) {
  ++report_count;
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
  for (const MeasurementReport& measurement : report.measurements()) {
    if (measurement.sensor < 0 || measurement.sensor >= static_cast<int>(sensors.size())) continue;
    const auto sensor = static_cast<std::size_t>(measurement.sensor);
    std::int64_t*& count = outcome_counts[sensor][static_cast<std::size_t>(measurement.outcome)];
    if (count == nullptr)
      count = &counts[MetricKey{ToString(measurement.outcome), sensors[sensor], ""}.text()];
    ++*count;
    const bool is_accepted = measurement.outcome == Outcome::kAccepted;
    if ((!is_accepted && measurement.outcome != Outcome::kGated) || measurement.dof <= 0) continue;
    AddInnovation(sensor, measurement);
    if (!std::isfinite(measurement.nis)) continue;
    const double log_det_s = internal::LogDeterminant(measurement.s, measurement.dof);
    for (PeriodSums* sums : destinations) {
      sums->Add<SensorSample>(&MetricInfo::sensor, sensor,
                              {measurement.nis, measurement.dof, log_det_s, is_accepted});
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

std::vector<Metrics::Impl::PeriodSums*> Metrics::Impl::PeriodsOf(
    const std::vector<bool>& in_segment) {
  ALIDADE_EXPECTS(in_segment.size() + 1 == periods.size());
  std::vector<PeriodSums*> destinations = {&periods[0]};
  for (std::size_t i = 0; i < in_segment.size(); ++i) {
    if (in_segment[i]) destinations.push_back(&periods[i + 1]);
  }
  return destinations;
}

/// Returns the name of subject `index` of a metric.
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
  return tracked_blocks[index].name;
}

void Metrics::Impl::Write(const PeriodSums& sums, std::map<std::string, double>& metrics) const {
  for (std::size_t m = 0; m < kMetrics.size(); ++m) {
    const MetricInfo& metric = kMetrics[m];
    for (std::size_t i = 0; i < sums.metrics[m].size(); ++i) {
      const Accumulator& accumulator = sums.metrics[m][i];
      if (accumulator.count == 0) continue;
      metrics[MetricKey{metric.name, SubjectOf(metric, i), sums.segment}.text()] =
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
    const double independent = static_cast<double>(nees.size()) / AutocorrelationTime(nees, 1.0);
    write("nees", owner.name, ConsistencyBounds(dof, independent));
  }
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const NisSamples& samples = nis_samples[i];
    if (!samples.has_bounds || samples.frames == 0) continue;
    write("nis", sensors[i],
          ConsistencyBounds(samples.dof, static_cast<double>(samples.frames),
                            samples.smallest_gated));
  }
}

Metrics::Metrics(const EstimatorSpec& spec, const std::vector<StreamInfo>& truths,
                 const std::vector<Segment>& segments)
    : impl_(std::make_unique<Impl>()) {
  impl_->TrackBlocks(spec.problem, truths);
  impl_->FindImpliedBlocks(spec.problem, truths);
  impl_->sensors = internal::NamesOf(spec.problem.sensors);
  impl_->position_block = internal::PositionBlockOf(spec.problem);
  impl_->motions = internal::NamesOf(spec.problem.motions);
  impl_->has_landmarks = spec.problem.landmarks.has_value();
  impl_->has_ransac = std::ranges::any_of(
      spec.problem.sensors, [](const SensorBinding& s) { return s.outlier_rejection.has_value(); });
  for (std::size_t s = 0; s < spec.problem.sensors.size(); ++s) {
    if (!internal::HasReprojection(spec.problem.sensors[s])) continue;
    impl_->reprojection[static_cast<int>(s)] = {};
  }
  impl_->outcome_counts.resize(impl_->sensors.size());
  const bool is_filter = spec.estimator == nullptr || !spec.estimator->offline();
  for (const SensorBinding& sensor : spec.problem.sensors) {
    impl_->nis_samples.emplace_back().has_bounds = is_filter && sensor.loss.kind == LossKind::kNone;
  }
  impl_->periods.resize(1 + segments.size());
  for (std::size_t i = 0; i < segments.size(); ++i)
    impl_->periods[i + 1].segment = segments[i].name;
}

Metrics::~Metrics() = default;
Metrics::Metrics(Metrics&&) noexcept = default;

void Metrics::Add(const SourceFrame& frame, const std::vector<bool>& in_segment, const State& state,
                  const UpdateReport& report) {
  const std::vector<Impl::PeriodSums*> destinations = impl_->PeriodsOf(in_segment);
  if (!report.stale) {
    impl_->ComputeErrors(frame.timestamp, frame.truth, [&](BlockId id) {
      return state.layout()[id].present ? state.value(id) : nullptr;
    });
    impl_->AddErrors(frame.timestamp, destinations, &state);
    impl_->AddImplied(frame.truth, destinations, report);
  }
  impl_->AddReport(destinations, report);
}

void Metrics::AddReport(const std::vector<bool>& in_segment, const UpdateReport& report) {
  impl_->AddReport(impl_->PeriodsOf(in_segment), report);
}

void Metrics::AddDifference(Timestamp timestamp, const std::vector<std::vector<double>>& reference,
                            const std::vector<bool>& in_segment,
                            const std::vector<std::vector<double>>& estimate) {
  const auto value_of = [&](BlockId id) -> const double* {
    const std::vector<double>& value = estimate[static_cast<std::size_t>(id)];
    return value.empty() ? nullptr : value.data();
  };
  impl_->ComputeErrors(timestamp, reference, value_of);
  impl_->AddErrors(timestamp, impl_->PeriodsOf(in_segment), nullptr);
}

std::vector<std::string> Metrics::blocks_without_truth() const {
  std::vector<std::string> names;
  for (const Impl::TrackedBlock& block : impl_->tracked_blocks) {
    if (!block.was_ever_known) names.push_back(block.name);
  }
  return names;
}

const std::vector<Event>& Metrics::events() const { return impl_->events; }

std::vector<NeesSeries> Metrics::nees() const {
  std::vector<NeesSeries> series;
  for (const Impl::Owner& owner : impl_->owners) {
    if (owner.count == 0) continue;
    series.push_back({owner.name,
                      static_cast<double>(owner.dof_sum) / static_cast<double>(owner.count),
                      owner.nees.values});
  }
  return series;
}

const std::map<std::string, std::int64_t>& Metrics::counts() const { return impl_->counts; }

const std::map<std::string, std::string>& Metrics::units() const { return impl_->units; }

std::map<std::string, double> Metrics::Finish() const {
  std::map<std::string, double> metrics;
  for (const Impl::PeriodSums& sums : impl_->periods) impl_->Write(sums, metrics);
  impl_->WriteBounds(metrics);
  for (const Impl::TrackedBlock& block : impl_->tracked_blocks) {
    if (!block.series.is_even()) continue;
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
