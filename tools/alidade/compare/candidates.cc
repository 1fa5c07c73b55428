// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/candidates.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "alidade/base/text.h"
#include "alidade/compare/distance.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/io/text_table.h"

namespace alidade {

using internal::Candidate;
using internal::ComparedRun;
using internal::Distance;
using internal::HaveSameProblem;
using internal::HaveSameSensors;
using internal::SingleValue;
using internal::SmoothsAllData;

namespace {

/// Returns the name of the folder of a run without the parent folders. Returns "" if the run has no
/// folder.
std::string FolderName(const ComparedRun& run) {
  if (run.folder.empty()) return "";
  return (std::filesystem::absolute(run.folder) / ".")
      .lexically_normal()
      .parent_path()
      .filename()
      .string();
}

/// Moves the estimators out of the runs. If there are several runs, the folder of the run is
/// prefixed to the name of each estimator. The prefix is the name of the folder if this name is
/// unique, otherwise the path of the folder.
std::vector<Candidate> ExtractCandidates(std::vector<ComparedRun>& runs) {
  std::vector<Candidate> candidates;
  for (ComparedRun& run : runs) {
    const std::string name = FolderName(run);
    const bool is_unique = std::ranges::count(runs, name, FolderName) == 1;
    const std::string prefix = (is_unique ? name : run.folder.string()) + '/';
    for (Candidate& candidate : run.estimators) {
      candidate.name = (runs.size() > 1 ? prefix : "") + candidate.result.name;
      candidate.run = &run;
      candidates.push_back(std::move(candidate));
    }
  }
  return candidates;
}

/// Returns the first candidate with the name that an option specifies. Error: kUsage if no
/// candidate has this name.
const Candidate& FindNamed(const std::string& name, const std::vector<Candidate>& candidates,
                           const char* option) {
  for (const Candidate& candidate : candidates) {
    if (candidate.name == name || candidate.result.name == name) return candidate;
  }
  internal::RefuseOption(option, "no estimator has the name '" + name + "'", name,
                         internal::NamesOf(candidates));
}

/// Returns the first usable candidate that satisfies the predicate. If no such candidate is usable,
/// returns the first unusable candidate that satisfies the predicate. Returns null if no candidate
/// satisfies the predicate.
const Candidate* FindFirst(const std::vector<Candidate>& candidates,
                           const std::function<bool(const Candidate&)>& predicate) {
  const Candidate* first = nullptr;
  for (const Candidate& candidate : candidates) {
    if (!predicate(candidate)) continue;
    if (candidate.is_usable()) return &candidate;
    if (first == nullptr) first = &candidate;
  }
  return first;
}

/// Finds the batch that is the reference of `estimator`. If `smoothed` is true, this is the batch
/// of all data, otherwise the batch of the data up to each frame. A batch of all measurements has
/// priority over a batch of the measurements that a filter accepted. If no batch of the same
/// problem is usable, returns a usable batch that has the same sensors but other overrides, for
/// example a robust loss.
const Candidate* FindBatch(const Candidate& estimator, const std::vector<Candidate>& candidates,
                           bool smoothed) {
  const auto has_same_sensors = [&](const Candidate& candidate) {
    return candidate.is_batch() && candidate.result.smoothed == smoothed &&
           HaveSameSensors(candidate.result, estimator.result);
  };
  const auto has_same_problem = [&](const Candidate& candidate) {
    return has_same_sensors(candidate) && HaveSameProblem(candidate.result, estimator.result);
  };
  const auto uses_all = [](const Candidate& candidate) {
    return candidate.result.accepted_by.empty();
  };
  const std::function<bool(const Candidate&)> choices[] = {
      [&](const Candidate& candidate) {
        return has_same_problem(candidate) && uses_all(candidate);
      },
      has_same_problem,
      [&](const Candidate& candidate) {
        return has_same_sensors(candidate) && uses_all(candidate);
      }};
  for (const auto& choice : choices) {
    const Candidate* const found = FindFirst(candidates, choice);
    if (found != nullptr && found->is_usable()) return found;
  }
  const Candidate* const unusable = FindFirst(candidates, choices[0]);
  return unusable != nullptr ? unusable : FindFirst(candidates, has_same_problem);
}

bool HasErrors(const Candidate& candidate) {
  return candidate.run->reference == "truth" &&
         std::ranges::any_of(candidate.result.metrics,
                             [](const auto& metric) { return metric.first.starts_with("rmse:"); });
}

/// Returns true if errors are relative to truth. Error: kUsage if the options require truth, but no
/// run has errors relative to truth.
bool UsesTruth(const std::vector<Candidate>& candidates, const CompareOptions& options) {
  const bool is_required = options.reference == "truth";
  if (!options.reference.empty() && !is_required) return false;
  const bool truth = std::ranges::any_of(candidates, HasErrors);
  if (is_required && !truth) {
    internal::RefuseOption("--reference", "no run has errors relative to truth", "",
                           internal::NamesOf(candidates));
  }
  return truth;
}

/// References of a candidate. A pointer is null if there is no such reference.
struct References {
  const Candidate* along = nullptr;  ///< reference of the estimates over the run
  const Candidate* final = nullptr;  ///< reference of the last estimate
};

References FindReferences(const Candidate& estimator, const std::vector<Candidate>& candidates,
                          bool truth, const CompareOptions& options) {
  if (!options.reference.empty() && options.reference != "truth") {
    const Candidate& named = FindNamed(options.reference, candidates, "--reference");
    return {&named, &named};
  }
  const Candidate* const full_information = FindBatch(estimator, candidates, false);
  const Candidate* smoothed = FindBatch(estimator, candidates, true);
  if (smoothed == nullptr) {
    smoothed = FindFirst(candidates, [&](const Candidate& candidate) {
      return SmoothsAllData(candidate.result) &&
             HaveSameProblem(candidate.result, estimator.result);
    });
  }
  const bool uses_smoothed = estimator.result.smoothed || (!truth && full_information == nullptr);
  return {uses_smoothed ? smoothed : full_information,
          smoothed != nullptr ? smoothed : full_information};
}

/// Returns the reason why the comparison with the reference is withheld, or "".
std::string WithheldReason(const std::vector<Candidate>& candidates,
                           const std::vector<References>& references, bool truth) {
  const bool has_measurements = std::ranges::any_of(
      candidates, [](const Candidate& candidate) { return candidate.measurements() > 0; });
  if (!has_measurements) {
    return "no estimator received a measurement: only initial estimates are compared";
  }
  bool has_reference = truth;
  for (const References& pair : references) {
    for (const Candidate* const reference : {pair.final, pair.along}) {
      if (reference == nullptr) continue;
      has_reference = true;
      if (reference->is_usable()) continue;
      return "no reference is available: estimator '" + reference->name + "' " +
             (reference->result.failed ? "failed" : "has no estimates") +
             ", so the comparison with this estimator is withheld";
    }
  }
  return has_reference
             ? ""
             : "no reference is available: there is no truth, no batch and no smoother of all data";
}

/// Returns notes on the estimators without a reference if other estimators have a reference.
std::vector<std::string> NotesOnMissingReferences(const std::vector<Candidate>& candidates,
                                                  const std::vector<References>& references) {
  bool has_final = false, has_online = false;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    has_final = has_final || references[i].final != nullptr;
    has_online = has_online || (references[i].along != nullptr && !candidates[i].result.smoothed);
  }
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const std::string note = "'" + candidates[i].name + "' has no reference";
    if (has_final && references[i].final == nullptr) {
      notes.push_back(note + ": no batch uses the same sensors");
    } else if (has_online && references[i].along == nullptr) {
      notes.push_back(note + " over the run: no full-information filter has the same sensors " +
                      "and overrides");
    }
  }
  return notes;
}

