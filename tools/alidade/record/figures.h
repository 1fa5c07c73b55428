// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/io/output_folder.h"
#include "alidade/record/figure_script.h"
#include "alidade/record/gnuplot.h"
#include "alidade/record/recorded_run.h"

namespace alidade::internal {

/// A figure that was drawn: `figures/NAME.svg`.
struct Figure {
  std::string name;
  std::string title;
  std::string estimator;  ///< "" where it is of all
};

struct Figures {
  std::vector<Figure> drawn;
  bool has_png = false;  ///< of the first
  std::string note;      ///< why some or all are missing, or ""
};

/// Draws `figures/NAME` by these arguments of gnuplot; half drawn is none.
GnuplotResult DrawFigure(const OutputFolder& folder, const std::string& name,
                         const std::vector<std::string>& arguments, const DrawingLimits& limits);

/// Draws what the csv files hold: the measurements and what they tell, the estimators side by side,
/// and for each estimator its errors, state, variances, gains and innovations. The scripts are all
/// written, and first. What gnuplot cannot do, or not within the limits, is noted, no error.
/// Errors: kIo.
Figures DrawFigures(const OutputFolder& folder, const RecordedRun& run,
                    const DrawingLimits& limits);
/// Likewise what these scripts draw, in their order.
Figures DrawScripts(const OutputFolder& folder, const std::vector<FigureScript>& scripts,
                    const DrawingLimits& limits);

}  // namespace alidade::internal
