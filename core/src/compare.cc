// SPDX-License-Identifier: Apache-2.0
#include "compare.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "names.h"
#include "text_table.h"

namespace alidade {

using internal::Candidate;
using internal::ComparedEntry;
using internal::ComparedRun;
using internal::Distance;
using internal::Single;

namespace {

/// The folder of a run without those above it.
std::string FolderName(const ComparedRun& run) {
  return (run.folder / ".").lexically_normal().parent_path().filename().string();
}

/// What estimators are called by beside those of other runs: the folder of each run, by its name
/// alone where no other has that.
std::vector<Candidate> CandidatesOf(const std::vector<ComparedRun>& runs) {
  std::vector<Candidate> candidates;
  for (const ComparedRun& run : runs) {
    const std::string name = FolderName(run);
    const bool unique = std::ranges::count(runs, name, FolderName) == 1;
    const std::string prefix = (unique ? name : run.folder.string()) + '/';
    for (const ComparedEntry& entry : run.estimators) {
      candidates.push_back({(runs.size() > 1 ? prefix : "") + entry.result.name, &run, &entry});
    }
  }
  return candidates;
}

/// The candidate that an option names; where several runs have it, the first. Error: kUsage.
const Candidate& Named(const std::string& name, const std::vector<Candidate>& candidates,
                       const char* option) {
  for (const Candidate& one : candidates) {
    if (one.name == name || one.entry->result.name == name) return one;
  }
  const std::vector<std::string> names = internal::NamesOf(candidates);
  throw Error(ExitCode::kUsage, ErrorLine({}, option, "no estimator '" + name + "'",
                                          "one of " + internal::Join(names), Nearest(name, names)));
}

/// The first candidate that is so; null: there is none.
const Candidate* FirstOf(const std::vector<Candidate>& candidates,
                         const std::function<bool(const Candidate&)>& is_so) {
  const auto found = std::ranges::find_if(candidates, is_so);
  return found == candidates.end() ? nullptr : &*found;
}

/// The batch of the data so far, or of all data; one that sees all measurements comes first.
const Candidate* BatchOf(const std::vector<Candidate>& candidates, bool smoothed) {
  const auto fits = [&](const Candidate& one) {
    return one.batch() && one.facts().smoothed == smoothed;
  };
  const Candidate* const of_all = FirstOf(candidates, [&](const Candidate& one) {
    return fits(one) && one.facts().accepted_by.empty();
  });
  return of_all != nullptr ? of_all : FirstOf(candidates, fits);
}

bool HasErrors(const Candidate& one) {
  return one.run->reference == "truth" &&
         std::ranges::any_of(one.entry->result.metrics,
                             [](const auto& metric) { return metric.first.starts_with("rmse:"); });
}

/// What the estimates of a comparison are held against.
struct References {
  bool truth = false;
  const Candidate* online = nullptr;    ///< of filters
  const Candidate* smoothed = nullptr;  ///< of estimates from all data
  const Candidate* final = nullptr;     ///< at the end, where all have the same data
};

References FindReferences(const std::vector<Candidate>& candidates, const CompareOptions& options) {
  References found;
  const bool truth = std::ranges::any_of(candidates, HasErrors);
  if (!options.reference.empty() && options.reference != "truth") {
    found.online = found.smoothed = found.final =
        &Named(options.reference, candidates, "--reference");
    return found;
  }
  if (options.reference == "truth" && !truth) {
    throw Error(ExitCode::kUsage,
                ErrorLine({}, "--reference", "no run has errors from truth",
                          "an estimator: " + internal::Join(internal::NamesOf(candidates))));
  }
  found.truth = truth;
  found.online = BatchOf(candidates, false);
  found.smoothed = BatchOf(candidates, true);
  if (found.smoothed == nullptr) {
    found.smoothed = FirstOf(candidates, [](const Candidate& c) { return c.facts().smoothed; });
  }
  if (!truth && found.online == nullptr) found.online = found.smoothed;
  found.final = found.smoothed != nullptr ? found.smoothed : found.online;
  return found;
}

/// Why `reference` is none, or "".
std::string WhyNone(const Candidate* reference) {
  if (reference == nullptr) return "no reference: no truth, no batch and no smoother";
  if (reference->entry->usable()) return "";
  return "no reference: estimator '" + reference->name + "' " +
         (reference->entry->result.failed ? "failed" : "has no estimates") +
         ", the comparison with it is withheld";
}

bool ScaleIsFree(const Candidate& one) {
  const std::vector<std::string> scale = {"scale"};
  return std::ranges::count(one.entry->result.unobservable, scale) > 0;
}

/// Landmarks that both maps have, as columns.
std::optional<internal::Aligned> AlignMaps(const EstimatorResult& map, const EstimatorResult& ref) {
  if (!map.landmarks || !ref.landmarks) return std::nullopt;
  Eigen::Matrix3Xd points(3, std::ssize(*map.landmarks)), onto = points;
  Eigen::Index count = 0;
  for (const LandmarkEstimate& one : *map.landmarks) {
    for (const LandmarkEstimate& other : *ref.landmarks) {
      const bool same = one.id == other.id && one.generation == other.generation;
      if (!same || !one.position.allFinite() || !other.position.allFinite()) continue;
      points.col(count) = one.position;
      onto.col(count++) = other.position;
      break;
    }
  }
  return internal::AlignBySimilarity(points.leftCols(count), onto.leftCols(count));
}

void AddAll(const std::map<std::string, double>& from, const std::string& kind,
            std::map<std::string, Spread>& values) {
  for (const auto& [key, value] : from) values[kind + key] = Single(value);
}

/// `ratio.KEY` of the keys that begin like one of `kinds`.
void AddRatios(const ComparedEntry& one, const ComparedEntry& reference,
               const std::vector<std::string>& kinds, std::map<std::string, Spread>& values) {
  for (const auto& [key, value] : one.result.metrics) {
    const auto begins = [&key = key](const std::string& kind) { return key.starts_with(kind); };
    const auto found = reference.result.metrics.find(key);
    if (std::ranges::none_of(kinds, begins) || key.find('@') != key.npos) continue;
    if (found == reference.result.metrics.end() || !(found->second > 0.0)) continue;
    values["ratio." + key] = Single(value / found->second);
  }
}

/// The distance from `reference` along the run, and where scale is free that of the path.
void AddApart(const Candidate& one, const Candidate& reference, ComparedEstimator& compared) {
  const Distance distance = internal::DistanceBetween(one.entry->series, reference.entry->series);
  AddAll(distance.rms, "apart:", compared.values);
  AddAll(distance.sigmas, "apart.sigmas:", compared.values);
  const std::string& path = one.facts().path;
  if (path.empty() || !ScaleIsFree(one)) return;
  if (const auto aligned = AlignPaths(one.entry->series, reference.entry->series, path)) {
    compared.values["apart.path.sim3"] = Single(aligned->rmse);
  }
}

void AddFinal(const Candidate& one, const Candidate& reference, ComparedEstimator& compared) {
  const Distance distance = internal::DistanceBetween(one.entry->series, reference.entry->series);
  AddAll(distance.final, "apart.final:", compared.values);
  AddAll(distance.final_sigmas, "apart.final.sigmas:", compared.values);
  if (const auto aligned = AlignMaps(one.entry->result, reference.entry->result)) {
    compared.values["apart.map.sim3"] = Single(aligned->rmse);
  }
}

/// Metrics of the run that need no truth.
bool NeedsNoTruth(const std::string& key) {
  for (const char* kind : {"nis.", "reprojection:", "settling_frames:"}) {
    if (key.starts_with(kind)) return true;
  }
  return false;
}

ComparedEstimator Compare(const Candidate& one, const References& references) {
  const EstimatorResult& result = one.entry->result;
  ComparedEstimator compared{
      one.name, one.facts().type,       one.facts().smoothed, "", "", {}, result.units,
      1,        result.diverged ? 1 : 0};
  for (const internal::SeriesBlock& block : one.entry->series.blocks) {
    if (!block.unit.empty()) compared.units[block.name] = block.unit;
  }
  for (const auto& [key, value] : result.metrics) {
    const bool from_truth = references.truth && one.run->reference == "truth";
    if (from_truth || NeedsNoTruth(key)) compared.values[key] = Single(value);
  }
  const std::int64_t count = one.entry->measurements();
  if (count > 0 && result.wall_s > 0.0) {
    compared.values["time_us"] = Single(1e6 * result.wall_s / static_cast<double>(count));
  }
  if (!one.entry->usable()) return compared;
  const Candidate* const along = compared.smoothed ? references.smoothed : references.online;
  if (along != nullptr && along->entry->usable()) {
    compared.reference = along->name;
    if (references.truth)
      AddRatios(*one.entry, *along->entry, {"rmse:", "path.sim3.rmse"}, compared.values);
    if (along->entry != one.entry) AddApart(one, *along, compared);
  }
  if (references.final != nullptr && references.final->entry->usable()) {
    const Candidate& final = *references.final;
    compared.final_reference = final.name;
    if (references.truth)
      AddRatios(*one.entry, *final.entry, {"final:", "map.rmse", "map.sim3.rmse"}, compared.values);
    if (final.entry != one.entry) AddFinal(one, final, compared);
  }
  return compared;
}

/// The filter whose gap is explained; null: there is none.
const Candidate* FilterOf(const std::vector<Candidate>& candidates, const CompareOptions& options) {
  if (!options.filter.empty()) return &Named(options.filter, candidates, "--filter");
  return FirstOf(candidates, [](const Candidate& one) {
    return !one.facts().smoothed && !one.batch() && one.facts().accepted_by.empty();
  });
}

std::vector<std::string> NotesOf(const std::vector<Candidate>& candidates,
                                 const References& references) {
  std::vector<std::string> notes;
  if (std::ranges::any_of(candidates, ScaleIsFree)) {
    notes.emplace_back(
        "scale is what the priors make of it: paths and maps are to be compared by their Sim3 "
        "rows, after the similarity that brings them nearest");
  }
  for (const Candidate* const one : {references.online, references.smoothed}) {
    if (one == nullptr || one->entry->series.joint || !one->entry->usable()) continue;
    notes.push_back("'" + one->name +
                    "' has no covariance.bin: sigmas apart leave its correlations out");
  }
  std::ranges::sort(notes);
  notes.erase(std::unique(notes.begin(), notes.end()), notes.end());
  const Candidate* const reference = references.online;
  if (!references.truth && reference != nullptr && reference->facts().smoothed) {
    notes.push_back("'" + reference->name +
                    "' knows later data, a filter does not: it lags behind by nature");
  }
  return notes;
}

}  // namespace

const char* ToString(GapKind kind) {
  constexpr const char* kNames[] = {"linearisation", "smoothing", "lost data"};
  return kNames[static_cast<int>(kind)];
}

Comparison internal::CompareRuns(const std::vector<ComparedRun>& runs,
                                 const CompareOptions& options) {
  ALIDADE_EXPECTS(!runs.empty());
  const std::vector<Candidate> candidates = CandidatesOf(runs);
  const References references = FindReferences(candidates, options);
  Comparison comparison;
  comparison.frames = runs.front().frames;
  comparison.measurements_sha256 = runs.front().measurements_sha256;
  comparison.notes = NotesOf(candidates, references);
  comparison.reference = references.truth              ? "truth"
                         : references.final == nullptr ? ""
                                                       : references.final->name;
  for (const Candidate* const reference : {references.final, references.online}) {
    const bool needed = !references.truth || reference != nullptr;
    if (needed && comparison.withheld.empty()) comparison.withheld = WhyNone(reference);
  }
  for (const Candidate& one : candidates) {
    comparison.estimators.push_back(Compare(one, references));
  }
  const Candidate* const filter = options.explain ? FilterOf(candidates, options) : nullptr;
  if (filter != nullptr) {
    comparison.explained = filter->name;
    comparison.gap = ExplainGap(*filter, candidates, references.truth);
  }
  return comparison;
}

}  // namespace alidade
