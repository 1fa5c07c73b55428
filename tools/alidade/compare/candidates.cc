// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/candidates.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "alidade/base/text.h"
#include "alidade/compare/distance.h"
#include "alidade/io/text_table.h"

namespace alidade {

using internal::Candidate;
using internal::ComparedRun;
using internal::Distance;
using internal::SameSensors;
using internal::SameSystem;
using internal::Single;
using internal::SmoothsAllData;

namespace {

/// The folder of a run without those above it; "" of one that has none.
std::string FolderName(const ComparedRun& run) {
  if (run.folder.empty()) return "";
  return (std::filesystem::absolute(run.folder) / ".")
      .lexically_normal()
      .parent_path()
      .filename()
      .string();
}

/// What estimators are called by among those of other runs: the folder of each run, by its name
/// alone if no other has that. Moves the estimators of the runs.
std::vector<Candidate> CandidatesOf(std::vector<ComparedRun>& runs) {
  std::vector<Candidate> candidates;
  for (ComparedRun& run : runs) {
    const std::string name = FolderName(run);
    const bool unique = std::ranges::count(runs, name, FolderName) == 1;
    const std::string prefix = (unique ? name : run.folder.string()) + '/';
    for (Candidate& one : run.estimators) {
      one.name = (runs.size() > 1 ? prefix : "") + one.result.name;
      one.run = &run;
      candidates.push_back(std::move(one));
    }
  }
  return candidates;
}

/// The candidate that an option names; where several runs have it, the first. Error: kUsage.
const Candidate& Named(const std::string& name, const std::vector<Candidate>& candidates,
                       const char* option) {
  for (const Candidate& one : candidates) {
    if (one.name == name || one.result.name == name) return one;
  }
  internal::RefuseOption(option, "no estimator '" + name + "'", name,
                         internal::NamesOf(candidates));
}

/// The first candidate that is so, of those that are usable where one is; null: there is none.
const Candidate* FirstOf(const std::vector<Candidate>& candidates,
                         const std::function<bool(const Candidate&)>& is_so) {
  const Candidate* first = nullptr;
  for (const Candidate& one : candidates) {
    if (!is_so(one)) continue;
    if (one.usable()) return &one;
    if (first == nullptr) first = &one;
  }
  return first;
}

/// The batch of the same problem as `of`, of the data up to each frame or of all data; one that
/// sees all measurements comes before one of those that a filter accepted. Where none of these is
/// usable, one that is, of the same sensors with other overrides: a robust loss, say.
const Candidate* BatchFor(const Candidate& of, const std::vector<Candidate>& candidates,
                          bool smoothed) {
  const auto sees_the_same = [&](const Candidate& one) {
    return one.batch() && one.result.smoothed == smoothed && SameSensors(one.result, of.result);
  };
  const auto fits = [&](const Candidate& one) {
    return sees_the_same(one) && SameSystem(one.result, of.result);
  };
  const auto sees_all = [](const Candidate& one) { return one.result.accepted_by.empty(); };
  const std::function<bool(const Candidate&)> choices[] = {
      [&](const Candidate& one) { return fits(one) && sees_all(one); }, fits,
      [&](const Candidate& one) { return sees_the_same(one) && sees_all(one); }};
  for (const auto& choice : choices) {
    const Candidate* const found = FirstOf(candidates, choice);
    if (found != nullptr && found->usable()) return found;
  }
  const Candidate* const own = FirstOf(candidates, choices[0]);
  return own != nullptr ? own : FirstOf(candidates, fits);
}

bool HasErrors(const Candidate& one) {
  return one.run->reference == "truth" &&
         std::ranges::any_of(one.result.metrics,
                             [](const auto& metric) { return metric.first.starts_with("rmse:"); });
}

/// Whether errors are taken from truth. Error: kUsage where that is asked for and there is none.
bool FromTruth(const std::vector<Candidate>& candidates, const CompareOptions& options) {
  const bool asked = options.reference == "truth";
  if (!options.reference.empty() && !asked) return false;
  const bool truth = std::ranges::any_of(candidates, HasErrors);
  if (asked && !truth) {
    internal::RefuseOption("--reference", "no run has errors from truth", "",
                           internal::NamesOf(candidates));
  }
  return truth;
}

/// What the estimates of a candidate are compared with; null: nothing.
struct References {
  const Candidate* along = nullptr;  ///< those along the run
  const Candidate* final = nullptr;  ///< the last one, when all have the same data
};

References ReferencesOf(const Candidate& one, const std::vector<Candidate>& candidates, bool truth,
                        const CompareOptions& options) {
  if (!options.reference.empty() && options.reference != "truth") {
    const Candidate& named = Named(options.reference, candidates, "--reference");
    return {&named, &named};
  }
  const Candidate* const full_information = BatchFor(one, candidates, false);
  const Candidate* smoothed = BatchFor(one, candidates, true);
  if (smoothed == nullptr) {
    smoothed = FirstOf(candidates, [&](const Candidate& other) {
      return SmoothsAllData(other.result) && SameSystem(other.result, one.result);
    });
  }
  const bool later = one.result.smoothed || (!truth && full_information == nullptr);
  return {later ? smoothed : full_information, smoothed != nullptr ? smoothed : full_information};
}

/// Why a comparison with the reference is withheld, or "".
std::string WhyWithheld(const std::vector<Candidate>& candidates,
                        const std::vector<References>& references, bool truth) {
  const bool measured =
      std::ranges::any_of(candidates, [](const Candidate& one) { return one.measurements() > 0; });
  if (!measured) return "no estimator was given a measurement: what is compared is their start";
  bool any = truth;
  for (const References& of_one : references) {
    for (const Candidate* const reference : {of_one.final, of_one.along}) {
      if (reference == nullptr) continue;
      any = true;
      if (reference->usable()) continue;
      return "no reference: estimator '" + reference->name + "' " +
             (reference->result.failed ? "failed" : "has no estimates") +
             ", the comparison with it is withheld";
    }
  }
  return any ? "" : "no reference: no truth, no batch and no smoother of all data";
}

/// Which estimators are compared with nothing while others are.
std::vector<std::string> WithoutReference(const std::vector<Candidate>& candidates,
                                          const std::vector<References>& references) {
  bool final = false, online = false;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    final = final || references[i].final != nullptr;
    online = online || (references[i].along != nullptr && !candidates[i].result.smoothed);
  }
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const std::string what = "'" + candidates[i].name + "' is compared with nothing";
    if (final && references[i].final == nullptr) {
      notes.push_back(what + ": no batch has its sensors");
    } else if (online && references[i].along == nullptr) {
      notes.push_back(what + " along the run: no full-information filter has its sensors and " +
                      "overrides");
    }
  }
  return notes;
}

