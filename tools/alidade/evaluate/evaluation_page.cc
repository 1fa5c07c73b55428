// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/evaluation_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/base/text.h"
#include "alidade/evaluate/length_errors.h"
#include "alidade/report/conclusion.h"
#include "alidade/report/page_text.h"
#include "alidade/report/trajectory_data.h"

namespace alidade {
namespace {

using internal::Conclusion;
using internal::Json;
using internal::PageTrajectory;
using internal::RoundedText;

using Evaluations = std::vector<Evaluation>;

/// Returns the timestamps of a trajectory. Without timestamps, row i has the time i s.
std::vector<Timestamp> TimesOf(const Trajectory& trajectory) {
  constexpr Timestamp kSecond = 1'000'000'000;
  std::vector<Timestamp> times = trajectory.timestamps;
  for (int i = 0; !trajectory.has_timestamps() && i < trajectory.size(); ++i) {
    times.push_back(i * kSecond);
  }
  return times;
}

PageTrajectory TrajectoryOf(const std::string& name, const Trajectory& trajectory) {
  PageTrajectory page{name, TimesOf(trajectory), {}, {}, {}, {}, {}};
  for (int i = 0; i < trajectory.size(); ++i) {
    const Eigen::Vector3d p = trajectory.positions.col(i);
    const Eigen::Quaterniond& q = trajectory.orientations[static_cast<std::size_t>(i)];
    page.positions.push_back({p.x(), p.y(), p.z()});
    page.orientations.push_back({q.w(), q.x(), q.y(), q.z()});
  }
  return page;
}

PageTrajectory EstimateOf(const Evaluation& evaluation) {
  PageTrajectory page = TrajectoryOf(evaluation.label, evaluation.estimate);
  const Eigen::Matrix3Xd errors = evaluation.estimate.positions - evaluation.reference.positions;
  for (Eigen::Index i = 0; i < errors.cols(); ++i) {
    page.errors.push_back({errors(0, i), errors(1, i), errors(2, i)});
  }
  return page;
}

Json StatisticsJson(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median},
          {"std", s.std},   {"min", s.min},   {"max", s.max}};
}

/// Returns the errors of one relation. `kind` is `ATE` or `RPE`.
Json ErrorsOf(const Evaluation& evaluation, const char* kind, const PoseErrors& errors,
              const std::vector<Timestamp>& times, Timestamp origin, internal::ColumnPool& pool) {
  return {{"estimator", evaluation.label},
          {"kind", kind},
          {"relation", ToString(errors.relation)},
          {"unit", UnitOf(errors.relation)},
          {"statistics", StatisticsJson(errors.statistics)},
          {"t", pool.AddTimes(times, origin)},
          {"v", pool.AddNumbers(errors.errors)}};
}

/// Returns the absolute errors at each pose, and the relative errors at the second pose of a pair.
void AppendErrors(const Evaluation& evaluation, Timestamp origin, internal::ColumnPool& pool,
                  Json& list) {
  const std::vector<Timestamp> times = TimesOf(evaluation.estimate);
  for (const PoseErrors& errors : evaluation.absolute) {
    list.push_back(ErrorsOf(evaluation, "ATE", errors, times, origin, pool));
  }
  std::vector<Timestamp> ends;
  for (const auto& [begin, end] : evaluation.pairs) {
    ends.push_back(times[static_cast<std::size_t>(end)]);
  }
  for (const PoseErrors& errors : evaluation.relative) {
    list.push_back(ErrorsOf(evaluation, "RPE", errors, ends, origin, pool));
  }
}

/// Returns the quantiles of the relative errors over each length, a row for each length.
Json LengthData(const Evaluation& evaluation) {
  const auto quantiles = [](const std::vector<double>& ascending) {
    Json values = Json::array();
    for (const double q : {0.05, 0.25, 0.5, 0.75, 0.95}) values.push_back(Quantile(ascending, q));
    return values;
  };
  Json rows = Json::array();
  for (const auto& [length, translations, angles] :
       internal::ErrorsOverLengths(evaluation.reference, evaluation.estimate)) {
    rows.push_back({{"length", length},
                    {"pairs", translations.size()},
                    {"translation", quantiles(translations)},
                    {"angle", quantiles(angles)}});
  }
  return {{"estimator", evaluation.label}, {"rows", rows}};
}