bool ScaleIsUnobservable(const Candidate& candidate) {
  const std::vector<std::string> scale = {"scale"};
  return std::ranges::count(candidate.result.unobservable, scale) > 0;
}

void AddAll(const std::map<std::string, double>& source, const std::string& kind,
            std::map<std::string, Spread>& values) {
  for (const auto& [key, value] : source) values[kind + key] = SingleValue(value);
}

/// Adds the ratio of each metric in `section` to the same metric of the reference. Some metrics do
/// not have a ratio.
void AddRatios(const Candidate& estimator, const Candidate& reference, MetricSection section,
               std::map<std::string, Ratio>& ratios) {
  for (const auto& [text, value] : estimator.result.metrics) {
    const MetricKey key = MetricKey::Parse(text);
    const MetricInfo* const metric = FindMetric(key.name);
    if (metric == nullptr || metric->section != section || !metric->has_ratio) continue;
    const auto found = reference.result.metrics.find(text);
    if (!key.segment.empty() || found == reference.result.metrics.end()) continue;
    if (found->second > 0.0 && std::isfinite(found->second)) ratios[text] = {value, found->second};
  }
}

/// Adds the distance from `reference` over the run. If the scale is unobservable, the function also
/// adds the distance between the aligned trajectories.
void AddRmsd(const Candidate& estimator, const Candidate& reference, ComparedEstimator& compared) {
  const Distance distance = internal::DistanceBetween(estimator.series, reference.series);
  AddAll(distance.rms, "rmsd:", compared.values);
  AddAll(distance.sigmas, "rmsd.sigmas:", compared.values);
  const std::string& block = estimator.result.position_block;
  if (block.empty() || !ScaleIsUnobservable(estimator)) return;
  if (const auto aligned = AlignTrajectories(estimator.series, reference.series, block)) {
    compared.values["trajectory.sim3.rmsd"] = SingleValue(aligned->rmse);
  }
}