bool ScaleIsFree(const Candidate& one) {
  const std::vector<std::string> scale = {"scale"};
  return std::ranges::count(one.result.unobservable, scale) > 0;
}

void AddAll(const std::map<std::string, double>& from, const std::string& kind,
            std::map<std::string, Spread>& values) {
  for (const auto& [key, value] : from) values[kind + key] = Single(value);
}

/// Of the keys that begin like one of `kinds`.
void AddRatios(const Candidate& one, const Candidate& reference,
               const std::vector<std::string>& kinds, std::map<std::string, Ratio>& ratios) {
  for (const auto& [key, value] : one.result.metrics) {
    const auto begins = [&key = key](const std::string& kind) { return key.starts_with(kind); };
    const auto found = reference.result.metrics.find(key);
    if (std::ranges::none_of(kinds, begins) || key.find('@') != key.npos) continue;
    if (found == reference.result.metrics.end() || !(found->second > 0.0)) continue;
    if (!std::isfinite(found->second)) continue;
    ratios[key] = {value, found->second};
  }
}

/// The distance from `reference` along the run, and where scale is free that of the path.
void AddRmsd(const Candidate& one, const Candidate& reference, ComparedEstimator& compared) {
  const Distance distance = internal::DistanceBetween(one.series, reference.series);
  AddAll(distance.rms, "rmsd:", compared.values);
  AddAll(distance.sigmas, "rmsd.sigmas:", compared.values);
  const std::string& path = one.result.position_block;
  if (path.empty() || !ScaleIsFree(one)) return;
  if (const auto aligned = AlignTrajectories(one.series, reference.series, path)) {
    compared.values["trajectory.sim3.rmsd"] = Single(aligned->rmse);
  }
}

