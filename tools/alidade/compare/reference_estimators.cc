// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/compare/budget.h"
#include "alidade/compare/candidates.h"
#include "alidade/compare/compare.h"
#include "alidade/experiment/build_estimator.h"
#include "alidade/experiment/calibration.h"
#include "alidade/experiment/estimator_registry.h"
#include "alidade/io/text_table.h"
#include "alidade/sweep/sweep_config.h"

namespace alidade {
namespace {

constexpr const char* kOrigin = "alidade compare";

/// An estimator that a comparison may lack.
struct Variant {
  const char* name;
  EstimatorKind kind;
  bool full_information;          ///< the full-information filter
  bool accepted;                  ///< of what the filter accepted
  std::vector<const char*> keys;  ///< of the filter's entry, taken over where it has them
  const char* what;
};

const std::vector<Variant>& Variants() {
  static const std::vector<Variant> variants = {
      {"rts",
       EstimatorKind::kSmoother,
       false,
       false,
       {"sensors", "overrides", "max_dt_s", "gate", "fuse"},
       "the smoother of all data"},
      {"batch",
       EstimatorKind::kBatch,
       false,
       false,
       {"sensors", "overrides", "max_dt_s"},
       "the batch of all data"},
      {"full_information",
       EstimatorKind::kBatch,
       true,
       true,
       {"sensors", "overrides", "max_dt_s"},
       "the full-information filter over what the filter accepted"},
      {"batch_accepted",
       EstimatorKind::kBatch,
       false,
       true,
       {"sensors", "overrides", "max_dt_s"},
       "the batch of all that the filter accepted"},
  };
  return variants;
}

/// Whether `spec` is what the variant would be. A full-information filter does for one of the
/// data that a filter accepted: another line tells what these two differ by.
bool IsThere(const Variant& variant, const EstimatorSpec& spec, const EstimatorSpec& filter,
             int filter_index) {
  const bool full_information = spec.kind == EstimatorKind::kBatch && !spec.estimator->offline();
  if (spec.kind != variant.kind || full_information != variant.full_information) return false;
  const bool same_sensors = std::ranges::is_permutation(
      spec.problem.sensors, filter.problem.sensors, {}, &SensorBinding::name, &SensorBinding::name);
  if (spec.overrides != filter.overrides || !same_sensors) return false;
  if (spec.accepted_by >= 0) return variant.accepted && spec.accepted_by == filter_index;
  return variant.full_information || !variant.accepted;
}

/// A name that no estimator has.
std::string FreeName(const std::string& name, const std::vector<EstimatorSpec>& taken) {
  const std::vector<std::string> names = internal::NamesOf(taken);
  std::string free = name;
  for (int i = 2; std::ranges::count(names, free) > 0; ++i) free = name + '_' + std::to_string(i);
  return free;
}

/// The first type of that kind, those of core before those of plugins; "": there is none.
std::string TypeOf(EstimatorKind kind, const PluginHost& host) {
  for (const internal::EstimatorType& type : internal::EstimatorTypes()) {
    if (type.kind == kind) return type.name;
  }
  for (const PluginEntry& entry : host.entries()) {
    if (entry.kind == kEstimatorKind && EstimatorOf(entry).kind == kind) return entry.name;
  }
  return "";
}

/// The config with the variant's entry.
Config WithVariant(const Config& config, const Variant& variant, const std::string& type,
                   const std::string& name, const std::string& filter) {
  Config with = config.Copy();
  const std::string entry = "estimators." + name;
  with.Set(entry + ".type", type, kOrigin);
  if (variant.full_information) with.Set(entry + ".mode", "filtering", kOrigin);
  if (variant.accepted) with.Set(entry + ".use.accepted_by", filter, kOrigin);
  for (const char* const key : variant.keys) {
    const auto value = with.root().At("estimators").At(filter).Find(key);
    if (!value) continue;
    const std::string text = value->ToYaml();
    with.Set(entry + '.' + key, text, kOrigin);
  }
  return with;
}

/// What an error says, without its place and what it would have expected.
std::string ReasonOf(const Error& error) {
  std::string reason = error.what();
  reason = reason.substr(0, reason.find('\n'));
  reason = reason.substr(0, reason.find("; expected"));
  const std::size_t place = reason.find(": ");
  return place == reason.npos ? reason : reason.substr(place + 2);
}

/// Adds the variant, or puts what it is below the reason why it cannot be.
void AddVariant(const Variant& variant, const PluginHost& host, ComparedExperiment& compared,
                std::map<std::string, std::vector<std::string>>& left_out) {
  const std::string name = FreeName(variant.name, compared.experiment.estimators);
  const std::string type = TypeOf(variant.kind, host);
  if (type.empty()) {
    left_out[std::string("no plugin offers an estimator of the kind ") + ToString(variant.kind)]
        .emplace_back(variant.what);
    return;
  }
  try {
    const Config with = WithVariant(compared.config, variant, type, name, compared.filter);
    internal::AddEstimator(internal::WithCalibration(with, *compared.experiment.source), host, name,
                           compared.experiment);
    compared.config = with;
    compared.added.push_back(name);
    compared.notes.push_back("added '" + name + "': " + variant.what);
  } catch (const Error& error) {
    left_out[ReasonOf(error)].emplace_back(variant.what);
  }
}

/// Refuses a reference that no estimator is, and truth where the source knows none. Error: kUsage.
void CheckReference(const Experiment& experiment, const std::string& name) {
  std::vector<std::string> names = internal::NamesOf(experiment.estimators);
  const bool truth = name == "truth" && !experiment.source->truths().empty();
  if (name.empty() || truth || std::ranges::count(names, name) > 0) return;
  if (!experiment.source->truths().empty()) names.emplace_back("truth");
  internal::RefuseOption(
      "--reference", name == "truth" ? "the source knows no truth" : "no estimator '" + name + "'",
      name, names);
}

/// Index of the filter whose error is to be decomposed; -1: there is none. Error: kUsage.
int FindFilter(const Experiment& experiment, const std::string& name) {
  std::vector<std::string> filters;
  for (std::size_t e = 0; e < experiment.estimators.size(); ++e) {
    const EstimatorSpec& one = experiment.estimators[e];
    if (one.kind != EstimatorKind::kFilter) continue;
    if (name.empty() ? one.accepted_by < 0 : one.name == name) return static_cast<int>(e);
    filters.push_back(one.name);
  }
  if (name.empty()) return -1;
  const bool known = std::ranges::count(internal::NamesOf(experiment.estimators), name) > 0;
  internal::RefuseFilter(name, known, filters);
}

/// Without the variants of those names, each for its reason.
ComparedExperiment Build(const Config& config, const PluginHost& host,
                         const CompareOptions& options,
                         const std::map<std::string, std::string>& without) {
  // Errors are taken from truth: what a config compares with besides is done here.
  Config own = config.Copy();
  if (own.root().is_map() && own.root().Find("reference")) {
    own.Set("reference", "truth", kOrigin);
    own = own.Copy();
  }
  ComparedExperiment compared{own, BuildExperiment(own, host), "", {}, {}};
  const int filter = FindFilter(compared.experiment, options.filter);
  if (filter < 0 || !options.decompose) CheckReference(compared.experiment, options.reference);
  if (filter < 0) return compared;
  compared.filter = compared.experiment.estimators[static_cast<std::size_t>(filter)].name;
  if (!options.decompose) return compared;
  std::map<std::string, std::vector<std::string>> left_out;  // by reason
  for (const Variant& variant : Variants()) {
    const std::vector<EstimatorSpec>& all = compared.experiment.estimators;
    const EstimatorSpec& of = all[static_cast<std::size_t>(filter)];
    const bool there = std::ranges::any_of(
        all, [&](const EstimatorSpec& one) { return IsThere(variant, one, of, filter); });
    if (there) continue;
    if (const auto found = without.find(FreeName(variant.name, all)); found != without.end()) {
      left_out[found->second].emplace_back(variant.what);
      continue;
    }
    const bool may_be_long = !options.budget_s || options.over_seeds;
    if (variant.full_information && of.problem.landmarks && may_be_long) {
      left_out
          ["with landmarks a solve at every frame takes long; of one run --budget SECONDS adds "
           "it where it can be done in time, and the config may have it"]
              .emplace_back(variant.what);
      continue;
    }
    AddVariant(variant, host, compared, left_out);
  }
  for (const auto& [reason, what] : left_out) {
    compared.notes.push_back("left out " + internal::Join(what, "; ") + ": " + reason);
  }
  CheckReference(compared.experiment, options.reference);
  return compared;
}

/// Which of those that were added take too long, and why; `note` tells what was foretold.
std::map<std::string, std::string> BeyondBudget(ComparedExperiment& compared, double budget_s,
                                                std::string& note) {
  std::map<std::string, std::string> beyond;
  const std::optional<internal::ForetoldTime> time = internal::ForetellTime(compared.experiment);
  if (!time) {
    note = "how long it takes cannot be foretold: nothing is left out for the budget";
    return beyond;
  }
  const auto seconds = [](double s) { return internal::RoundedText(s, 2) + " s"; };
  double sum_s = 0.0;
  for (std::size_t e = 0; e < time->of.size(); ++e) {
    const std::string& name = compared.experiment.estimators[e].name;
    if (std::ranges::count(compared.added, name) == 0) sum_s += time->of[e];
  }
  for (std::size_t e = 0; e < time->of.size(); ++e) {
    const std::string& name = compared.experiment.estimators[e].name;
    if (std::ranges::count(compared.added, name) == 0) continue;
    if (sum_s + time->of[e] <= budget_s) {
      sum_s += time->of[e];
    } else {
      beyond[name] = "it may take " + seconds(time->of[e]) + ", the budget is " + seconds(budget_s);
    }
  }
  note = "foretold from " + std::to_string(time->frames) + " of " +
         std::to_string(time->all_frames) + " frames: " + seconds(sum_s) + " of CPU time";
  return beyond;
}

}  // namespace

ComparedExperiment BuildComparedExperiment(const Config& config, const PluginHost& host,
                                           const CompareOptions& options) {
  if (options.over_seeds || options.budget_s) internal::CheckReadableAgain(config);
  ComparedExperiment compared = Build(config, host, options, {});
  if (options.over_seeds || !options.budget_s || compared.added.empty()) return compared;
  std::string note;
  const auto beyond = BeyondBudget(compared, *options.budget_s, note);
  compared = Build(config, host, options, beyond);  // the source has been read
  compared.notes.push_back(note);
  if (!beyond.empty()) {
    compared.beyond_budget = "the budget of " + internal::RoundedText(*options.budget_s, 2) +
                             " s left out what is named above";
  }
  return compared;
}

}  // namespace alidade
