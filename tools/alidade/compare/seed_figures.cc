// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/seed_figures.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <set>

#include "alidade/io/csv_file.h"
#include "alidade/record/figure_script.h"

namespace alidade::internal {
namespace {

constexpr const char* kOverTime = "over_time.csv";
constexpr const char* kCost = "cost.csv";

using Estimators = std::vector<ComparedEstimator>;

/// The style of estimator `index` in every figure.
std::string StyleOf(std::size_t index) { return " ls " + std::to_string(index % 8 + 1); }

/// A pattern of dashes that lets one curve be seen below another.
std::string DashesOf(std::size_t index) {
  constexpr const char* kDashes[] = {" dt (18,8)", " dt (10,14)", " dt (5,10)", " dt (2,7)"};
  return index == 0 ? "" : kDashes[(index - 1) % 4];
}

/// Of a csv column, in the unit of the figure.
std::string Shown(const std::string& column, bool is_angle) {
  return '(' + GnuplotColumn(column) + (is_angle ? " * 180 / pi)" : ")");
}

/// All timestamps of the estimators, ascending.
std::vector<Timestamp> TimestampsOf(const Estimators& estimators) {
  std::set<Timestamp> all;
  for (const ComparedEstimator& one : estimators) {
    all.insert(one.over_time.timestamps.begin(), one.over_time.timestamps.end());
  }
  return {all.begin(), all.end()};
}

void WriteOverTime(const OutputFolder& folder, const Estimators& estimators,
                   const std::vector<Timestamp>& timestamps) {
  std::vector<std::string> header = {"t_s"};
  std::vector<std::vector<const std::vector<double>*>> columns;
  for (const ComparedEstimator& one : estimators) {
    std::vector<const std::vector<double>*>& of_one = columns.emplace_back();
    const auto add = [&](const std::string& name, const std::vector<double>& values) {
      header.push_back(one.name + '.' + name);
      of_one.push_back(&values);
    };
    for (const auto& [block, error] : one.over_time.errors) {
      add("rms:" + block, error.rms);
      add("p16:" + block, error.low);
      add("p84:" + block, error.high);
      if (!error.bound.empty()) add("bound:" + block, error.bound);
    }
    for (const auto& [owner, nees] : one.over_time.nees) {
      add("anees:" + owner, nees.mean);
      add("anees.low:" + owner, nees.low);
      add("anees.high:" + owner, nees.high);
    }
  }
  CsvFile csv(folder, kOverTime, header);
  std::vector<std::size_t> next(estimators.size(), 0);
  for (const Timestamp timestamp : timestamps) {
    csv.Time(timestamp);
    for (std::size_t e = 0; e < estimators.size(); ++e) {
      const std::vector<Timestamp>& own = estimators[e].over_time.timestamps;
      const bool known = next[e] < own.size() && own[next[e]] == timestamp;
      for (const std::vector<double>* const column : columns[e]) {
        const double value = known ? (*column)[next[e]] : std::nan("");
        std::isfinite(value) ? csv.Number(value) : csv.Empty();
      }
      next[e] += known ? 1 : 0;
    }
    csv.EndRow();
  }
  csv.Close();
}

std::string UnitOf(const Estimators& estimators, const std::string& block, bool is_angle) {
  if (is_angle) return "deg";
  for (const ComparedEstimator& one : estimators) {
    const auto unit = one.units.find(block);
    if (unit != one.units.end()) return unit->second;
  }
  return "";
}

/// Median of what is known.
double MedianOf(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  std::ranges::sort(values);
  return values.empty() ? std::nan("") : Quantile(values, 0.5);
}

/// Whether a curve rises too far above the lowest one for a linear axis.
bool WantsLogAxis(const std::vector<const std::vector<double>*>& curves) {
  constexpr double kFar = 8.0;
  double low = INFINITY, high = 0.0;
  for (const std::vector<double>* const curve : curves) {
    const double median = MedianOf(*curve);
    if (median > 0.0) low = std::min(low, median);
    for (const double value : *curve) high = std::isfinite(value) ? std::max(high, value) : high;
  }
  return high > kFar * low;
}

/// The rms error of a block over time: of all estimators, then of each one with its band.
std::vector<FigureScript> ErrorFigure(const Estimators& estimators, const std::string& block,
                                      const std::vector<Timestamp>& timestamps) {
  std::vector<std::size_t> with;  // estimators that have it
  std::vector<const std::vector<double>*> curves;
  bool is_angle = false;
  for (std::size_t e = 0; e < estimators.size(); ++e) {
    const auto found = estimators[e].over_time.errors.find(block);
    if (found == estimators[e].over_time.errors.end()) continue;
    with.push_back(e);
    curves.push_back(&found->second.rms);
    is_angle = found->second.is_angle;
  }
  const FigureFile file{kOverTime, std::ssize(timestamps)};
  const std::string unit = InBrackets(UnitOf(estimators, block, is_angle));
  const auto column = [&](std::size_t e, const char* what) {
    return Shown(estimators[e].name + '.' + what + block, is_angle);
  };
  const auto line = [&](FigureScript& script, std::size_t e, const std::string& key,
                        const std::string& dashes) {
    script.Curve(
        file, FigureScript::kTime + column(e, "rms:") + " with lines" + StyleOf(e) + dashes, key);
  };
  const bool far = WantsLogAxis(curves), several = with.size() > 1;
  const auto panel = [&](FigureScript& script, std::size_t index) {
    if (several && index == 0) {
      script.Panel("rms over the runs, all estimators", unit);
      script.Set(far ? "set logscale y" : "set yrange [0:]");
      for (std::size_t i = 0; i < std::min(with.size(), kMaxCurves); ++i) {
        line(script, with[i], estimators[with[i]].name, DashesOf(i));
      }
      return;
    }
    const std::size_t e = with[index - (several ? 1 : 0)];
    script.Panel(estimators[e].name, unit);
    script.Set("unset logscale y\nset yrange [0:]");
    script.Curve(file,
                 FigureScript::kTime + column(e, "p16:") + ':' + column(e, "p84:") +
                     " with filledcurves" + StyleOf(e),
                 "16 % to 84 %");
    line(script, e, "rms", "");
    if (estimators[e].over_time.errors.at(block).bound.empty()) return;
    script.Curve(file,
                 FigureScript::kTime + column(e, "bound:") + " with lines ls 12 dt (6,4) lw 2",
                 "Cramer-Rao bound");
  };
  return FigurePages(
      {"rms." + block, block + ": error over the runs", timestamps.front(), timestamps.back()},
      with.size() + (several ? 1 : 0), panel);
}

/// The average NEES of each estimator and owner within its bounds.
std::vector<FigureScript> AverageNeesFigure(const Estimators& estimators,
                                            const std::vector<Timestamp>& timestamps) {
  std::vector<std::pair<std::size_t, std::string>> panels;
  for (std::size_t e = 0; e < estimators.size(); ++e) {
    for (const auto& [owner, nees] : estimators[e].over_time.nees) panels.emplace_back(e, owner);
  }
  const FigureFile file{kOverTime, std::ssize(timestamps)};
  const auto panel = [&](FigureScript& script, std::size_t index) {
    const auto& [e, owner] = panels[index];
    const std::string& name = estimators[e].name;
    const auto column = [&, &owner = owner](const char* what) {
      return Shown(name + '.' + what + owner, false);
    };
    script.Panel(name + ", " + owner, "NEES / dof [1]");
    script.Set("set offsets 0, 0, graph 0.08, graph 0.08");
    script.PanelHeight(210);
    script.Set("set arrow 1 from graph 0, first 1 to graph 1, first 1 nohead front ls 12");
    script.Curve(file,
                 FigureScript::kTime + column("anees.low:") + ':' + column("anees.high:") +
                     " with filledcurves ls 12",
                 "95 % bounds");
    script.Curve(file, FigureScript::kTime + column("anees:") + " with lines" + StyleOf(e),
                 "mean of the runs");
  };
  if (panels.empty()) return {};
  return FigurePages({"anees", "average NEES over the runs; 1 is consistent", timestamps.front(),
                      timestamps.back()},
                     panels.size(), panel);
}

/// CPU time of a frame in us, with that of the filter that a batch starts from; none where it is
/// not known.
std::optional<double> CostOf(const ComparedEstimator& one) {
  const auto cpu = one.values.find("cpu_us"), start = one.values.find("cpu_us.start");
  if (cpu == one.values.end() || !(cpu->second.mean > 0.0)) return std::nullopt;
  return cpu->second.mean + (start == one.values.end() ? 0.0 : start->second.mean);
}

/// The mean of an error of an estimator whose cost is known; none where it has no such error.
std::optional<double> ErrorOf(const ComparedEstimator& one, const std::string& key) {
  const auto found = one.values.find(key);
  const bool known = found != one.values.end() && std::isfinite(found->second.mean);
  return known && CostOf(one) ? std::optional(found->second.mean) : std::nullopt;
}

/// Whether no estimator of `among` is both cheaper and as accurate, but for rounding.
bool IsOnFront(const ComparedEstimator& one, const Estimators& among, const std::string& key) {
  const auto error = ErrorOf(one, key);
  return error && std::ranges::none_of(among, [&](const ComparedEstimator& other) {
           const auto other_error = ErrorOf(other, key);
           return other_error && *CostOf(other) < *CostOf(one) &&
                  *other_error < *error * (1.0 + 1e-9);
         });
}

/// A figure of cost against accuracy.
struct CostFigure {
  std::string name, title, prefix;  ///< the prefix is that of its columns
  Estimators estimators;
  std::vector<std::string> kinds;  ///< of errors
};

/// Errors that at least two of its estimators have, of known cost.
std::vector<std::string> KeysOf(const CostFigure& figure) {
  std::map<std::string, int> counts;
  for (const ComparedEstimator& one : figure.estimators) {
    for (const auto& [key, value] : one.values) {
      const auto begins = [&key = key](const std::string& kind) { return key.starts_with(kind); };
      const bool whole = key.find('@') == key.npos && std::ranges::any_of(figure.kinds, begins);
      const auto error = whole ? ErrorOf(one, key) : std::nullopt;
      if (error && *error > 0.0) ++counts[key];
    }
  }
  std::vector<std::string> keys;
  for (const auto& [key, count] : counts) {
    if (count > 1) keys.push_back(key);
  }
  return keys;
}

std::vector<CostFigure> CostFiguresOf(const Estimators& estimators) {
  CostFigure end{"cost",
                 "cost against the error at the end, where all have the same data",
                 "",
                 estimators,
                 {"final_error:", "map.rmse", "map.sim3.rmse"}};
  CostFigure online{"cost.online", "cost against the error, online estimators", "", {}, {"rmse:"}};
  CostFigure smoothed{
      "cost.smoothed", "cost against the error, smoothed", "smoothed.", {}, {"rmse:"}};
  for (const ComparedEstimator& one : estimators) {
    (one.smoothed ? smoothed : online).estimators.push_back(one);
  }
  std::vector<CostFigure> figures = {end, online, smoothed};
  std::erase_if(figures, [](const CostFigure& figure) { return KeysOf(figure).empty(); });
  return figures;
}

void WriteCost(const OutputFolder& folder, const Estimators& estimators,
               const std::vector<CostFigure>& figures) {
  std::vector<std::string> header = {"estimator", "cpu_us", "cpu_us.start", "cpu_us.all"};
  for (const CostFigure& figure : figures) {
    for (const std::string& key : KeysOf(figure)) {
      const std::string name = figure.prefix + key;
      header.insert(header.end(), {name, "low." + name, "high." + name, "front." + name});
    }
  }
  CsvFile csv(folder, kCost, header);
  for (const ComparedEstimator& one : estimators) {
    const auto number = [&](const std::optional<double>& value) {
      value ? csv.Number(*value) : csv.Empty();
    };
    const auto value = [&](const char* key) {
      const auto found = one.values.find(key);
      return found == one.values.end() ? std::nullopt : std::optional(found->second.mean);
    };
    csv.Text(one.name);
    number(value("cpu_us"));
    number(value("cpu_us.start"));
    number(CostOf(one));
    for (const CostFigure& figure : figures) {
      const bool is_shown =
          std::ranges::count(figure.estimators, one.name, &ComparedEstimator::name) > 0;
      for (const std::string& key : KeysOf(figure)) {
        const auto error = is_shown ? ErrorOf(one, key) : std::nullopt;
        const auto interval = one.mean_intervals.find(key);
        const bool known = error && interval != one.mean_intervals.end();
        number(error);
        number(known ? std::optional(interval->second.low) : error);
        number(known ? std::optional(interval->second.high) : error);
        csv.Integer(is_shown && IsOnFront(one, figure.estimators, key) ? 1 : 0);
      }
    }
    csv.EndRow();
  }
  csv.Close();
}

std::string LabelOf(const Estimators& estimators, const std::string& key) {
  if (key.find(':') == key.npos) return InBrackets("m");
  const std::string block = key.substr(key.find(':') + 1);
  const bool is_angle = std::ranges::any_of(estimators, [&](const ComparedEstimator& one) {
    const auto found = one.over_time.errors.find(block);
    return found != one.over_time.errors.end() && found->second.is_angle;
  });
  return InBrackets(is_angle ? "rad" : UnitOf(estimators, block, false));
}

FigureScript ScriptOf(const CostFigure& figure, const Estimators& estimators) {
  FigureScript script(figure.name, figure.title, "CPU time [us/frame]");
  script.Set("set logscale x");
  script.PanelHeight(230);
  const FigureFile file{kCost, std::ssize(estimators)};
  for (const std::string& key : KeysOf(figure)) {
    const std::string name = figure.prefix + key;
    std::string title = key;
    std::ranges::replace(title, ':', ' ');
    script.Panel(title + ", mean over the runs and its 95 % interval", LabelOf(estimators, key));
    script.Set("set offsets graph 0.05, graph 0.05, graph 0.05, graph 0.05");
    for (std::size_t e = 0; e < estimators.size(); ++e) {
      const ComparedEstimator& one = estimators[e];
      const bool is_shown =
          std::ranges::count(figure.estimators, one.name, &ComparedEstimator::name) > 0;
      if (!is_shown || !ErrorOf(one, key)) continue;
      const auto of_row = [&](const std::string& column) {
        return "($0 == " + std::to_string(e) + " ? " + GnuplotColumn(column) + " : NaN)";
      };
      const std::string x = of_row("cpu_us.all"), y = of_row(name);
      script.Curve(file,
                   x + ':' + y + ':' + of_row("low." + name) + ':' + of_row("high." + name) +
                       " with yerrorbars" + StyleOf(e) + " pt 7 ps 0.9",
                   one.name);
      if (!one.values.contains("cpu_us.start")) continue;
      script.Curve(file,
                   of_row("cpu_us") + ':' + y + ':' + '(' + of_row("cpu_us.all") + " - " +
                       of_row("cpu_us") + "):($0 == " + std::to_string(e) +
                       " ? 0 : NaN) with vectors nohead" + StyleOf(e),
                   "");
      script.Curve(file, of_row("cpu_us") + ':' + y + " with points" + StyleOf(e) + " pt 6 ps 0.9",
                   one.name + ", the solve alone");
    }
    const std::string on_front = "(" + GnuplotColumn("front." + name) + " == 1 ? ";
    script.Curve(file,
                 on_front + GnuplotColumn("cpu_us.all") + " : NaN):(" + GnuplotColumn(name) +
                     ") with points pt 6 ps 2.2 lw 1 lc rgb '#888888'",
                 "none is cheaper and better");
  }
  return script;
}

}  // namespace

Figures WriteSeedFigures(const OutputFolder& folder, const Comparison& comparison,
                         const std::function<bool()>& stop) {
  const Estimators& estimators = comparison.estimators;
  std::vector<FigureScript> scripts;
  const auto add = [&](std::vector<FigureScript> some) {
    std::ranges::move(some, std::back_inserter(scripts));
  };
  const std::vector<Timestamp> timestamps = TimestampsOf(estimators);
  if (!timestamps.empty()) {
    WriteOverTime(folder, estimators, timestamps);
    add(AverageNeesFigure(estimators, timestamps));
    std::set<std::string> blocks;
    for (const ComparedEstimator& one : estimators) {
      for (const auto& [block, error] : one.over_time.errors) blocks.insert(block);
    }
    for (const std::string& block : blocks) add(ErrorFigure(estimators, block, timestamps));
  }
  const std::vector<CostFigure> costs = CostFiguresOf(estimators);
  WriteCost(folder, estimators, costs);
  for (const CostFigure& figure : costs) scripts.push_back(ScriptOf(figure, estimators));
  const DrawingLimits limits{stop, std::chrono::steady_clock::now() + std::chrono::minutes(2)};
  return DrawScripts(folder, scripts, limits);
}

}  // namespace alidade::internal
