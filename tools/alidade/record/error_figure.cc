// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/error_figure.h"

#include <algorithm>
#include <iterator>

namespace alidade::internal {
namespace {

/// The error in full, but for what is far beyond most of it, and most of the band.
void ErrorRange(FigureScript& script, const std::string& file, const std::string& error,
                const std::string& sigma) {
  script.Quartiles("E", file, "abs(" + error + ")");
  script.Set("limit = min(E_max, 6 * E_up_quartile)");
  if (!sigma.empty()) {
    script.Quartiles("S", file, sigma);
    script.Set("limit = max(limit, 3 * S_up_quartile)");
  }
  script.Set("limit = limit + margin(-limit, limit)");
  script.Set("set yrange [-limit : limit]\nset ytics tic_step(limit / 2)");
}

}  // namespace

std::vector<FigureScript> ErrorFigures(const RecordedRun& run, const RecordedEstimator& estimator) {
  const FigureFile file{estimator.name + "/errors.csv", estimator.estimate_rows};
  std::vector<RecordedError> elements;
  std::ranges::copy_if(estimator.errors, std::back_inserter(elements), &RecordedError::is_known);
  const auto panel = [&](FigureScript& script, std::size_t index) {
    const RecordedError& element = elements[index];
    const std::string scale = element.is_angle ? " * 180 / pi" : "";
    const std::string error = GnuplotColumn(element.name) + scale;
    const std::string sigma = GnuplotColumn("sigma:" + element.name) + scale;
    script.Panel(element.name, InBrackets(element.is_angle ? "deg" : element.unit));
    script.Set("set arrow 1 from graph 0, first 0 to graph 1, first 0 nohead front ls 12");
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

}  // namespace alidade::internal