void AddFinal(const Candidate& estimator, const Candidate& reference, ComparedEstimator& compared) {
  const Distance distance = internal::DistanceBetween(estimator.series, reference.series);
  AddAll(distance.final, "final_difference:", compared.values);
  AddAll(distance.final_sigmas, "final_difference.sigmas:", compared.values);
  for (const auto& [map, rms] : internal::DistanceBetweenMaps(estimator.result, reference.result)) {
    compared.values[map + ".rmsd"] = SingleValue(rms);
  }
}

/// Returns true if a metric can be computed without truth.
bool NeedsNoTruth(const std::string& key) {
  const MetricInfo* const metric = FindMetric(MetricKey::Parse(key).name);
  return metric != nullptr && !metric->needs_truth;
}

/// Adds the mean CPU time for a frame. For a batch of all data, the time of the filter from which
/// the batch starts is a separate value.
void AddCpuTime(const Candidate& estimator, ComparedEstimator& compared) {
  const internal::CpuTime& cpu = estimator.cpu;
  const auto frames = static_cast<double>(estimator.run->frames);
  const bool is_timed = estimator.result.wall_s > 0.0 && cpu.frames_s + cpu.smoothing_s > 0.0;
  if (!is_timed || estimator.run->frames == 0) return;
  const bool solves_once = estimator.is_batch() && estimator.result.smoothed;
  const double estimator_s = cpu.smoothing_s + (solves_once ? 0.0 : cpu.frames_s);
  compared.values["cpu_us"] = SingleValue(1e6 * estimator_s / frames);
  if (solves_once) compared.values["cpu_us.start"] = SingleValue(1e6 * cpu.frames_s / frames);
}

ComparedEstimator Compare(const Candidate& estimator, const References& references, bool truth) {
  const EstimatorResult& result = estimator.result;
  ComparedEstimator compared;
  compared.name = estimator.name;
  compared.type = result.type;
  compared.smoothed = result.smoothed;
  compared.units = result.units;
  compared.used = 1;
  compared.diverged = result.diverged ? 1 : 0;
  compared.verdicts[static_cast<std::size_t>(result.verdict.state)] = 1;
  for (const internal::SeriesBlock& block : estimator.series.blocks) {
    if (!block.unit.empty()) compared.units[block.name] = block.unit;
  }
  for (const auto& [key, value] : result.metrics) {
    const bool is_relative_to_truth = truth && estimator.run->reference == "truth";
    if (is_relative_to_truth || NeedsNoTruth(key)) compared.values[key] = SingleValue(value);
  }
  const std::int64_t count = estimator.measurements();
  if (count > 0 && result.wall_s > 0.0) {
    compared.values["time_us"] = SingleValue(1e6 * result.wall_s / static_cast<double>(count));
  }
  AddCpuTime(estimator, compared);
  compared.series = estimator.errors;
  for (const auto& [block, by_bound] : estimator.errors.by_bound) {
    compared.ratios["mse_by_bound:" + block] = {by_bound, 1.0};
  }
  if (!estimator.is_usable()) return compared;
  if (references.along != nullptr && references.along->is_usable()) {
    const Candidate& along = *references.along;
    compared.reference = along.name;
    compared.reference_runs = 1;
    if (truth) AddRatios(estimator, along, MetricSection::kAlong, compared.ratios);
    if (&along != &estimator) AddRmsd(estimator, along, compared);
  }
  if (references.final != nullptr && references.final->is_usable()) {
    const Candidate& final = *references.final;
    compared.final_reference = final.name;
    compared.final_reference_runs = 1;
    if (truth) AddRatios(estimator, final, MetricSection::kFinal, compared.ratios);
    if (&final != &estimator) AddFinal(estimator, final, compared);
  }
  return compared;
}