void AddFinal(const Candidate& one, const Candidate& reference, ComparedEstimator& compared) {
  const Distance distance = internal::DistanceBetween(one.series, reference.series);
  AddAll(distance.final, "final_difference:", compared.values);
  AddAll(distance.final_sigmas, "final_difference.sigmas:", compared.values);
  for (const auto& [map, rms] : internal::DistanceBetweenMaps(one.result, reference.result)) {
    compared.values[map + ".rmsd"] = Single(rms);
  }
}

/// Metrics of the run that need no truth.
bool NeedsNoTruth(const std::string& key) {
  for (const char* kind : {"nis.", "reprojection:", "settling_frames:"}) {
    if (key.starts_with(kind)) return true;
  }
  return false;
}

/// CPU time for each frame. What a batch of all data does frame by frame is its start.
void AddCpuTime(const Candidate& one, ComparedEstimator& compared) {
  const internal::CpuTime& cpu = one.cpu;
  const auto frames = static_cast<double>(one.run->frames);
  const bool timed = one.result.wall_s > 0.0 && cpu.frames_s + cpu.smoothing_s > 0.0;
  if (!timed || one.run->frames == 0) return;
  const bool solves_once = one.batch() && one.result.smoothed;
  const double own_s = cpu.smoothing_s + (solves_once ? 0.0 : cpu.frames_s);
  compared.values["cpu_us"] = Single(1e6 * own_s / frames);
  if (solves_once) compared.values["cpu_us.start"] = Single(1e6 * cpu.frames_s / frames);
}

ComparedEstimator Compare(const Candidate& one, const References& references, bool truth) {
  const EstimatorResult& result = one.result;
  ComparedEstimator compared;
  compared.name = one.name;
  compared.type = one.result.type;
  compared.smoothed = one.result.smoothed;
  compared.units = result.units;
  compared.used = 1;
  compared.diverged = result.diverged ? 1 : 0;
  for (const internal::SeriesBlock& block : one.series.blocks) {
    if (!block.unit.empty()) compared.units[block.name] = block.unit;
  }
  for (const auto& [key, value] : result.metrics) {
    const bool from_truth = truth && one.run->reference == "truth";
    if (from_truth || NeedsNoTruth(key)) compared.values[key] = Single(value);
  }
  const std::int64_t count = one.measurements();
  if (count > 0 && result.wall_s > 0.0) {
    compared.values["time_us"] = Single(1e6 * result.wall_s / static_cast<double>(count));
  }
  AddCpuTime(one, compared);
  compared.series = one.errors;
  for (const auto& [block, by_bound] : one.errors.by_bound) {
    compared.ratios["mse_by_bound:" + block] = {by_bound, 1.0};
  }
  if (!one.usable()) return compared;
  if (references.along != nullptr && references.along->usable()) {
    const Candidate& along = *references.along;
    compared.reference = along.name;
    compared.reference_runs = 1;
    if (truth) AddRatios(one, along, {"rmse:", "trajectory.sim3.rmse"}, compared.ratios);
    if (&along != &one) AddRmsd(one, along, compared);
  }
  if (references.final != nullptr && references.final->usable()) {
    const Candidate& final = *references.final;
    compared.final_reference = final.name;
    compared.final_reference_runs = 1;
    if (truth)
      AddRatios(one, final, {"final_error:", "map.rmse", "map.sim3.rmse"}, compared.ratios);
    if (&final != &one) AddFinal(one, final, compared);
  }
  return compared;
}

