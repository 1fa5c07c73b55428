// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/frame_order.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <tuple>
#include <type_traits>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/accepted_data.h"

namespace alidade::internal {
namespace {

/// Returns the text `; the first is in FILE:LINE`, or "" if the place is unknown.
std::string FirstPlaceText(const Place& place) {
  const std::string text = ToString(Place{place.file, place.line, 0});
  return text.empty() ? "" : "; the first is in " + text;
}

}  // namespace

FrameOrder::FrameOrder(Experiment& experiment, Check check)
    : experiment_(experiment), check_(std::move(check)), guide_(experiment) {
  if (experiment.out_of_sequence.policy != OutOfSequence::kRollback) return;
  for (const EstimatorSpec& spec : experiment.estimators) {
    std::optional<Snapshots>& snapshots = snapshots_.emplace_back();
    if (!spec.estimator->offline()) snapshots.emplace(*spec.estimator);
  }
}

FrameOrder::~FrameOrder() {
  for (std::size_t e = 0; e < snapshots_.size(); ++e) {
    if (!snapshots_[e]) continue;
    experiment_.estimators[e].estimator = std::move(*snapshots_[e]).ReleasedEstimator();
  }
}

bool FrameOrder::Next(SourceFrame& frame) {
  if (experiment_.out_of_sequence.policy == OutOfSequence::kReject) {
    if (!experiment_.source->Next(frame)) return false;
    check_(frame);
    Accept(frame);
    return true;
  }
  while (!is_at_end_ && (buffer_.empty() || !IsTooLate(buffer_.front().frame.timestamp))) {
    try {
      Receive();
    } catch (...) {
      failure_ = std::current_exception();
      is_at_end_ = true;
    }
  }
  if (buffer_.empty()) {
    if (failure_) std::rethrow_exception(failure_);
    return false;
  }
  frame = std::move(buffer_.front().frame);
  buffer_.pop_front();
  for (std::optional<Snapshots>& snapshots : snapshots_) {
    if (snapshots) snapshots->Release();
  }
  return true;
}

const ProcessedFrame* FrameOrder::processed(std::size_t estimator) const {
  if (estimator >= snapshots_.size() || !snapshots_[estimator]) return nullptr;
  return &snapshots_[estimator]->released();
}

/// Returns whether a frame with this timestamp would be older than the window allows if it arrived
/// now.
bool FrameOrder::IsTooLate(Timestamp timestamp) const {
  return experiment_.out_of_sequence.window &&
         Lag(newest_, timestamp) > *experiment_.out_of_sequence.window;
}

/// Counts the frame in the statistics. Returns false if the frame must be dropped.
bool FrameOrder::Accept(const Frame& frame) {
  if (frame.timestamp >= newest_) {
    newest_ = frame.timestamp;
    return true;
  }
  const Timestamp lag = Lag(newest_, frame.timestamp);
  ++arrivals_.out_of_sequence;
  arrivals_.longest_lag = std::max(arrivals_.longest_lag, lag);
  if (!IsTooLate(frame.timestamp)) return true;
  ++arrivals_.dropped;
  events_.push_back({frame.timestamp, EventKind::kOutOfSequence,
                     "a frame " + StreamNames(frame) + "was dropped: it is " + SecondsText(lag) +
                         " older than the newest frame, but the window is only " +
                         SecondsText(*experiment_.out_of_sequence.window)});
  return false;
}

std::string FrameOrder::StreamNames(const Frame& frame) const {
  std::vector<std::string> names;
  for (const Measurement& m : frame.measurements) {
    const std::string& name =
        experiment_.source->streams()[static_cast<std::size_t>(m.stream)].name;
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names.empty() ? "" : "of " + Join(names) + ' ';
}

/// Reads one frame from the source and inserts it into the buffer.
void FrameOrder::Receive() {
  BufferedFrame received;
  is_at_end_ = !experiment_.source->Next(received.frame);
  if (is_at_end_) return;
  check_(received.frame);
  received.places.assign(received.frame.measurements.size(), experiment_.source->place());
  if (!Accept(received.frame)) return;
  const std::size_t index = Insert(std::move(received));
  if (experiment_.out_of_sequence.policy != OutOfSequence::kRollback) return;
  try {
    Replay(index);
  } catch (...) {
    buffer_.resize(index);  // the results of earlier frames are still valid
    throw;
  }
}

/// Inserts the frame into buffer_, or merges it into a buffered frame. Returns the index of the new
/// or merged frame.
std::size_t FrameOrder::Insert(BufferedFrame&& received) {
  const auto timestamp = [](const BufferedFrame& buffered) { return buffered.frame.timestamp; };
  const auto next = std::ranges::lower_bound(buffer_, received.frame.timestamp, {}, timestamp);
  const auto index = static_cast<std::size_t>(next - buffer_.begin());
  if (next == buffer_.end() || next->frame.timestamp != received.frame.timestamp) {
    buffer_.insert(next, std::move(received));
  } else {
    CheckMerge(*next, received.frame);
    Merge(*next, std::move(received));
    ++arrivals_.merged;
  }
  return index;
}

/// Throws if both frames contain a measurement of the same stream and landmark, or different values
/// of the same truth.
void FrameOrder::CheckMerge(const BufferedFrame& buffered, const SourceFrame& part) const {
  const Source& source = *experiment_.source;
  const SourceFrame& merged = buffered.frame;
  const auto fail = [&](const std::string& defect, const std::string& expected) {
    throw Error(ExitCode::kBadData,
                ErrorLine(source.place(), {}, defect + " at t = " + SecondsText(merged.timestamp),
                          expected));
  };
  for (const Measurement& m : part.measurements) {
    const auto is_same = [&](const Measurement& earlier) {
      return earlier.stream == m.stream && earlier.landmark == m.landmark;
    };
    const auto first = std::ranges::find_if(merged.measurements, is_same);
    if (first == merged.measurements.end()) continue;
    const auto index = static_cast<std::size_t>(first - merged.measurements.begin());
    fail("stream '" + source.streams()[static_cast<std::size_t>(m.stream)].name +
             "' has two measurements",
         "one measurement per timestamp" + FirstPlaceText(buffered.places[index]));
  }
  for (std::size_t t = 0; t < std::min(merged.truth.size(), part.truth.size()); ++t) {
    if (part.truth[t].empty() || merged.truth[t].empty() || part.truth[t] == merged.truth[t])
      continue;
    fail("truth '" + source.truths()[t].name + "' has two values", "one value per timestamp");
  }
}

/// Merges the measurements of both frames, and sorts them by the ranks of their streams. Adds the
/// truths that the buffered frame lacks.
void FrameOrder::Merge(BufferedFrame& buffered, BufferedFrame&& received) const {
  SourceFrame &merged = buffered.frame, &part = received.frame;
  const auto key = [this](const Measurement& measurement) {
    const std::vector<int>& ranks = experiment_.out_of_sequence.ranks;
    const auto stream = static_cast<std::size_t>(measurement.stream);
    return std::tuple(stream < ranks.size() ? ranks[stream] : 0, measurement.stream,
                      measurement.landmark);
  };
  std::ranges::move(part.measurements, std::back_inserter(merged.measurements));
  buffered.places.insert(buffered.places.end(), received.places.begin(), received.places.end());
  std::vector<std::size_t> order(merged.measurements.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return key(merged.measurements[i]); });
  const auto apply_order = [&](auto& list) {
    std::remove_reference_t<decltype(list)> ordered;
    for (const std::size_t i : order) ordered.push_back(std::move(list[i]));
    list = std::move(ordered);
  };
  apply_order(merged.measurements);
  apply_order(buffered.places);
  merged.truth.resize(std::max(merged.truth.size(), part.truth.size()));
  for (std::size_t t = 0; t < part.truth.size(); ++t) {
    if (merged.truth[t].empty()) merged.truth[t] = std::move(part.truth[t]);
  }
}

/// Rolls each estimator back to its state before the frame at index `first`, and processes this
/// frame and all later buffered frames again.
void FrameOrder::Replay(std::size_t first) {
  for (std::size_t e = 0; e < experiment_.estimators.size(); ++e) {
    if (!snapshots_[e]) continue;
    EstimatorSpec& spec = experiment_.estimators[e];
    std::vector<Frame> frames;
    for (std::size_t i = first; i < buffer_.size(); ++i) {
      frames.push_back(spec.accepted_by < 0 ? buffer_[i].frame
                                            : AcceptedFrame(i, spec.accepted_by));
    }
    snapshots_[e]->Replace(first, std::move(frames), spec.estimator);
  }
}

/// Returns the buffered frame at `index` with the measurements that `estimator` accepted.
Frame FrameOrder::AcceptedFrame(std::size_t index, int estimator) const {
  const auto filter = static_cast<std::size_t>(estimator);
  const ProcessedFrame& processed = snapshots_[filter]->frames()[index];
  return AcceptedMeasurements(processed.frame, experiment_.source->streams(),
                              experiment_.estimators[filter].problem, processed.report);
}

}  // namespace alidade::internal