std::string ErrorText(const PoseErrors& errors) {
  const std::string unit = UnitOf(errors.relation);
  return RoundedText(errors.statistics.rmse, 3) + (unit.empty() ? "" : ' ' + unit) + " rmse (" +
         ToString(errors.relation) + ')';
}

Conclusion ErrorConclusion(const Evaluation& evaluation) {
  std::vector<std::string> errors;
  for (const PoseErrors& absolute : evaluation.absolute) errors.push_back(ErrorText(absolute));
  const std::string scale = evaluation.sim3_scale ? "scale of the Sim(3) alignment " +
                                                        RoundedText(*evaluation.sim3_scale, 5)
                                                  : "";
  return {Conclusion::Tone::kNeutral,
          evaluation.label + ": absolute error " + internal::Join(errors, ", ") + " over " +
              std::to_string(evaluation.estimate.size()) + " of " +
              std::to_string(evaluation.possible) + " poses, alignment " +
              ToString(evaluation.options.alignment) + '.',
          scale};
}

/// Returns a sentence about the NEES of the positions, or nothing.
void AppendNees(const Evaluation& evaluation, std::vector<Conclusion>& conclusions) {
  if (!evaluation.position_nees) return;
  const Nees& nees = *evaluation.position_nees;
  conclusions.push_back({Conclusion::Tone::kNeutral,
                         evaluation.label + ": the NEES of the positions is " +
                             RoundedText(nees.mean, 3) +
                             " per degree of freedom, and 1 is expected.",
                         RoundedText(100.0 * nees.within95, 3) + " % inside the 95 % region"});
}

std::vector<Conclusion> ConclusionsOf(const Evaluations& evaluations) {
  std::vector<Conclusion> conclusions;
  for (const Evaluation& evaluation : evaluations) {
    conclusions.push_back(ErrorConclusion(evaluation));
    AppendNees(evaluation, conclusions);
    for (const std::string& warning : evaluation.warnings) {
      conclusions.push_back(
          {Conclusion::Tone::kWarning, evaluation.label + ": " + warning + '.', ""});
    }
  }
  return conclusions;
}

/// Returns the reference poses of the evaluation with the most matches.
const Trajectory& LargestReference(const Evaluations& evaluations) {
  const auto size = [](const Evaluation& evaluation) { return evaluation.reference.size(); };
  return std::ranges::max_element(evaluations, {}, size)->reference;
}

}  // namespace

std::string EvaluationPage(const Evaluations& all) {
  Evaluations evaluations = all;
  std::erase_if(evaluations, [](const Evaluation& e) { return !e.error.empty(); });
  if (evaluations.empty()) {
    throw Error(ExitCode::kBadData, "no page was written, because no estimate could be evaluated");
  }
  internal::ColumnPool pool;
  const Trajectory& longest = LargestReference(evaluations);
  const PageTrajectory reference = TrajectoryOf("reference", longest);
  std::vector<PageTrajectory> estimates;
  for (const Evaluation& evaluation : evaluations) estimates.push_back(EstimateOf(evaluation));
  const Json run = internal::TrajectoryData(estimates, &reference, pool);
  Timestamp origin = reference.timestamps.front();
  for (const PageTrajectory& estimate : estimates) {
    origin = std::min(origin, estimate.timestamps.front());
  }
  Json errors = Json::array(), lengths = Json::array();
  for (const Evaluation& evaluation : evaluations) {
    AppendErrors(evaluation, origin, pool, errors);
    lengths.push_back(LengthData(evaluation));
  }
  std::vector<std::string> labels;
  for (const Evaluation& evaluation : evaluations) labels.push_back(evaluation.label);
  const std::string title = internal::JoinNames(labels);
  const std::string reference_name = std::filesystem::path(longest.name).filename().string();
  return internal::PageText(
      {{"title", title + " against " + reference_name},
       {"reference", reference_name},
       {"run", run},
       {"evaluation",
        {{"conclusions", internal::ConclusionsJson(ConclusionsOf(evaluations))},
         {"errors", errors},
         {"lengths", lengths}}}},
      pool);
}

}  // namespace alidade
