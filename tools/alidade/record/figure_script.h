// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/timestamp.h"

namespace alidade::internal {

/// In one figure.
inline constexpr std::size_t kMaxPanels = 12;
/// In one panel, each of a colour of its own.
inline constexpr std::size_t kMaxCurves = 8;

/// A csv file to draw from. Rows of `kinds` kinds take turns in it, as those of several sensors.
struct FigureFile {
  std::string name;
  std::int64_t rows = 0;
  int kinds = 1;
};

/// A gnuplot script that draws panels, one above the other over the same axis, from the csv files
/// of a run or sweep folder into `figures/NAME.svg` (or .png). It is kept in the folder, so it is
/// written to be read and changed.
class FigureScript {
 public:
  /// The x of every curve.
  static constexpr const char* kTime = "(column('t_s')-t0):";

  /// All panels show the time from `first` to `last`.
  FigureScript(std::string name, std::string title, Timestamp first, Timestamp last);
  /// All panels are over something else than time.
  FigureScript(std::string name, std::string title, std::string x_label);

  /// Starts the next panel.
  void Panel(std::string_view title, std::string_view y_label);
  /// All panels are this high, px; by default as high as their key asks for.
  void PanelHeight(int height) { panel_height_ = height; }
  /// So many panels stand side by side; by default one.
  void Columns(int columns) { columns_ = columns; }
  /// A line of the panel's settings.
  void Set(std::string_view line);
  /// Adds a curve: what stands behind `using`, and its entry in the key ("": none). Of a long file
  /// it draws every n-th row.
  void Curve(const FigureFile& file, std::string_view how, std::string_view key);
  /// Likewise, its entry in the key a gnuplot expression that makes about `width` characters.
  void CurveWithKey(const FigureFile& file, std::string_view how, std::string_view key,
                    std::size_t width);
  /// Adds a line through the rows for which the expression `mine` is true, broken at gaps.
  void LineOf(const FigureFile& file, std::string_view mine, std::string_view value, int style,
              std::string_view key);
  /// Names the quartiles of an expression over a file NAME_lo_quartile, NAME_up_quartile.
  void Quartiles(std::string_view name, std::string_view file, std::string_view expression);

  bool empty() const { return panels_ == 0; }
  const std::string& name() const { return name_; }
  const std::string& title() const { return title_; }
  /// The whole script.
  std::string Text() const;

 private:
  void EndPanel();
  void AddCurve(const FigureFile& file, std::string_view how);
  std::string TimeAxis(std::string& label) const;

  std::string name_, title_, body_, plot_;
  std::string x_label_;  ///< "": time
  Timestamp first_, last_;
  double span_s_;
  int panels_ = 0, panel_height_ = 170, columns_ = 1;
  int keys_ = 0, most_keys_ = 0;  ///< entries in the key of the panel at hand, and of the fullest
  std::size_t longest_key_ = 0;
};

/// Name, title and time of a figure that may need several files.
struct FigureTitle {
  std::string name, title;
  Timestamp first, last;
};

/// Figures NAME, NAME.2, NAME.3, ... of `panels` panels together, at most 12 in each, about as many
/// in one as in the other. `add(script, i)` adds panel i.
std::vector<FigureScript> FigurePages(
    const FigureTitle& figure, std::size_t panels,
    const std::function<void(FigureScript& script, std::size_t panel)>& add);

/// Of so many rows of a file, one is drawn.
std::int64_t StrideOf(const FigureFile& file);
/// `text` as a gnuplot string.
std::string GnuplotQuoted(std::string_view text);
/// The column of that name.
std::string GnuplotColumn(std::string_view name);
/// `[unit]`, or "".
std::string InBrackets(std::string_view unit);

}  // namespace alidade::internal
