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

/// Estimator that a comparison adds if the config does not contain it.
struct Variant {
  const char* name;
  EstimatorKind kind;
  bool full_information;          ///< true: the estimator is the full-information filter
  bool accepted;                  ///< true: uses only the measurements that the filter accepted
  std::vector<const char*> keys;  ///< keys that are copied from the entry of the filter
  const char* description;
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
       "the full-information filter of the accepted measurements"},
      {"batch_accepted",
       EstimatorKind::kBatch,
       false,
       true,
       {"sensors", "overrides", "max_dt_s"},
       "the batch of the accepted measurements"},
  };
  return variants;
}

/// Returns true if `spec` can serve as the variant. A full-information filter of all data can also
/// serve as the full-information filter of the accepted measurements, because the effect of the
/// rejected measurements is a separate step of the decomposition.
bool Matches(const Variant& variant, const EstimatorSpec& spec, const EstimatorSpec& filter,
             int filter_index) {
  const bool full_information = spec.kind == EstimatorKind::kBatch && !spec.estimator->offline();
  if (spec.kind != variant.kind || full_information != variant.full_information) return false;
  const bool has_same_sensors = std::ranges::is_permutation(
      spec.problem.sensors, filter.problem.sensors, {}, &SensorBinding::name, &SensorBinding::name);
  if (spec.overrides != filter.overrides || !has_same_sensors) return false;
  if (spec.accepted_by >= 0) return variant.accepted && spec.accepted_by == filter_index;
  return variant.full_information || !variant.accepted;
}

/// Returns `name`, or `name` with a number appended if an estimator already has this name.
std::string UniqueName(const std::string& name, const std::vector<EstimatorSpec>& estimators) {
  const std::vector<std::string> names = internal::NamesOf(estimators);
  std::string unique = name;
  for (int i = 2; std::ranges::count(names, unique) > 0; ++i) {
    unique = name + '_' + std::to_string(i);
  }
  return unique;
}

/// Returns the first estimator type of the given kind, or "" if there is no such type. The built-in
/// types have priority over those of plugins.
std::string TypeOf(EstimatorKind kind, const PluginHost& host) {
  for (const internal::EstimatorType& type : internal::EstimatorTypes()) {
    if (type.kind == kind) return type.name;
  }
  for (const PluginEntry& entry : host.entries()) {
    if (entry.kind == kEstimatorKind && EstimatorOf(entry).kind == kind) return entry.name;
  }
  return "";
}

/// Returns a copy of the config to which the entry of the variant is added.
Config WithVariant(const Config& config, const Variant& variant, const std::string& type,
                   const std::string& name, const std::string& filter) {
  Config extended = config.Copy();
  const std::string entry = "estimators." + name;
  extended.Set(entry, "{type: " + type + '}', kOrigin);
  if (variant.full_information) extended.Set(entry + ".mode", "filtering", kOrigin);
  if (variant.accepted) extended.Set(entry + ".use.accepted_by", filter, kOrigin);
  for (const char* const key : variant.keys) {
    const auto value = extended.root().At("estimators").At(filter).Find(key);
    if (!value) continue;
    const std::string text = value->ToYaml();
    extended.Set(entry + '.' + key, text, kOrigin);
  }
  return extended;
}

/// Returns the message of an error without the place and the expected value.
std::string ReasonOf(const Error& error) {
  std::string reason = error.what();
  reason = reason.substr(0, reason.find('\n'));
  reason = reason.substr(0, reason.find("; expected"));
  const std::size_t separator = reason.find(": ");
  return separator == reason.npos ? reason : reason.substr(separator + 2);
}

/// Adds the variant to the experiment. If this is not possible, adds the description of the variant
/// to `left_out`. The key is the reason.
void AddVariant(const Variant& variant, const PluginHost& host, ComparedExperiment& compared,
                std::map<std::string, std::vector<std::string>>& left_out) {
  const std::string name = UniqueName(variant.name, compared.experiment.estimators);
  const std::string type = TypeOf(variant.kind, host);
  if (type.empty()) {
    left_out[std::string("no plugin provides an estimator of kind ") + ToString(variant.kind)]
        .emplace_back(variant.description);
    return;
  }
  try {
    const Config extended = WithVariant(compared.config, variant, type, name, compared.filter);
    internal::AddEstimator(internal::WithCalibration(extended, *compared.experiment.source), host,
                           name, compared.experiment);
    compared.config = extended;
    compared.added.push_back(name);
    compared.notes.push_back("estimator '" + name + "' was added: " + variant.description);
  } catch (const Error& error) {
    left_out[ReasonOf(error)].emplace_back(variant.description);
  }
}