/// Returns the filter whose error is decomposed. Returns null if there is no filter. Error: kUsage
/// if `options` contains the name of a filter that does not exist.
const Candidate* FindFilter(const std::vector<Candidate>& candidates,
                            const CompareOptions& options) {
  const auto is_filter = [](const Candidate& candidate) {
    return candidate.result.kind == EstimatorKind::kFilter;
  };
  if (options.filter.empty()) {
    const auto first = std::ranges::find_if(candidates, [&](const Candidate& candidate) {
      return is_filter(candidate) && candidate.result.accepted_by.empty();
    });
    return first == candidates.end() ? nullptr : &*first;
  }
  std::vector<std::string> filters;
  bool is_estimator = false;
  for (const Candidate& candidate : candidates) {
    const bool is_named =
        candidate.name == options.filter || candidate.result.name == options.filter;
    if (is_named && is_filter(candidate)) return &candidate;
    is_estimator = is_estimator || is_named;
    if (is_filter(candidate)) filters.push_back(candidate.name);
  }
  internal::RefuseFilter(options.filter, is_estimator, filters);
}

std::vector<std::string> NotesOf(const std::vector<Candidate>& candidates,
                                 const std::vector<References>& references, bool truth) {
  std::set<std::string> notes;
  if (std::ranges::any_of(candidates, ScaleIsUnobservable)) {
    notes.insert(
        "the scale is unobservable and depends on the priors: to compare trajectories and maps, "
        "use the rows with Sim3, which are computed after alignment by a similarity");
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate* const along = references[i].along;
    if (along == nullptr) continue;
    if (!along->series.joint && along->is_usable()) {
      notes.insert(
          "'" + along->name +
          "' has no covariance.bin: RMSD in sigmas ignores the correlations of the errors");
    }
    if (!truth && along->result.smoothed && !candidates[i].result.smoothed) {
      notes.insert("the reference '" + along->name +
                   "' also uses later data, so its distance from a filter includes the effect of "
                   "these data");
    }
  }
  for (const Candidate& candidate : candidates) {
    const std::string& reason = candidate.errors.no_bound_reason;
    if (!reason.empty()) notes.insert("the Cramer-Rao bound is not available: " + reason);
  }
  std::vector<std::string> list(notes.begin(), notes.end());
  const std::vector<std::string> missing = NotesOnMissingReferences(candidates, references);
  list.insert(list.end(), missing.begin(), missing.end());
  return list;
}

}  // namespace

void internal::RefuseOption(const char* option, const std::string& message, const std::string& name,
                            const std::vector<std::string>& choices) {
  throw Error(ExitCode::kUsage, ErrorLine({}, option, message,
                                          choices.empty() ? "a config with such an estimator"
                                                          : "one of " + Join(choices),
                                          Nearest(name, choices)));
}

void internal::RefuseFilter(const std::string& name, bool is_estimator,
                            const std::vector<std::string>& filters) {
  const std::string quoted = "'" + name + "'";
  RefuseOption(
      "--filter",
      is_estimator ? quoted + " is not an online filter" : "no estimator has the name " + quoted,
      is_estimator ? "" : name, filters);
}

const char* ToString(DecompositionKind kind) {
  constexpr const char* kNames[] = {"linearisation", "smoothing", "rejected_measurements"};
  return kNames[static_cast<int>(kind)];
}

Comparison internal::CompareRuns(std::vector<ComparedRun> runs, const CompareOptions& options) {
  ALIDADE_EXPECTS(!runs.empty());
  const std::vector<Candidate> candidates = ExtractCandidates(runs);
  const bool truth = UsesTruth(candidates, options);
  std::vector<References> references;
  for (const Candidate& candidate : candidates) {
    references.push_back(FindReferences(candidate, candidates, truth, options));
  }
  Comparison comparison;
  comparison.frames = runs.front().frames;
  for (const ComparedRun& run : runs) comparison.status = std::max(comparison.status, run.status);
  comparison.measurements_sha256 = runs.front().measurements_sha256;
  comparison.notes = NotesOf(candidates, references, truth);
  comparison.withheld = WithheldReason(candidates, references, truth);
  comparison.reference = truth ? "truth" : "";
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    comparison.estimators.push_back(Compare(candidates[i], references[i], truth));
    const Candidate* const final = references[i].final;
    if (comparison.reference.empty() && final != nullptr) comparison.reference = final->name;
  }
  const Candidate* const filter = options.decompose ? FindFilter(candidates, options) : nullptr;
  if (filter != nullptr) {
    comparison.decomposed = filter->name;
    comparison.decomposition = Decompose(*filter, candidates, truth);
    if (filter->had_rejection_recovery) {
      comparison.notes.push_back(
          "'" + filter->name +
          "' recovered from consecutive rejections: the steps to a batch or smoother include the "
          "cost of this recovery");
    }
  }
  return comparison;
}

}  // namespace alidade
