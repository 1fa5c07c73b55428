// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/figures.h"

#include <algorithm>
#include <iterator>

#include "alidade/record/error_figure.h"
#include "alidade/record/figure_script.h"
#include "alidade/record/gnuplot.h"
#include "alidade/record/map_figures.h"
#include "alidade/record/timing_file.h"

namespace alidade::internal {
namespace {

std::string Sigma(const std::string& element) { return GnuplotColumn("sigma:" + element); }

std::string Is(const char* column, std::string_view text) {
  return "strcol('" + std::string(column) + "') eq " + GnuplotQuoted(text);
}

std::string OverTime(const std::string& y) { return FigureScript::kTime + y; }

std::string Line(std::string_view column, int style) {
  return OverTime('(' + GnuplotColumn(column) + ')') + " with lines ls " + std::to_string(style);
}

/// The line of an element; that of an angle is broken where it leaps from one end of (-pi, pi] to
/// the other.
void ElementCurve(FigureScript& script, const FigureFile& file, const std::string& column,
                  const std::string& unit, int style, std::string_view key) {
  if (unit != "rad") return script.Curve(file, Line(column, style), key);
  const std::string broken = "(now = " + GnuplotColumn(column) +
                             ", leap = column(0) > 0 && abs(now - before) > pi, before = now, "
                             "leap ? NaN : now)";
  script.Curve(file, OverTime('(' + broken + ')') + " with lines ls " + std::to_string(style), key);
}

/// `value` where the condition holds, else nothing.
std::string Where(const std::string& condition, const std::string& value) {
  return '(' + condition + " ? " + value + " : NaN)";
}

int EstimatorStyle(std::size_t index) { return static_cast<int>(index % kMaxCurves) + 1; }

/// Of rows in a file: how many of those who may write to it did.
template <class Some, class Did>
int Kinds(const Some& some, const Did& did) {
  return std::max(1, static_cast<int>(std::ranges::count_if(some, did)));
}

FigureFile Estimates(const RecordedEstimator& e) {
  return {e.name + "/estimates.csv", e.estimate_rows};
}
FigureFile Innovations(const RecordedEstimator& e) {
  return {e.name + "/innovations.csv", e.innovation_rows,
          Kinds(e.sensors, [](const auto& sensor) { return sensor.has_innovations; })};
}

void TruthCurve(FigureScript& script, const RecordedRun& run, const RecordedElement& element) {
  if (!element.has_truth) return;
  ElementCurve(script, {"truth.csv", run.truth_rows}, element.truth, element.unit, 11, "truth");
}

/// The y range that shows estimate and truth in full, and most of the band.
void StateRange(FigureScript& script, const RecordedEstimator& estimator,
                const RecordedElement& element) {
  script.Quartiles("E", Estimates(estimator).name, GnuplotColumn(element.name));
  if (element.is_random) script.Quartiles("S", Estimates(estimator).name, Sigma(element.name));
  std::string low = "E_min", high = "E_max";
  if (element.has_truth) {
    script.Quartiles("T", "truth.csv", GnuplotColumn(element.truth));
    low = "min(E_min, T_min)";
    high = "max(E_max, T_max)";
  }
  script.Set("low = " + low + (element.is_random ? " - 3 * S_up_quartile" : ""));
  script.Set("high = " + high + (element.is_random ? " + 3 * S_up_quartile" : ""));
  script.Set("set yrange [low - margin(low, high) : high + margin(low, high)]");
}

std::vector<FigureScript> StateFigures(const RecordedRun& run, const RecordedEstimator& estimator) {
  std::vector<RecordedElement> elements;
  std::ranges::copy_if(estimator.elements, std::back_inserter(elements), &RecordedElement::varies);
  const auto panel = [&](FigureScript& script, std::size_t index) {
    const RecordedElement& element = elements[index];
    script.Panel(element.name, InBrackets(element.unit));
    StateRange(script, estimator, element);
    const std::string value = GnuplotColumn(element.name), sigma = Sigma(element.name);
    if (element.is_random) {
      script.Curve(Estimates(estimator),
                   OverTime("(" + value + "-3*" + sigma + "):(" + value + "+3*" + sigma + ")") +
                       " with filledcurves ls 1",
                   "+-3 sigma");
    }
    ElementCurve(script, Estimates(estimator), element.name, element.unit, 1, "estimate");
    TruthCurve(script, run, element);
  };
  return FigurePages({estimator.name + ".state", estimator.name + ": state, 3 sigma and truth",
                      run.first, run.last},
                     elements.size(), panel);
}

std::string Squared(const std::string& unit) {
  if (unit.empty()) return "";
  const bool is_simple = unit.find_first_of("/ ^") == unit.npos;
  return (is_simple ? unit : '(' + unit + ')') + "^2";
}

FigureScript CovarianceFigure(const RecordedRun& run, const RecordedEstimator& estimator) {
  FigureScript script(estimator.name + ".covariance", estimator.name + ": variance of each element",
                      run.first, run.last);
  std::size_t curves = 0;
  for (const RecordedSigma& element : estimator.sigmas) {
    if (!element.is_random || curves == kMaxPanels) continue;
    if (script.empty()) {
      script.Panel("diagonal of P", "variance");
      script.Set("set logscale y\nset format y '%.0e'\nunset mytics");
      script.Set("low = 1e300\nhigh = 1e-300");
    }
    const std::string sigma = Sigma(element.name);
    const std::string variance = Where(sigma + " > 0", sigma + "**2");
    script.Quartiles("V", Estimates(estimator).name, variance);
    script.Set("low = min(low, V_min)\nhigh = max(high, V_max)");
    const std::string dashes = curves < kMaxCurves ? "" : " dt 2";  // of a colour that comes again
    script.Curve(
        Estimates(estimator),
        OverTime(variance) + " with lines ls " + std::to_string(EstimatorStyle(curves)) + dashes,
        element.name + " " + InBrackets(Squared(element.unit)));
    ++curves;
  }
  // Whole decades, and a tick for each, or for every second, third, ... of them.
  script.Set("low = floor(log10(low))\nhigh = max(ceil(log10(high)), low + 1)");
  script.Set("set yrange [10**low : 10**high]\nset ytics 10**max(1, ceil((high - low) / 5.0))");
  return script;
}

/// What is known of each of a sensor's measurements: a line through them, or dots where a line
/// would lead from one of a timestamp to another.
void EachMeasurement(FigureScript& script, const FigureFile& file, bool several,
                     const std::string& mine, const std::string& value, int style,
                     const std::string& key) {
  if (!several) return script.LineOf(file, mine, value, style, key);
  script.Curve(
      file,
      OverTime(Where(mine, value)) + " with points ls " + std::to_string(style) + " pt 7 ps 0.15",
      key);
}

/// The panel names the sensor: where that measures one element, the block element says it all.
std::string KeyOf(const RecordedGain& gain, const RecordedSensor& sensor) {
  const std::string name =
      sensor.tangent > 1 ? gain.name : gain.name.substr(0, gain.name.find("<-"));
  return gain.unit.empty() ? name : name + ' ' + InBrackets(gain.unit);
}

FigureScript GainFigure(const RecordedRun& run, const RecordedEstimator& estimator) {
  FigureScript script(estimator.name + ".gain", estimator.name + ": Kalman gain of each sensor",
                      run.first, run.last);
  const auto is_used = [](const RecordedSensor& sensor) {
    return std::ranges::any_of(sensor.gains, &RecordedGain::used);
  };
  const FigureFile file{estimator.name + "/gains.csv", estimator.gain_rows,
                        Kinds(estimator.sensors, is_used)};
  std::size_t panels = 0;
  for (const RecordedSensor& sensor : estimator.sensors) {
    std::size_t curves = 0;
    for (const RecordedGain& gain : sensor.gains) {
      if (!gain.used || curves == kMaxCurves || panels > kMaxPanels) continue;
      if (curves == 0 && panels++ < kMaxPanels) script.Panel(sensor.name, "K");
      EachMeasurement(script, file, sensor.has_several, Is("sensor", sensor.name),
                      GnuplotColumn(gain.name), EstimatorStyle(curves++), KeyOf(gain, sensor));
    }
  }
  return script;
}

/// One element of a sensor's innovation, with +-3 sigma of S. What lies beyond the axis is drawn on
/// its edge.
void InnovationPanel(FigureScript& script, const RecordedEstimator& estimator,
                     const RecordedSensor& sensor, int element) {
  const FigureFile file = Innovations(estimator);
  const std::string r = GnuplotColumn('r' + std::to_string(element));
  const std::string s = GnuplotColumn('s' + std::to_string(element));
  const std::string mine = Is("sensor", sensor.name);
  const std::string count = sensor.tangent > 1 ? " " + std::to_string(element) : "";
  script.Panel(sensor.name + count, "z - h " + InBrackets(sensor.unit));
  script.Quartiles("S", file.name, Where(mine, s));
  script.Set("limit = 5 * S_up_quartile");
  script.Set("set yrange [-limit : limit]");
  EachMeasurement(script, file, sensor.has_several, mine, "3 * " + s, 12, "+-3 sqrt(S)");
  EachMeasurement(script, file, sensor.has_several, mine, "-3 * " + s, 12, "");
  const auto points = [&](const std::string& condition, const std::string& value,
                          const std::string& style, const char* key) {
    script.Curve(file, OverTime(Where(mine + " && " + condition, value)) + " with points " + style,
                 key);
  };
  points("strcol('outcome') eq 'accepted'", r, "ls 14", "accepted");
  points("strcol('outcome') ne 'accepted'", r, "ls 16", "not used");
  points("abs(" + r + ") > limit", "0.97 * limit * sgn(" + r + ')', "ls 17", "beyond the axis");
}

FigureScript InnovationFigure(const RecordedRun& run, const RecordedEstimator& estimator) {
  constexpr int kMaxElements = 3;
  FigureScript script(estimator.name + ".innovation",
                      estimator.name + ": innovation of each sensor", run.first, run.last);
  std::size_t panels = 0;
  for (const RecordedSensor& sensor : estimator.sensors) {
    if (!sensor.has_innovations) continue;
    for (int i = 0; i < std::min(sensor.tangent, kMaxElements); ++i) {
      if (panels++ < kMaxPanels) InnovationPanel(script, estimator, sensor, i);
    }
  }
  return script;
}

/// What the measurements say of a block by themselves, with truth and estimates.
void ImpliedPanel(FigureScript& script, const RecordedRun& run, const RecordedImplied& implied) {
  script.Panel(implied.block + " from single measurements", InBrackets(implied.unit));
  script.Quartiles("I", "implied_states.csv", GnuplotColumn(implied.block));
  script.Set("low = max(I_min, I_lo_quartile - 2 * (I_up_quartile - I_lo_quartile))");
  script.Set("high = min(I_max, I_up_quartile + 2 * (I_up_quartile - I_lo_quartile))");
  const RecordedElement* truth = nullptr;
  for (const RecordedEstimator& estimator : run.estimators) {
    for (const RecordedElement& element : estimator.elements) {
      if (element.name == implied.block && element.has_truth) truth = &element;
    }
  }
  if (truth != nullptr) {
    script.Quartiles("T", "truth.csv", GnuplotColumn(truth->truth));
    script.Set("low = min(low, T_min)\nhigh = max(high, T_max)");
  }
  script.Set("set yrange [low - margin(low, high) : high + margin(low, high)]");
  int style = 13;
  for (const RecordedImplied& one : run.implied) {
    if (one.block != implied.block || one.rows == 0) continue;
    script.Curve({"implied_states.csv", run.implied_rows,
                  Kinds(run.implied, [](const auto& some) { return some.rows > 0; })},
                 OverTime(Where(Is("sensor", one.sensor), GnuplotColumn(one.block))) +
                     " with points ls " + std::to_string(style),
                 "measured: " + one.sensor + (one.rest_at_truth ? ", rest true" : ""));
    style = style == 15 ? 13 : style + 1;
  }
  for (std::size_t i = 0; i < std::min(run.estimators.size(), kMaxCurves); ++i) {
    const RecordedEstimator& estimator = run.estimators[i];
    for (const RecordedElement& element : estimator.elements) {
      if (element.name != implied.block || !element.has_value) continue;
      script.Curve(Estimates(estimator), Line(element.name, EstimatorStyle(i)), estimator.name);
    }
  }
  if (truth != nullptr) TruthCurve(script, run, *truth);
}

/// The first estimator with a sensor on the stream, and that sensor.
std::pair<const RecordedEstimator*, const RecordedSensor*> PredictorOf(const RecordedRun& run,
                                                                       const std::string& stream) {
  for (const RecordedEstimator& estimator : run.estimators) {
    for (const RecordedSensor& sensor : estimator.sensors) {
      if (sensor.stream == stream && sensor.has_innovations) return {&estimator, &sensor};
    }
  }
  return {nullptr, nullptr};
}

/// The rows of a long file of landmarks: each of some of them, so that their tracks stay whole.
std::string OfSomeLandmarks(const FigureFile& file) {
  return " && int(column('landmark')) % " + std::to_string(StrideOf(file)) + " == 0";
}

void StreamPanel(FigureScript& script, const RecordedRun& run, const RecordedStream& stream,
                 int element) {
  constexpr std::int64_t kMostRead = 100'000;  // of a file, to draw some of its rows
  const auto [estimator, sensor] = PredictorOf(run, stream.name);
  const std::string count = stream.size > 1 ? " " + std::to_string(element) : "";
  script.Panel("stream " + stream.name + count + ", as measured",
               InBrackets(sensor != nullptr ? sensor->unit : ""));
  const std::string mine = Is("stream", stream.name);
  const std::string value = GnuplotColumn('v' + std::to_string(element));
  script.Quartiles("M", "measurements.csv", Where(mine, value));
  script.Set("low = max(M_min, M_lo_quartile - 3 * (M_up_quartile - M_lo_quartile))");
  script.Set("high = min(M_max, M_up_quartile + 3 * (M_up_quartile - M_lo_quartile))");
  script.Set("set yrange [low - margin(low, high) : high + margin(low, high)]");
  FigureFile file{"measurements.csv", run.measurement_rows,
                  Kinds(run.streams, [](const auto& one) { return one.rows > 0; })};
  std::string drawn = mine;
  if (sensor != nullptr && sensor->has_landmark && file.rows <= kMostRead) {
    drawn += OfSomeLandmarks(file);
    file.rows = 0;
  }
  script.Curve(file, OverTime(Where(drawn, value)) + " with points ls 13", "measured");
  // Truth and prediction of many measurements at a time lie under these; figure NAME.innovation has
  // what they differ by.
  if (sensor != nullptr && sensor->has_several) return;
  if (stream.expected_rows > 0) {
    script.LineOf({"expected.csv", run.expected_rows,
                   Kinds(run.streams, [](const auto& one) { return one.expected_rows > 0; })},
                  mine, value, 11, "truth");
  }
  if (estimator == nullptr) return;
  script.LineOf(Innovations(*estimator), Is("sensor", sensor->name),
                GnuplotColumn('h' + std::to_string(element)), 1, "predicted: " + estimator->name);
}

FigureScript MeasurementFigure(const RecordedRun& run) {
  constexpr int kMaxElements = 3;
  FigureScript script("measurements", "measurements, and what they imply", run.first, run.last);
  std::vector<std::string> blocks;
  for (const RecordedImplied& implied : run.implied) {
    if (implied.rows == 0 || blocks.size() == kMaxPanels) continue;
    if (std::find(blocks.begin(), blocks.end(), implied.block) != blocks.end()) continue;
    blocks.push_back(implied.block);
    ImpliedPanel(script, run, implied);
  }
  std::size_t panels = blocks.size();
  const bool any_used =
      std::any_of(run.streams.begin(), run.streams.end(), [&](const auto& stream) {
        return stream.rows > 0 && PredictorOf(run, stream.name).second != nullptr;
      });
  for (const RecordedStream& stream : run.streams) {
    if (stream.rows == 0) continue;
    if (any_used && PredictorOf(run, stream.name).second == nullptr) continue;
    for (int i = 0; i < std::min(stream.size, kMaxElements); ++i) {
      if (panels++ < kMaxPanels) StreamPanel(script, run, stream, i);
    }
  }
  return script;
}

/// Elements of one truth, or of one name where none is known, are one and the same.
const std::string& Identity(const RecordedElement& element) {
  return element.truth.empty() ? element.name : element.truth;
}

/// All estimators and truth, for each element that any of them has; then their errors.
std::vector<FigureScript> ComparisonFigures(const RecordedRun& run) {
  const std::size_t count = run.estimators.size();
  if (count < 2) return {};
  const std::string some = count <= kMaxCurves ? ""
                                               : ": the first " + std::to_string(kMaxCurves) +
                                                     " of " + std::to_string(count);
  std::vector<const RecordedElement*> elements;
  for (const RecordedEstimator& estimator : run.estimators) {
    for (const RecordedElement& element : estimator.elements) {
      const auto same = [&](const auto* other) { return Identity(*other) == Identity(element); };
      if (element.varies && std::none_of(elements.begin(), elements.end(), same)) {
        elements.push_back(&element);
      }
    }
  }
  const auto panel = [&](FigureScript& script, std::size_t index) {
    const RecordedElement* const first = elements[index];
    script.Panel(first->name, InBrackets(first->unit));
    for (std::size_t i = 0; i < std::min(run.estimators.size(), kMaxCurves); ++i) {
      const RecordedEstimator& estimator = run.estimators[i];
      for (const RecordedElement& element : estimator.elements) {
        if (!element.has_value || Identity(element) != Identity(*first)) continue;
        const bool named = element.name != first->name;
        ElementCurve(script, Estimates(estimator), element.name, element.unit, EstimatorStyle(i),
                     estimator.name + (named ? ": " + element.name : ""));
      }
    }
    TruthCurve(script, run, *first);
  };
  std::vector<FigureScript> figures =
      FigurePages({"comparison", "estimators side by side" + some, run.first, run.last},
                  elements.size(), panel);
  std::ranges::move(ErrorComparisonFigures(run, "errors side by side" + some),
                    std::back_inserter(figures));
  return figures;
}

/// A figure and the estimator it is of, "" where it is of all.
struct Plan {
  FigureScript script;
  std::string estimator;
};

std::vector<Plan> PlanFigures(const RecordedRun& run) {
  std::vector<Plan> plans = {{MeasurementFigure(run), ""}};
  const auto add = [&](std::vector<FigureScript> scripts, const std::string& estimator) {
    for (FigureScript& script : scripts) plans.push_back({std::move(script), estimator});
  };
  add(ComparisonFigures(run), "");
  add({TimingFigure(run)}, "");
  for (const RecordedEstimator& one : run.estimators) {
    add({MapFigure(run, one), ReprojectionFigure(run, one)}, one.name);
    add(ErrorFigures(run, one), one.name);
    add(StateFigures(run, one), one.name);
    add({CovarianceFigure(run, one), GainFigure(run, one), InnovationFigure(run, one)}, one.name);
  }
  std::erase_if(plans, [](const Plan& plan) { return plan.script.empty(); });
  return plans;
}

}  // namespace

GnuplotResult DrawFigure(const OutputFolder& folder, const std::string& name,
                         const std::vector<std::string>& arguments, const DrawingLimits& limits) {
  const std::filesystem::path figure = folder.Add("figures/") / name;
  const GnuplotResult result = RunGnuplot(folder.partial(), arguments, limits);
  std::error_code ignored;
  if (result.end != GnuplotResult::End::kDrawn) {
    std::filesystem::remove(figure, ignored);
  } else if (!std::filesystem::exists(figure, ignored)) {
    return {GnuplotResult::End::kFailed, "gnuplot wrote nothing"};
  }
  return result;
}

namespace {

Figures DrawPlans(const OutputFolder& folder, const std::vector<Plan>& plans,
                  const DrawingLimits& limits) {
  using End = GnuplotResult::End;
  Figures figures;
  const auto file = [](const Plan& plan) { return "figures/" + plan.script.name() + ".gp"; };
  for (const Plan& plan : plans) folder.Write(file(plan), plan.script.Text());
  std::string why;
  for (const Plan& plan : plans) {
    const std::string& name = plan.script.name();
    const GnuplotResult result = DrawFigure(folder, name + ".svg", {file(plan)}, limits);
    if (const std::string obstacle = Obstacle(result.end); !obstacle.empty()) {
      why = obstacle;
      break;
    }
    if (result.end == End::kFailed && why.empty()) {
      why = name + " is not: " + result.complaint;
    }
    if (result.end != End::kDrawn) continue;
    figures.drawn.push_back({name, plan.script.title(), plan.estimator});
    if (name != "measurements") continue;
    figures.has_png =
        DrawFigure(folder, name + ".png", {"-e", "png=1", file(plan)}, limits).end == End::kDrawn;
  }
  if (!why.empty()) {
    figures.note = std::to_string(figures.drawn.size()) + " of " + std::to_string(plans.size()) +
                   " figures drawn: " + why;
  }
  return figures;
}

}  // namespace

Figures DrawFigures(const OutputFolder& folder, const RecordedRun& run,
                    const DrawingLimits& limits) {
  return DrawPlans(folder, PlanFigures(run), limits);
}

Figures DrawScripts(const OutputFolder& folder, const std::vector<FigureScript>& scripts,
                    const DrawingLimits& limits) {
  std::vector<Plan> plans;
  for (const FigureScript& script : scripts) plans.push_back({script, ""});
  return DrawPlans(folder, plans, limits);
}

}  // namespace alidade::internal