/// Refuses a reference that is neither the name of an estimator nor an available truth. Error:
/// kUsage.
void CheckReference(const Experiment& experiment, const std::string& name) {
  std::vector<std::string> names = internal::NamesOf(experiment.estimators);
  const bool is_known_truth = name == "truth" && !experiment.source->truths().empty();
  if (name.empty() || is_known_truth || std::ranges::count(names, name) > 0) return;
  if (!experiment.source->truths().empty()) names.emplace_back("truth");
  internal::RefuseOption("--reference",
                         name == "truth" ? "the source does not provide truth"
                                         : "no estimator has the name '" + name + "'",
                         name, names);
}

/// Returns the index of the filter whose error is decomposed. Returns -1 if there is no filter.
/// Error: kUsage if `name` is not empty and is not the name of a filter.
int FindFilter(const Experiment& experiment, const std::string& name) {
  std::vector<std::string> filters;
  for (std::size_t e = 0; e < experiment.estimators.size(); ++e) {
    const EstimatorSpec& spec = experiment.estimators[e];
    if (spec.kind != EstimatorKind::kFilter) continue;
    if (name.empty() ? spec.accepted_by < 0 : spec.name == name) return static_cast<int>(e);
    filters.push_back(spec.name);
  }
  if (name.empty()) return -1;
  const bool is_estimator = std::ranges::count(internal::NamesOf(experiment.estimators), name) > 0;
  internal::RefuseFilter(name, is_estimator, filters);
}

/// Builds the experiment and adds the missing variants, except those in `excluded`. The keys of
/// `excluded` are names, the values are reasons.
ComparedExperiment Build(const Config& config, const PluginHost& host,
                         const CompareOptions& options,
                         const std::map<std::string, std::string>& excluded) {
  // The run computes errors relative to truth. The comparison computes the differences from other
  // references.
  Config base = config.Copy();
  if (base.root().is_map() && base.root().Find("reference")) {
    base.Set("reference", "truth", kOrigin);
    base = base.Copy();
  }
  ComparedExperiment compared{base, BuildExperiment(base, host), "", {}, {}};
  compared.config = *compared.experiment.config;
  const int filter = FindFilter(compared.experiment, options.filter);
  if (filter < 0 || !options.decompose) CheckReference(compared.experiment, options.reference);
  if (filter < 0) return compared;
  compared.filter = compared.experiment.estimators[static_cast<std::size_t>(filter)].name;
  if (!options.decompose) return compared;
  std::map<std::string, std::vector<std::string>> left_out;  // key: reason
  for (const Variant& variant : Variants()) {
    const std::vector<EstimatorSpec>& estimators = compared.experiment.estimators;
    const EstimatorSpec& filter_spec = estimators[static_cast<std::size_t>(filter)];
    const bool exists = std::ranges::any_of(estimators, [&](const EstimatorSpec& spec) {
      return Matches(variant, spec, filter_spec, filter);
    });
    if (exists) continue;
    const auto found = excluded.find(UniqueName(variant.name, estimators));
    if (found != excluded.end()) {
      left_out[found->second].emplace_back(variant.description);
      continue;
    }
    if (variant.full_information && options.full_information == FullInformation::kNever) {
      left_out["--full-information never"].emplace_back(variant.description);
      continue;
    }
    AddVariant(variant, host, compared, left_out);
  }
  for (const auto& [reason, descriptions] : left_out) {
    compared.notes.push_back("the comparison omits " + internal::Join(descriptions, "; ") + ": " +
                             reason);
  }
  CheckReference(compared.experiment, options.reference);
  return compared;
}

