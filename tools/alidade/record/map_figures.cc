// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/map_figures.h"

namespace alidade::internal {
namespace {

/// The range of an axis that shows the path in full, and most of the landmarks.
void MapRange(FigureScript& script, const FigureFile& path_file, std::string_view path,
              const FigureFile& map_file, std::string_view axis, std::string_view range) {
  script.Quartiles("P", path_file.name, GnuplotColumn(path));
  script.Quartiles("L", map_file.name, GnuplotColumn(axis));
  script.Set("reach = 3 * (L_up_quartile - L_lo_quartile)");
  script.Set("low = min(P_min, max(L_min, L_lo_quartile - reach))");
  script.Set("high = max(P_max, min(L_max, L_up_quartile + reach))");
  script.Set("set " + std::string(range) + " [low - margin(low, high) : high + margin(low, high)]");
}

}  // namespace

FigureScript MapFigure(const RecordedRun& run, const RecordedEstimator& estimator) {
  constexpr int kHeight = 560;
  const std::string axes[] = {"x", "y", "z"};
  const auto [placed, known, across, along] = estimator.map;
  const std::string &u = axes[across], &v = axes[along];
  FigureScript script(estimator.name + ".map",
                      estimator.name + ": trajectory and map, " + v + " over " + u, u + " [m]");
  if (estimator.path < 0 || placed == 0) return script;
  const RecordedElement* const path = &estimator.elements[static_cast<std::size_t>(estimator.path)];
  const FigureFile path_file{estimator.name + "/estimates.csv", estimator.estimate_rows};
  const FigureFile map_file{estimator.name + "/landmarks.csv", placed};
  const auto curve = [&](const FigureFile& file, const std::string& x, const std::string& y,
                         const char* style, const char* key) {
    script.Curve(file, '(' + GnuplotColumn(x) + "):(" + GnuplotColumn(y) + ") with " + style, key);
  };
  script.PanelHeight(kHeight);
  script.Panel("", v + " [m]");
  script.Set("set size ratio -1");
  MapRange(script, path_file, path[across].name, map_file, u, "xrange");
  MapRange(script, path_file, path[along].name, map_file, v, "yrange");
  if (known > 0) curve(map_file, "true_" + u, "true_" + v, "points ls 18", "landmarks, true");
  curve(map_file, u, v, "points ls 14 ps 0.6", "landmarks");
  curve(path_file, path[across].name, path[along].name, "lines ls 2", "trajectory");
  if (path->has_truth) {
    curve({"truth.csv", run.truth_rows}, path[across].truth, path[along].truth, "lines ls 11",
          "trajectory, true");
  }
  return script;
}

FigureScript ReprojectionFigure(const RecordedRun& run, const RecordedEstimator& estimator) {
  FigureScript script(estimator.name + ".reprojection",
                      estimator.name + ": rms innovation of each frame", run.first, run.last);
  if (estimator.reprojection_rows == 0) return script;
  const FigureFile file{estimator.name + "/reprojection.csv", estimator.reprojection_rows};
  for (const RecordedSensor& sensor : estimator.sensors) {
    if (!sensor.has_reprojection || !sensor.has_innovations) continue;
    script.Panel(sensor.name, "rms of z - h " + InBrackets(sensor.unit));
    script.Set("set yrange [0:]");
    script.LineOf(file, "strcol('sensor') eq " + GnuplotQuoted(sensor.name), GnuplotColumn("rms"),
                  1, "");
  }
  return script;
}

}  // namespace alidade::internal
