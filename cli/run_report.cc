// SPDX-License-Identifier: Apache-2.0
#include "run_report.h"

#include <algorithm>
#include <functional>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/metric_rows.h"

namespace alidade::cli {
namespace {

/// Events of one estimator that have the same kind.
struct EventGroup {
  EventKind kind;
  std::vector<const Event*> events;
};

std::vector<EventGroup> Group(const std::vector<Event>& events) {
  std::vector<EventGroup> groups;
  for (const Event& event : events) {
    const auto same = [&](const EventGroup& group) { return group.kind == event.kind; };
    auto group = std::find_if(groups.begin(), groups.end(), same);
    if (group == groups.end()) group = groups.insert(group, {event.kind, {}});
    group->events.push_back(&event);
  }
  return groups;
}

std::string EventLine(const Event& event) {
  if (event.timestamp == kNoTimestamp) return event.text;
  std::ostringstream line;
  line.imbue(std::locale::classic());
  line << "t = " << std::fixed << std::setprecision(3) << Seconds(event.timestamp) << " s: ";
  return line.str() + event.text;
}

/// Returns a summary of the estimators' events, with a few lines for each kind of event.
std::string EventSummary(const RunResult& result) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (const EstimatorResult& estimator : result.estimators) {
    for (const EventGroup& group : Group(estimator.events)) {
      const std::size_t count = group.events.size();
      text += estimator.name + ": " + ToString(group.kind);
      if (count > 1) text += ", " + std::to_string(count) + " times";
      text += '\n';
      for (std::size_t i = 0; i < std::min(count, kShown); ++i) {
        text += "  " + EventLine(*group.events[i]) + '\n';
      }
      if (count > kShown) {
        text += "  ... and " + std::to_string(count - kShown) + " more, in " + estimator.name +
                "/events.csv\n";
      }
    }
  }
  return text;
}

/// Verdict and reason that several estimators share.
struct SharedVerdict {
  VerdictState state;
  std::string reason;
  std::vector<std::string> names;
};

/// Returns the first clause of the reason. A consistent estimator needs a reason only if it has a
/// finding.
std::string ShortReason(const Verdict& verdict) {
  constexpr std::string_view kBut = "; but ";
  const std::string& because = verdict.because;
  if (verdict.state != VerdictState::kConsistent) return because.substr(0, because.find("; "));
  const std::size_t but = because.find(kBut);
  if (but == std::string::npos) return "";
  const std::size_t begin = but + kBut.size();
  return "but " + because.substr(begin, because.find("; ", begin) - begin);
}

/// Returns a line for each verdict, with all estimators that have it for the same reason.
std::string ShortVerdicts(const RunResult& result) {
  std::vector<SharedVerdict> verdicts;
  std::size_t width = 0;
  for (const EstimatorResult& estimator : result.estimators) {
    const std::string reason = ShortReason(estimator.verdict);
    auto same = std::ranges::find_if(verdicts, [&](const SharedVerdict& verdict) {
      return verdict.state == estimator.verdict.state && verdict.reason == reason;
    });
    if (same == verdicts.end()) {
      same = verdicts.insert(same, {estimator.verdict.state, reason, {}});
    }
    same->names.push_back(estimator.name + (estimator.expects_poor ? " (poor is expected)" : ""));
    width = std::max(width, std::string_view(ToString(estimator.verdict.state)).size());
  }
  std::string text;
  for (const SharedVerdict& verdict : verdicts) {
    std::string state = ToString(verdict.state);
    state.resize(width + 2, ' ');
    text += state + internal::Join(verdict.names) +
            (verdict.reason.empty() ? "" : ": " + verdict.reason) + '\n';
  }
  return text;
}

std::size_t CountLines(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

/// Events of one kind and with the same first event, of several estimators.
struct SharedEvents {
  EventKind kind;
  std::string line;
  std::size_t count;
  std::vector<std::string> names;
};

/// Returns a line for each kind of warning or error of the estimators, errors first. Omits events
/// that the verdicts contain, and those of estimators that have ended or diverged.
std::vector<std::string> WarningLines(const RunResult& result) {
  std::vector<SharedEvents> shared;
  for (const EstimatorResult& estimator : result.estimators) {
    if (estimator.failed || estimator.diverged) continue;
    for (const EventGroup& group : Group(estimator.events)) {
      const Event& first = *group.events.front();
      const bool is_known = estimator.verdict.because.starts_with(first.text);
      if (is_known || InfoOf(group.kind).severity == EventSeverity::kInfo) continue;
      const std::string line = EventLine(first);
      auto same = std::ranges::find_if(shared, [&](const SharedEvents& events) {
        return events.kind == group.kind && events.line == line;
      });
      if (same == shared.end()) {
        same = shared.insert(same, {group.kind, line, group.events.size(), {}});
      }
      same->names.push_back(estimator.name);
    }
  }
  std::ranges::stable_sort(shared, std::greater<>(),
                           [](const SharedEvents& events) { return InfoOf(events.kind).severity; });
  std::vector<std::string> lines;
  for (const SharedEvents& events : shared) {
    const std::string count =
        events.count > 1 ? ", " + std::to_string(events.count) + " times" : "";
    lines.push_back(std::string(ToString(events.kind)) + "  " + internal::Join(events.names) +
                    count + ": " + events.line);
  }
  return lines;
}

/// Returns at most `max_lines` lines of these items, which are wrapped.
std::string FirstLines(const std::vector<std::string>& items, std::size_t max_lines,
                       std::size_t width) {
  std::string text;
  std::size_t shown = 0;
  for (const std::string& item : items) {
    const std::string more = text + internal::WrapText(item + '\n', width);
    if (CountLines(more) > max_lines) break;
    text = more;
    ++shown;
  }
  const std::size_t omitted = items.size() - shown;
  return text + (omitted == 0 ? "" : "and " + std::to_string(omitted) + " more: -v\n");
}

std::string CountedText(std::size_t count, const std::string& noun) {
  return std::to_string(count) + ' ' + noun + (count == 1 ? "" : "s");
}

}  // namespace

void RunReport::Begin(const Experiment& experiment) {
  seed_ = experiment.seed;
  subjects_ = internal::SubjectsOf(experiment);
  rows_ = experiment.report_rows;
}

void RunReport::OnFrame(const SourceFrame& frame) {
  if (first_ == kNoTimestamp) first_ = frame.timestamp;
  last_ = std::max(last_, frame.timestamp);
}

std::string RunReport::Head(const RunResult& result) const {
  std::string text = CountedText(result.estimators.size(), "estimator") + ", " +
                     CountedText(static_cast<std::size_t>(result.frames), "frame");
  if (last_ > first_) {
    const double s = Seconds(last_ - first_);
    text += ", " + internal::FixedText(s, s < 10.0 ? 2 : s < 1000.0 ? 1 : 0) + " s of data";
  }
  return text + ", seed " + std::to_string(seed_) + '\n';
}

std::string RunReport::Table(const RunResult& result, bool all_rows, std::size_t max_lines) const {
  if (all_rows) return ComparisonTable(result, width_);
  return internal::MainTable(result, rows_.empty() ? internal::MainKeys(result, subjects_) : rows_,
                             width_, max_lines);
}

std::string RunReport::Short(const RunResult& result,
                             const std::vector<internal::Conclusion>& conclusions,
                             bool all_rows) const {
  constexpr std::size_t kMaxLines = 23, kMinTable = 4, kMaxWarnings = 5, kMaxConclusion = 2;
  std::string text = internal::WrapText(Head(result) + ShortVerdicts(result), width_);
  text += FirstLines(WarningLines(result), kMaxWarnings, width_);
  const std::vector<std::string> lines = internal::ConclusionLines(conclusions);
  if (!lines.empty()) text += FirstLines({lines.front()}, kMaxConclusion, width_);
  text += '\n';
  const std::size_t used = CountLines(text);
  return text + Table(result, all_rows, std::max(kMaxLines, used + kMinTable) - used);
}

std::string RunReport::Verbose(const RunResult& result,
                               const std::vector<internal::Conclusion>& conclusions,
                               bool all_rows) const {
  std::string text = Head(result) + VerdictText(result);
  for (const std::string& line : internal::ConclusionLines(conclusions)) text += line + '\n';
  text += '\n' + Table(result, all_rows, std::numeric_limits<std::size_t>::max());
  const std::string events = EventSummary(result);
  return events.empty() ? text : text + '\n' + events;
}

}  // namespace alidade::cli