/// Returns the added estimators that exceed the budget, each with the reason. Sets `note` to a
/// description of the prediction.
std::map<std::string, std::string> FindBeyondBudget(ComparedExperiment& compared, double budget_s,
                                                    std::string& note) {
  std::map<std::string, std::string> beyond;
  const std::optional<internal::PredictedCpuTime> prediction =
      internal::PredictCpuTime(compared.experiment);
  if (!prediction) {
    note = "the CPU time cannot be predicted, so the budget does not exclude an estimator";
    return beyond;
  }
  const auto seconds = [](double s) { return internal::RoundedText(s, 2) + " s"; };
  double sum_s = 0.0;
  for (std::size_t e = 0; e < prediction->cpu_s.size(); ++e) {
    const std::string& name = compared.experiment.estimators[e].name;
    if (std::ranges::count(compared.added, name) == 0) sum_s += prediction->cpu_s[e];
  }
  for (std::size_t e = 0; e < prediction->cpu_s.size(); ++e) {
    const std::string& name = compared.experiment.estimators[e].name;
    if (std::ranges::count(compared.added, name) == 0) continue;
    if (sum_s + prediction->cpu_s[e] <= budget_s) {
      sum_s += prediction->cpu_s[e];
    } else {
      beyond[name] = "the predicted CPU time is " + seconds(prediction->cpu_s[e]) +
                     ", but the budget is " + seconds(budget_s);
    }
  }
  note = "the predicted total CPU time is " + seconds(sum_s) + "; the prediction uses the first " +
         std::to_string(prediction->frames) + " of " + std::to_string(prediction->total_frames) +
         " frames";
  return beyond;
}

/// Returns the reason to omit the estimator `name` according to FullInformation::kIfFast, or "". If
/// the CPU time cannot be predicted, as for a recording of unknown length, only an estimator with
/// landmarks is omitted.
std::string FindSlowness(ComparedExperiment& compared, const std::string& name, std::int64_t runs) {
  constexpr double kFast_s = 10.0, kMaxShare = 0.5;
  constexpr const char* kRemedy = "; --full-information always includes it";
  std::optional<internal::PredictedCpuTime> prediction;
  try {
    internal::CheckReadableAgain(compared.config);
    prediction = internal::PredictCpuTime(compared.experiment);
  } catch (const Error&) {  // the data can be read only once
  }
  const auto& estimators = compared.experiment.estimators;
  if (!prediction) {
    const auto found = std::ranges::find(estimators, name, &EstimatorSpec::name);
    if (!found->problem.landmarks) return "";
    return std::string("with landmarks, a solve at every frame takes long") + kRemedy;
  }
  double filter_s = 0.0, sum_s = 0.0;
  for (std::size_t e = 0; e < prediction->cpu_s.size(); ++e) {
    const double cpu_s = static_cast<double>(runs) * prediction->cpu_s[e];
    sum_s += cpu_s;
    if (estimators[e].name == name) filter_s = cpu_s;
  }
  if (filter_s < kFast_s || filter_s <= kMaxShare * sum_s) return "";
  return "it would take about " + internal::RoundedText(filter_s, 2) + " s of " +
         internal::RoundedText(sum_s, 2) + " s of CPU time" + kRemedy;
}

/// Returns the name of the full-information filter that was added, or "".
std::string AddedFullInformation(const ComparedExperiment& compared) {
  for (const EstimatorSpec& spec : compared.experiment.estimators) {
    const bool is_added = std::ranges::count(compared.added, spec.name) > 0;
    if (is_added && spec.kind == EstimatorKind::kBatch && !spec.estimator->offline())
      return spec.name;
  }
  return "";
}

/// Builds the experiment again, without the added estimators that exceed the budget of the run.
ComparedExperiment BuildWithinBudget(const Config& config, const PluginHost& host,
                                     const CompareOptions& options, ComparedExperiment& compared) {
  std::string note;
  const auto beyond = FindBeyondBudget(compared, *options.budget_s, note);
  ComparedExperiment affordable = Build(config, host, options, beyond);
  affordable.notes.push_back(note);
  if (!beyond.empty()) {
    affordable.beyond_budget = "the budget of " + internal::RoundedText(*options.budget_s, 2) +
                               " s excludes some of the omitted estimators";
  }
  return affordable;
}

}  // namespace

ComparedExperiment BuildComparedExperiment(const Config& config, const PluginHost& host,
                                           const CompareOptions& options) {
  if (options.over_seeds || options.budget_s) internal::CheckReadableAgain(config);
  ComparedExperiment compared = Build(config, host, options, {});
  if (compared.added.empty()) return compared;
  if (options.budget_s && !options.over_seeds) {
    return BuildWithinBudget(config, host, options, compared);
  }
  const std::string name = AddedFullInformation(compared);
  if (name.empty() || options.full_information == FullInformation::kAlways) return compared;
  const std::string reason = FindSlowness(compared, name, options.runs);
  // The experiment is built again, because the prediction has read the source.
  std::map<std::string, std::string> excluded;
  if (!reason.empty()) excluded[name] = reason;
  compared = Build(config, host, options, excluded);
  if (!reason.empty()) {
    compared.too_slow = "the comparison omits the full-information filter: " + reason;
  }
  return compared;
}

}  // namespace alidade
