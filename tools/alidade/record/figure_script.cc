// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/figure_script.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "alidade/base/number_text.h"
#include "alidade/record/embedded.h"

namespace alidade::internal {
namespace {

constexpr std::int64_t kMaxRows = 5000;     // of which all are drawn
constexpr std::int64_t kEnoughRows = 2500;  // of a longer file

}  // namespace

std::int64_t StrideOf(const FigureFile& file) {
  std::int64_t stride = file.rows > kMaxRows ? file.rows / kEnoughRows : 1;
  // It shares no divisor with the number of kinds that take turns.
  while (stride > 1 && std::gcd(stride, std::int64_t{file.kinds}) > 1) ++stride;
  return stride;
}

std::string GnuplotQuoted(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') quoted += '\'';
    quoted += c == '\n' ? ' ' : c;
  }
  return quoted += '\'';
}

std::string GnuplotColumn(std::string_view name) { return "column(" + GnuplotQuoted(name) + ')'; }

std::string InBrackets(std::string_view unit) {
  return unit.empty() ? "" : std::string("[").append(unit).append("]");
}

FigureScript::FigureScript(std::string name, std::string title, Timestamp first, Timestamp last)
    : name_(std::move(name)),
      title_(std::move(title)),
      first_(first),
      last_(last),
      span_s_(Seconds(last) - Seconds(first)) {}

FigureScript::FigureScript(std::string name, std::string title, std::string x_label)
    : FigureScript(std::move(name), std::move(title), Timestamp{0}, Timestamp{0}) {
  x_label_ = std::move(x_label);
}

void FigureScript::EndPanel() {
  if (!plot_.empty()) body_ += "plot " + plot_ + "\n";
  plot_.clear();
}

void FigureScript::Panel(std::string_view title, std::string_view y_label) {
  EndPanel();
  ++panels_;
  keys_ = 0;
  body_ += "\nset label 1 " + GnuplotQuoted(title) +
           " at graph 0, graph 1 offset 0, 0.7 left noenhanced\n";
  body_ += "set ylabel " + GnuplotQuoted(y_label) + " noenhanced\n";
  body_ += "set autoscale y\n";
}

void FigureScript::Set(std::string_view line) { body_.append(line).append("\n"); }

void FigureScript::Curve(const FigureFile& file, std::string_view how, std::string_view key) {
  if (!key.empty()) return CurveWithKey(file, how, GnuplotQuoted(key), key.size());
  AddCurve(file, how);
  plot_ += " notitle";
}

void FigureScript::CurveWithKey(const FigureFile& file, std::string_view how, std::string_view key,
                                std::size_t width) {
  AddCurve(file, how);
  longest_key_ = std::max(longest_key_, width);
  most_keys_ = std::max(most_keys_, ++keys_);
  plot_.append(" title ").append(key).append(" noenhanced");
}

void FigureScript::AddCurve(const FigureFile& file, std::string_view how) {
  if (!plot_.empty()) plot_ += ", \\\n     ";
  plot_ += GnuplotQuoted(file.name);
  const std::int64_t stride = StrideOf(file);
  if (stride > 1) plot_ += " every " + std::to_string(stride);
  plot_.append(" using ").append(how);
}

void FigureScript::LineOf(const FigureFile& file, std::string_view mine, std::string_view value,
                          int style, std::string_view key) {
  // Rows of one kind are this far apart on average; a line may bridge a few.
  const double step_s = span_s_ * file.kinds * static_cast<double>(StrideOf(file)) /
                        static_cast<double>(std::max<std::int64_t>(file.rows, 1));
  if (!plot_.empty()) plot_ += ", \\\n     ";
  plot_ += "gap = " + NumberText(std::max(4.0 * step_s, 0.02 * span_s_)) + ", px = py = NaN";
  std::string how = "(along(";
  how.append(mine).append(", column('t_s')-t0)):(level(").append(value).append(")) with lines ls ");
  Curve(file, how + std::to_string(style), key);
}

void FigureScript::Quartiles(std::string_view name, std::string_view file,
                             std::string_view expression) {
  body_ += "stats " + GnuplotQuoted(file) + " using (";
  body_.append(expression).append(") name ").append(GnuplotQuoted(name)).append(" nooutput\n");
}

/// Its settings; and its label.
std::string FigureScript::TimeAxis(std::string& label) const {
  // Timestamps that count from 1970 would leave no room for what differs.
  const Timestamp second = 1'000'000'000;
  const bool far = std::abs(first_ / second) > 100'000 && span_s_ < std::abs(Seconds(first_));
  const Timestamp origin = far ? first_ / second : 0;
  std::string first, last;
  AppendSeconds(first, first_ - origin * second);
  AppendSeconds(last, last_ - origin * second);
  label = "t" + (origin == 0 ? "" : " - " + std::to_string(origin)) + " [s]";
  std::string text = "t0 = " + std::to_string(origin) + ".0\n";
  if (span_s_ > 0.0) text += "set xrange [" + first + ':' + last + "]\n";
  return text;
}

std::string FigureScript::Text() const {
  // A panel is as high as its key, which would go on beyond the right edge.
  const int height = std::max(panel_height_, 76 + 18 * most_keys_);
  const int rows = (panels_ + columns_ - 1) / columns_;
  const std::string size = "960," + std::to_string(64 + height * rows);
  std::string text =
      "# Draws figures/" + name_ + ".svg. In the run folder: gnuplot figures/" + name_ + ".gp\n";
  text += kFigureStyle;
  text += "set rmargin " + std::to_string(longest_key_ + 9) + "  # room for the key\n";
  text += "if (!exists('png')) png = 0\n";
  text += "if (png) set terminal pngcairo size " + size +
          " font 'sans,10' noenhanced background '#ffffff'\n";
  text += "if (!png) set terminal svg size " + size +
          " font 'sans-serif,12' noenhanced background '#ffffff'\n";
  text += "set output png ? 'figures/" + name_ + ".png' : 'figures/" + name_ + ".svg'\n";
  text += "set multiplot layout " + std::to_string(rows) + ',' + std::to_string(columns_) +
          " title " + GnuplotQuoted(title_) + " noenhanced\n";
  std::string label = x_label_;
  if (label.empty()) text += TimeAxis(label);
  text += body_;
  text += "set xlabel " + GnuplotQuoted(label) + " offset 0,0.5 noenhanced\nset bmargin 2.9\n";
  if (!plot_.empty()) text += "plot " + plot_ + "\n";
  return text + "\nunset multiplot\nset output\n";
}

std::vector<FigureScript> FigurePages(
    const FigureTitle& figure, std::size_t panels,
    const std::function<void(FigureScript& script, std::size_t panel)>& add) {
  const std::size_t pages = (panels + kMaxPanels - 1) / kMaxPanels;
  std::vector<FigureScript> scripts;
  std::size_t next = 0;
  for (std::size_t page = 1; page <= pages; ++page) {
    const std::string count = " (" + std::to_string(page) + " of " + std::to_string(pages) + ')';
    FigureScript& script =
        scripts.emplace_back(figure.name + (page > 1 ? '.' + std::to_string(page) : ""),
                             figure.title + (pages > 1 ? count : ""), figure.first, figure.last);
    while (next < panels * page / pages) add(script, next++);
  }
  return scripts;
}

}  // namespace alidade::internal
