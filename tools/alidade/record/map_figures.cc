// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/map_figures.h"

namespace alidade::internal {
namespace {

/// Names the ends of an axis that shows the path in full and most of the landmarks, `x_low` and
/// `x_high`, and notes the longest axis.
void MapRange(FigureScript& script, const FigureFile& path_file, const std::string& path,
              const FigureFile& map_file, const std::string& axis) {
  script.Quartiles("P", path_file.name, GnuplotColumn(path));
  script.Quartiles("L", map_file.name, GnuplotColumn(axis));
  script.Set("reach = 3 * (L_up_quartile - L_lo_quartile)");
  script.Set("low = min(P_min, max(L_min, L_lo_quartile - reach))");
  script.Set("high = max(P_max, min(L_max, L_up_quartile + reach))");
  script.Set(axis + "_low = low - margin(low, high)\n" + axis + "_high = high + margin(low, high)");
  script.Set("longest = max(longest, " + axis + "_high - " + axis + "_low)");
}

/// An axis is no shorter than a quarter of the longest: a flat view stays legible.
std::string RangeOf(const std::string& axis) {
  const std::string low = axis + "_low", high = axis + "_high";
  return "[min(" + low + ", (" + low + " + " + high + " - longest / 4) / 2) : max(" + high + ", (" +
         low + " + " + high + " + longest / 4) / 2)]";
}

constexpr const char* kAxisNames[] = {"x", "y", "z"};

/// What the views are drawn from.
struct MapData {
  RecordedMap map;
  const RecordedElement* path;  ///< three
  FigureFile path_file, map_file, truth_file;
};

/// A curve through the points (u, v).
void Points(FigureScript& script, const FigureFile& file, const std::string& u,
            const std::string& v, const char* style, const char* key) {
  script.Curve(file, '(' + u + "):(" + v + ") with " + style, key);
}

/// How landmarks of one status are drawn.
struct LandmarkStyle {
  const char* status;  ///< as in landmarks.csv
  const char* bars;    ///< null: without, as there may be very many
  const char *places, *true_places, *key;
};
constexpr LandmarkStyle kKept = {"kept", "ls 19", "ls 14 ps 0.6", "ls 18", "landmarks"};
constexpr LandmarkStyle kRemoved = {"removed", nullptr, "ls 20", "ls 21", "landmarks, removed"};

/// The landmarks of one status, of which there is one at least, with true ones, and where the style
/// has bars with those of 3 sigma.
void AddLandmarks(FigureScript& script, const MapData& data, const LandmarkStyle& style, int u,
                  int v) {
  const auto place = [&](const std::string& prefix) {
    return "(strcol('status') eq '" + std::string(style.status) + "' ? " +
           GnuplotColumn(prefix + kAxisNames[u]) + " : NaN):(" +
           GnuplotColumn(prefix + kAxisNames[v]) + ')';
  };
  const auto bar = [](int axis) {
    return ":(3 * " + GnuplotColumn(std::string("sigma_") + kAxisNames[axis]) + ')';
  };
  const std::string key = style.key;
  if (style.bars != nullptr) {
    script.Curve(data.map_file, place("") + bar(u) + bar(v) + " with xyerrorbars " + style.bars,
                 key + ", +-3 sigma");
  }
  script.Curve(data.map_file, place("") + " with points " + style.places, key);
  if (data.map.known == 0) return;
  script.Curve(data.map_file, place("true_") + " with points " + style.true_places, key + ", true");
}

/// The view along the third axis, u to the right and v upwards.
void AddView(FigureScript& script, const MapData& data, int u, int v) {
  const std::string across = kAxisNames[u], up = kAxisNames[v];
  script.Set("set xlabel '" + across + " [m]' offset 0,0.5 noenhanced");
  script.Set("set xrange " + RangeOf(across) + "\nset yrange " + RangeOf(up));
  if (data.map.removed > 0) AddLandmarks(script, data, kRemoved, u, v);
  if (data.map.removed < data.map.placed) AddLandmarks(script, data, kKept, u, v);
  const RecordedElement &right = data.path[u], &upward = data.path[v];
  Points(script, data.path_file, GnuplotColumn(right.name), GnuplotColumn(upward.name),
         "lines ls 2", "trajectory");
  if (!right.has_truth) return;
  Points(script, data.truth_file, GnuplotColumn(right.truth), GnuplotColumn(upward.truth),
         "lines ls 11", "trajectory, true");
}

}  // namespace

FigureScript MapFigure(const RecordedRun& run, const RecordedEstimator& estimator) {
  constexpr int kHeight = 440;
  FigureScript script(estimator.name + ".map",
                      estimator.name + ": trajectory and map, from three sides", "y [m]");
  if (estimator.path < 0 || estimator.map.placed == 0) return script;
  const MapData data{estimator.map,
                     &estimator.elements[static_cast<std::size_t>(estimator.path)],
                     {estimator.name + "/estimates.csv", estimator.estimate_rows},
                     {estimator.name + "/landmarks.csv", estimator.map.placed},
                     {"truth.csv", run.truth_rows}};
  script.PanelHeight(kHeight);
  script.Columns(2);
  script.Panel("", "y [m]");
  script.Set("longest = 0.0");
  for (int i = 0; i < 3; ++i) {
    MapRange(script, data.path_file, data.path[i].name, data.map_file, kAxisNames[i]);
  }
  script.Set("step = tic_step(longest / 8)\nset xtics step\nset ytics step");
  script.Set("set size ratio -1\nset lmargin 9\nset rmargin 2\nset bmargin 3\nunset key");
  AddView(script, data, 0, 1);
  script.Panel("", "z [m]");
  AddView(script, data, 0, 2);
  script.Panel("", "z [m]");
  script.Set("set key at screen 0.56, screen 0.42");  // in the place of a fourth panel
  AddView(script, data, 1, 2);
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
