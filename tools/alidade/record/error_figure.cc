// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/error_figure.h"

#include <algorithm>
#include <iterator>

namespace alidade::internal {
namespace {

FigureFile Errors(const RecordedEstimator& estimator) {
  return {estimator.name + "/errors.csv", estimator.estimate_rows};
}

std::string InFigure(const std::string& column, const RecordedError& element) {
  return GnuplotColumn(column) + (element.is_angle ? " * 180 / pi" : "");
}

/// Starts the panel of an element, with a line at zero.
void StartPanel(FigureScript& script, const RecordedError& element) {
  script.Panel(element.name, InBrackets(element.is_angle ? "deg" : element.unit));
  script.Set("set arrow 1 from graph 0, first 0 to graph 1, first 0 nohead front ls 12");
}

void SetRange(FigureScript& script) {
  script.Set("limit = limit + margin(-limit, limit)");
  script.Set("set yrange [-limit : limit]\nset ytics tic_step(limit / 2)");
}

/// The error in full, but for what is far beyond most of it, and most of the band.
void ErrorRange(FigureScript& script, const std::string& file, const std::string& error,
                const std::string& sigma) {
  script.Quartiles("E", file, "abs(" + error + ")");
  script.Set("limit = min(E_max, 6 * E_up_quartile)");
  if (!sigma.empty()) {
    script.Quartiles("S", file, sigma);
    script.Set("limit = max(limit, 3 * S_up_quartile)");
  }
  SetRange(script);
}

bool IsSame(const RecordedError& one, const RecordedError& another) {
  return one.truth == another.truth && one.part == another.part;
}

/// The error of one element, whatever the estimators call it. One that is far larger than that of
/// another estimator leaves the panel.
void ComparisonPanel(FigureScript& script, const RecordedRun& run, const RecordedError& element) {
  StartPanel(script, element);
  script.Set("least = 1e300\nlargest = 0.0");
  for (std::size_t i = 0; i < std::min(run.estimators.size(), kMaxCurves); ++i) {
    const RecordedEstimator& estimator = run.estimators[i];
    for (const RecordedError& error : estimator.errors) {
      if (!error.is_known || !IsSame(error, element)) continue;
      const std::string value = InFigure(error.name, error);
      script.Quartiles("E", Errors(estimator).name, "abs(" + value + ")");
      script.Set("limit = min(E_max, 6 * E_up_quartile)");
      script.Set("least = limit > 0 ? min(least, limit) : least\nlargest = max(largest, limit)");
      script.Curve(Errors(estimator),
                   FigureScript::kTime + ('(' + value + ") with lines ls " + std::to_string(i + 1)),
                   estimator.name);
    }
  }
  script.Set("limit = min(largest, 4 * least)");
  SetRange(script);
}

}  // namespace

std::vector<FigureScript> ErrorFigures(const RecordedRun& run, const RecordedEstimator& estimator) {
  const FigureFile file = Errors(estimator);
  std::vector<RecordedError> elements;
  std::ranges::copy_if(estimator.errors, std::back_inserter(elements), &RecordedError::is_known);
  const auto panel = [&](FigureScript& script, std::size_t index) {
    const RecordedError& element = elements[index];
    const std::string error = InFigure(element.name, element);
    const std::string sigma = InFigure("sigma:" + element.name, element);
    StartPanel(script, element);
    ErrorRange(script, file.name, error, element.is_random ? sigma : "");
    if (element.is_random) {
      script.Curve(
          file,
          FigureScript::kTime + ("(-3 * " + sigma + "):(3 * " + sigma) + ") with filledcurves ls 1",
          "+-3 sigma");
    }
    script.Curve(file, FigureScript::kTime + ('(' + error + ") with lines ls 1"), "error");
  };
  return FigurePages(
      {estimator.name + ".errors", estimator.name + ": error and 3 sigma", run.first, run.last},
      elements.size(), panel);
}

std::vector<FigureScript> ErrorComparisonFigures(const RecordedRun& run, const std::string& title) {
  std::vector<RecordedError> elements;
  for (const RecordedEstimator& estimator : run.estimators) {
    for (const RecordedError& error : estimator.errors) {
      const auto same = [&](const RecordedError& other) { return IsSame(error, other); };
      if (error.is_known && std::ranges::none_of(elements, same)) elements.push_back(error);
    }
  }
  const auto panel = [&](FigureScript& script, std::size_t index) {
    ComparisonPanel(script, run, elements[index]);
  };
  return FigurePages({"comparison.errors", title, run.first, run.last}, elements.size(), panel);
}

}  // namespace alidade::internal