/// The filter whose error is decomposed; null: there is none. Error: kUsage.
const Candidate* FilterOf(const std::vector<Candidate>& candidates, const CompareOptions& options) {
  const auto is_filter = [](const Candidate& one) {
    return one.result.kind == EstimatorKind::kFilter;
  };
  if (options.filter.empty()) {
    const auto first = std::ranges::find_if(candidates, [&](const Candidate& one) {
      return is_filter(one) && one.result.accepted_by.empty();
    });
    return first == candidates.end() ? nullptr : &*first;
  }
  std::vector<std::string> filters;
  bool known = false;
  for (const Candidate& one : candidates) {
    const bool named = one.name == options.filter || one.result.name == options.filter;
    if (named && is_filter(one)) return &one;
    known = known || named;
    if (is_filter(one)) filters.push_back(one.name);
  }
  internal::RefuseFilter(options.filter, known, filters);
}

std::vector<std::string> NotesOf(const std::vector<Candidate>& candidates,
                                 const std::vector<References>& references, bool truth) {
  std::set<std::string> notes;
  if (std::ranges::any_of(candidates, ScaleIsFree)) {
    notes.insert(
        "scale is what the priors make of it: trajectories and maps are to be compared by their "
        "Sim3 "
        "rows, after the similarity that brings them nearest");
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate* const along = references[i].along;
    if (along == nullptr) continue;
    if (!along->series.joint && along->usable()) {
      notes.insert("'" + along->name +
                   "' has no covariance.bin: RMSD in sigmas leaves its correlations out");
    }
    if (!truth && along->result.smoothed && !candidates[i].result.smoothed) {
      notes.insert("'" + along->name +
                   "' knows later data, a filter does not: it lags behind by nature");
    }
  }
  for (const Candidate& one : candidates) {
    const std::string& why = one.errors.no_bound;
    if (!why.empty()) notes.insert("no Cramer-Rao bound: " + why);
  }
  std::vector<std::string> all(notes.begin(), notes.end());
  const std::vector<std::string> without = WithoutReference(candidates, references);
  all.insert(all.end(), without.begin(), without.end());
  return all;
}

}  // namespace

void internal::RefuseOption(const char* option, const std::string& what, const std::string& name,
                            const std::vector<std::string>& choices) {
  throw Error(ExitCode::kUsage,
              ErrorLine({}, option, what,
                        choices.empty() ? "a config that has one" : "one of " + Join(choices),
                        Nearest(name, choices)));
}

void internal::RefuseFilter(const std::string& name, bool known,
                            const std::vector<std::string>& filters) {
  const std::string quoted = "'" + name + "'";
  RefuseOption("--filter", known ? quoted + " is not an online filter" : "no estimator " + quoted,
               known ? "" : name, filters);
}

const char* ToString(DecompositionKind kind) {
  constexpr const char* kNames[] = {"linearisation", "smoothing", "rejected_measurements"};
  return kNames[static_cast<int>(kind)];
}

Comparison internal::CompareRuns(std::vector<ComparedRun> runs, const CompareOptions& options) {
  ALIDADE_EXPECTS(!runs.empty());
  const std::vector<Candidate> candidates = CandidatesOf(runs);
  const bool truth = FromTruth(candidates, options);
  std::vector<References> references;
  for (const Candidate& one : candidates) {
    references.push_back(ReferencesOf(one, candidates, truth, options));
  }
  Comparison comparison;
  comparison.frames = runs.front().frames;
  for (const ComparedRun& run : runs) comparison.status = std::max(comparison.status, run.status);
  comparison.measurements_sha256 = runs.front().measurements_sha256;
  comparison.notes = NotesOf(candidates, references, truth);
  comparison.withheld = WhyWithheld(candidates, references, truth);
  comparison.reference = truth ? "truth" : "";
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    comparison.estimators.push_back(Compare(candidates[i], references[i], truth));
    const Candidate* const final = references[i].final;
    if (comparison.reference.empty() && final != nullptr) comparison.reference = final->name;
  }
  const Candidate* const filter = options.decompose ? FilterOf(candidates, options) : nullptr;
  if (filter != nullptr) {
    comparison.decomposed = filter->name;
    comparison.decomposition = Decompose(*filter, candidates, truth);
    if (filter->had_rejection_recovery) {
      comparison.notes.push_back(
          "'" + filter->name +
          "' recovered from rejections: what that cost is in its step to a batch or smoother");
    }
  }
  return comparison;
}

}  // namespace alidade
