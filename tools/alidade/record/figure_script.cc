// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/figure_script.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

constexpr std::int64_t kMaxRows = 5000;     // of which all are drawn
constexpr std::int64_t kEnoughRows = 2500;  // of a longer file

/// Every n-th row is enough; n shares no divisor with the number of kinds that take turns.
std::int64_t Stride(const FigureFile& file) {
  std::int64_t stride = file.rows > kMaxRows ? file.rows / kEnoughRows : 1;
  while (stride > 1 && std::gcd(stride, std::int64_t{file.kinds}) > 1) ++stride;
  return stride;
}

constexpr const char* kSettings = R"(
set datafile separator comma
set datafile columnheaders
set encoding utf8
set samples 2
set border 3 lc rgb '#555555'
set tics nomirror textcolor rgb '#333333'
set grid lc rgb '#e4e4e4' lt 1
set key at graph 1.01, graph 1.08 left top Left reverse samplen 2 font ',11' noenhanced
set lmargin 11
set tmargin 2
set bmargin 1.5
set style fill solid 0.22 noborder
set style line 1 lw 1.5 lc rgb '#0072b2'
set style line 2 lw 1.5 lc rgb '#d55e00'
set style line 3 lw 1.5 lc rgb '#009e73'
set style line 4 lw 1.5 lc rgb '#cc79a7'
set style line 5 lw 1.5 lc rgb '#e69f00'
set style line 6 lw 1.5 lc rgb '#56b4e9'
set style line 7 lw 1.5 lc rgb '#8c6d31'
set style line 8 lw 1.5 lc rgb '#7570b3'
set style line 11 lw 1.2 lc rgb '#111111' dt 2
set style line 12 lw 1.0 lc rgb '#888888'
set style line 13 pt 7 ps 0.35 lc rgb '#d9822b'
set style line 14 pt 7 ps 0.35 lc rgb '#4a8db7'
set style line 15 pt 7 ps 0.35 lc rgb '#5aa469'
set style line 16 pt 2 ps 0.5 lc rgb '#c03030'
set style line 17 pt 8 ps 0.6 lc rgb '#c03030'
set style line 18 pt 6 ps 0.8 lc rgb '#111111'
max(a, b) = a > b ? a : b
min(a, b) = a < b ? a : b
# What a range is widened by at each end; never zero.
margin(low, high) = high > low ? max(0.08 * (high - low), 1e-6 * max(abs(low), abs(high))) : \
                    low == 0 ? 1 : 0.1 * abs(low)
# A line through those rows of a file that are `mine`, broken where none comes for a time: along()
# is its x, level() its y.
along(mine, t) = (row = mine, jump = mine && t - px > gap, px = mine ? t : px)
level(value) = (py = jump ? NaN : row ? value : py)
before = 0  # of an angle, the value at the row before
)";

}  // namespace

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

FigureScript::FigureScript(std::string name, std::string title, Stamp first, Stamp last)
    : name_(std::move(name)),
      title_(std::move(title)),
      first_(first),
      last_(last),
      span_s_(Seconds(last) - Seconds(first)) {}

FigureScript::FigureScript(std::string name, std::string title, std::string x_label)
    : FigureScript(std::move(name), std::move(title), Stamp{0}, Stamp{0}) {
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
  body_ += "\nset label 1 " + GnuplotQuoted(title) + " at graph 0, 1.09 left noenhanced\n";
  body_ += "set ylabel " + GnuplotQuoted(y_label) + " noenhanced\n";
  body_ += "set autoscale y\n";
}

void FigureScript::Set(std::string_view line) { body_.append(line).append("\n"); }

void FigureScript::Curve(const FigureFile& file, std::string_view how, std::string_view key) {
  if (!plot_.empty()) plot_ += ", \\\n     ";
  plot_ += GnuplotQuoted(file.name);
  const std::int64_t stride = Stride(file);
  if (stride > 1) plot_ += " every " + std::to_string(stride);
  plot_.append(" using ").append(how);
  longest_key_ = std::max(longest_key_, key.size());
  if (!key.empty()) most_keys_ = std::max(most_keys_, ++keys_);
  plot_ += key.empty() ? " notitle" : " title " + GnuplotQuoted(key) + " noenhanced";
}

void FigureScript::LineOf(const FigureFile& file, std::string_view mine, std::string_view value,
                          int style, std::string_view key) {
  // Rows of one kind are this far apart on average; a line may bridge a few.
  const double step_s = span_s_ * file.kinds * static_cast<double>(Stride(file)) /
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
  // Stamps that count from 1970 would leave no room for what differs.
  const Stamp second = 1'000'000'000;
  const bool far = std::abs(first_ / second) > 100'000 && span_s_ < std::abs(Seconds(first_));
  const Stamp origin = far ? first_ / second : 0;
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
  const std::string size = "960," + std::to_string(64 + height * panels_);
  std::string text =
      "# Draws figures/" + name_ + ".svg. In the run folder: gnuplot figures/" + name_ + ".gp\n";
  text += kSettings;
  text += "set rmargin " + std::to_string(longest_key_ + 9) + "  # room for the key\n";
  text += "if (!exists('png')) png = 0\n";
  text += "if (png) set terminal pngcairo size " + size +
          " font 'sans,10' noenhanced background '#ffffff'\n";
  text += "if (!png) set terminal svg size " + size +
          " font 'sans-serif,12' noenhanced background '#ffffff'\n";
  text += "set output png ? 'figures/" + name_ + ".png' : 'figures/" + name_ + ".svg'\n";
  text += "set multiplot layout " + std::to_string(panels_) + ",1 title " + GnuplotQuoted(title_) +
          " noenhanced\n";
  std::string label = x_label_;
  if (label.empty()) text += TimeAxis(label);
  text += body_;
  text += "set xlabel " + GnuplotQuoted(label) + " offset 0,0.5 noenhanced\nset bmargin 2.9\n";
  if (!plot_.empty()) text += "plot " + plot_ + "\n";
  return text + "\nunset multiplot\nset output\n";
}

}  // namespace alidade::internal
