// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "alidade/record/run_view.h"
#include "canvas.h"

namespace alidade::draw {

/// Panel next to the image of a frame, with text and a plot.
class Panel {
 public:
  static constexpr int kWidth = 400;  ///< width of the panel, px

  explicit Panel(cv::Mat& image) : canvas_(image), height_(image.rows) {}

  void Draw(const RunView& view) {
    Head(view);
    Legend(view.counts);
    if (!view.innovations.empty()) Innovations(view.innovations);
    if (!view.elements.empty()) Elements(view.elements);
    const cv::Rect2d box(kLeft, y_ + 8.0, kRight - kLeft, height_ - 34.0 - y_);
    if (view.map) Map(*view.map, box);
    if (view.series) Series(*view.series, box);
  }

 private:
  static constexpr double kLeft = 16.0, kRight = kWidth - 16.0;
  static constexpr double kRow = 19.0;

  void Rule() {
    canvas_.Line({kLeft, y_}, {kRight, y_}, kRule);
    y_ += kRow + 2.0;
  }
  void Head(const RunView& view) {
    y_ = 32.0;
    canvas_.Text({kLeft, y_}, view.title, kInk, TitleSize(view.title));
    y_ += 26.0;
    char time[48];
    std::snprintf(time, sizeof time, "t %.3f s", Seconds(view.timestamp));
    canvas_.Text({kLeft, y_}, view.estimator, kFaint);
    canvas_.Text({200.0, y_}, "frame " + std::to_string(view.number), kFaint, 0.45,
                 Canvas::Align::kMiddle);
    canvas_.Text({kRight, y_}, time, kFaint, 0.45, Canvas::Align::kRight);
    y_ += 14.0;
    Rule();
    if (view.landmarks < 0) return;
    canvas_.Text({kLeft, y_}, "landmarks in the state", kFaint);
    canvas_.Text({kRight, y_}, std::to_string(view.landmarks), kInk, 0.45, Canvas::Align::kRight);
    y_ += kRow;
  }
  /// Returns the font size at which the title fits the width.
  static double TitleSize(const std::string& title) {
    constexpr double kDefault = 0.6, kLetter = 18.5;  // kLetter: width of a letter at size 1, px
    const double width = kLetter * static_cast<double>(std::max<std::size_t>(1, title.size()));
    return std::clamp((kRight - kLeft) / width, 0.35, kDefault);
  }
  void Legend(const std::array<int, kMarks>& counts) {
    for (int i = 0; i < kMarks; ++i) {
      const auto mark = static_cast<Mark>(i);
      const double x = kLeft + 128.0 * (i % 3);
      const cv::Point2d dot(x + 5.0, y_ - 4.5);
      if (mark == Mark::kLost) {
        canvas_.Cross(dot, 3.5, ColourOf(mark));
      } else {
        canvas_.Disc(dot, 4.5, ColourOf(mark));
      }
      canvas_.Text({x + 16.0, y_}, NameOf(mark), kFaint);
      canvas_.Text({x + 112.0, y_}, std::to_string(counts[static_cast<std::size_t>(i)]), kInk, 0.45,
                   Canvas::Align::kRight);
      if (i % 3 == 2) y_ += kRow;
    }
    y_ += 10.0;
    Rule();
  }
  /// Draws the value and the innovation of each measurement. The innovation is drawn on a scale
  /// from -4 to 4 sigma.
  void Innovations(const std::vector<ViewInnovation>& innovations) {
    constexpr double kMiddle = 0.5 * (250.0 + kRight), kPerSigma = (kRight - 250.0) / 8.0;
    canvas_.Text({kLeft, y_}, "measured", kFaint);
    for (const int sigma : {-3, 0, 3}) {
      canvas_.Text({kMiddle + sigma * kPerSigma, y_}, std::to_string(sigma), kFaint, 0.4,
                   Canvas::Align::kMiddle);
    }
    canvas_.Text({246.0, y_}, "sigma", kFaint, 0.4, Canvas::Align::kRight);
    y_ += kRow + 1.0;
    for (const ViewInnovation& innovation : innovations) {
      const double middle = y_ - 4.5;
      canvas_.Text({kLeft, y_}, innovation.name, kInk);
      canvas_.Text({200.0, y_}, Digits(innovation.measured, 5), kInk, 0.45, Canvas::Align::kRight);
      canvas_.Line({kMiddle - 4.0 * kPerSigma, middle}, {kMiddle + 4.0 * kPerSigma, middle}, kRule);
      for (const int sigma : {-3, 0, 3}) {
        const double x = kMiddle + sigma * kPerSigma;
        canvas_.Line({x, middle - 5.0}, {x, middle + 5.0}, kRule);
      }
      if (std::isfinite(innovation.sigmas)) {
        const double x = kMiddle + kPerSigma * std::clamp(innovation.sigmas, -4.0, 4.0);
        canvas_.Line({kMiddle, middle}, {x, middle}, ColourOf(innovation.mark), 2);
        canvas_.Disc({x, middle}, 4.5, ColourOf(innovation.mark));
      } else {
        canvas_.Disc({kMiddle, middle}, 4.5, ColourOf(innovation.mark));
      }
      y_ += kRow;
    }
    y_ -= 4.0;
    Rule();
  }
  void Elements(const std::vector<ViewElement>& elements) {
    const bool has_truth = std::ranges::any_of(
        elements, [](const ViewElement& element) { return std::isfinite(element.truth); });
    const double max_letters = has_truth ? 19.0 : 26.0;  // number of letters that fit the column
    const double value = has_truth ? 234.0 : 290.0, sigma = has_truth ? 308.0 : kRight;
    canvas_.Text({kLeft, y_}, "estimate", kFaint);
    canvas_.Text({sigma, y_}, "sigma", kFaint, 0.45, Canvas::Align::kRight);
    if (has_truth) canvas_.Text({kRight, y_}, "error", kFaint, 0.45, Canvas::Align::kRight);
    y_ += kRow + 1.0;
    for (const ViewElement& element : elements) {
      std::string name = element.name.substr(element.name.find('.') + 1);
      if (!element.unit.empty()) name += " [" + element.unit + ']';
      canvas_.Text({kLeft, y_}, name, kInk,
                   std::min(0.45, 0.45 * max_letters / static_cast<double>(name.size())));
      canvas_.Text({value, y_}, Digits(element.value, 5), kInk, 0.45, Canvas::Align::kRight);
      canvas_.Text({sigma, y_}, TwoDigits(element.sigma), kFaint, 0.43, Canvas::Align::kRight);
      const double error = element.value - element.truth;
      if (std::isfinite(error)) {
        const bool is_large = std::abs(error) > 3.0 * element.sigma;
        canvas_.Text({kRight, y_}, TwoDigits(error), is_large ? ColourOf(Mark::kRejected) : kTruth,
                     0.45, Canvas::Align::kRight);
      }
      y_ += kRow;
    }
    y_ -= 4.0;
    canvas_.Line({kLeft, y_}, {kRight, y_}, kRule);
  }

  /// Draws the trajectory, landmarks and 3-sigma ellipses from above, at the same scale on both
  /// axes.
  void Map(const ViewMap& map, const cv::Rect2d& box) {
    const double left = map.bounds[0], right = map.bounds[1];
    const double bottom = map.bounds[2], top = map.bounds[3];
    constexpr double kMargin = 14.0;
    const double width = std::max(right - left, 1e-9), height = std::max(top - bottom, 1e-9);
    const double scale =
        std::min((box.width - 2.0 * kMargin) / width, (box.height - 2.0 * kMargin) / height);
    const cv::Point2d middle(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
    const auto to_box = [&](double x, double y) {
      return cv::Point2d(middle.x + scale * (x - 0.5 * (left + right)),
                         middle.y - scale * (y - 0.5 * (bottom + top)));
    };
    Inset inset(canvas_, box);
    for (const PlaneGaussian& landmark : map.landmarks) {
      // Long ellipses are drawn in a paler colour, so that uncertain landmarks do not hide other
      // landmarks.
      constexpr double kShort = 25.0;  // px
      const double length = 3.0 * scale * std::sqrt(std::max(landmark.xx, landmark.yy));
      const double strength = std::clamp(kShort / length, 0.12, 1.0);
      inset.canvas.ThreeSigma(inset(to_box(landmark.x, landmark.y)), landmark, {scale, -scale},
                              kPaper * (1.0 - strength) + cv::Scalar(150, 160, 80) * strength);
    }
    for (const PlaneGaussian& landmark : map.landmarks) {
      inset.canvas.Disc(inset(to_box(landmark.x, landmark.y)), 1.8, {210, 220, 130});
    }
    const auto trajectory = [&](const std::vector<std::array<double, 2>>& path,
                                const cv::Scalar& colour) {
      std::vector<cv::Point2d> points;
      for (const auto& [x, y] : path) points.push_back(inset(to_box(x, y)));
      inset.canvas.Path(points, colour, 2);
    };
    trajectory(map.true_path, kTruth);
    trajectory(map.path, kInk);
    const cv::Point2d camera = inset(to_box(map.position.x, map.position.y));
    inset.canvas.ThreeSigma(camera, map.position, {scale, -scale}, ColourOf(Mark::kAccepted), 2);
    const double length = std::hypot(map.heading[0], map.heading[1]);
    if (length > 1e-6) {
      const cv::Point2d forward(map.heading[0] / length, -map.heading[1] / length);
      const cv::Point2d sideways(-forward.y, forward.x);
      inset.canvas.Area({camera + 16.0 * forward + 8.0 * sideways, camera,
                         camera + 16.0 * forward - 8.0 * sideways},
                        ColourOf(Mark::kAccepted));
    }
    inset.canvas.Disc(camera, 3.5, kInk);
    Frame(box, map.right + ", " + map.up + " [m]");
    ScaleBar(box, scale);
  }
  /// Draws a scale bar. Its length is 1, 2 or 5 times a power of ten, and is between a fifth and a
  /// half of the width of the box.
  void ScaleBar(const cv::Rect2d& box, double px_per_m) {
    double length_m = std::pow(10.0, std::floor(std::log10(0.5 * box.width / px_per_m)));
    for (const double factor : {5.0, 2.0}) {
      if (factor * length_m * px_per_m < 0.5 * box.width) {
        length_m *= factor;
        break;
      }
    }
    const double y = box.y + box.height - 10.0, x = box.x + 10.0;
    canvas_.Line({x, y}, {x + length_m * px_per_m, y}, kInk, 2);
    char text[32];
    std::snprintf(text, sizeof text, "%g m", length_m);
    canvas_.Text({x, y - 7.0}, text, kFaint, 0.4);
  }

  /// Draws one element over time, with its 3-sigma band and its true value.
  void Series(const ViewSeries& series, const cv::Rect2d& box) {
    double low = INFINITY, high = -INFINITY;
    for (std::size_t i = 0; i < series.value.size(); ++i) {
      for (const double y : {series.value[i], series.truth[i]}) {
        if (!std::isfinite(y)) continue;
        low = std::min(low, y);
        high = std::max(high, y);
      }
    }
    if (!(low <= high)) return;
    const double margin = std::max(0.15 * (high - low), 1e-3 * std::abs(high) + 1e-9);
    low -= margin;
    high += margin;
    const double start = series.t_s.front(), end = std::max(series.t_s.back(), start + 1e-3);
    Inset inset(canvas_, box);
    const auto to_box = [&](std::size_t i, double y) {
      const double x = (series.t_s[i] - start) / (end - start);
      return inset({box.x + x * box.width, box.y + box.height * (high - y) / (high - low)});
    };
    std::vector<cv::Point2d> line, upper, lower, truth;
    for (std::size_t i = 0; i < series.value.size(); ++i) {
      // The half width of the band is limited, because it may be very large at first.
      const double reach = std::min(3.0 * series.sigma[i], 10.0 * (high - low));
      line.push_back(to_box(i, series.value[i]));
      upper.push_back(to_box(i, series.value[i] + reach));
      lower.push_back(to_box(i, series.value[i] - reach));
      if (std::isfinite(series.truth[i])) truth.push_back(to_box(i, series.truth[i]));
    }
    std::vector<cv::Point2d> band = upper;
    band.insert(band.end(), lower.rbegin(), lower.rend());
    inset.canvas.Area(band, {70, 80, 45});
    inset.canvas.Path(truth, kTruth, 1);
    inset.canvas.Path(line, kInk, 2);
    std::string name = series.name.substr(series.name.find('.') + 1);
    if (!series.unit.empty()) name += " [" + series.unit + ']';
    Frame(box, name + ", 3 sigma" + (truth.empty() ? "" : ", truth"));
    char span[48];
    std::snprintf(span, sizeof span, "%.2f to %.2f s", start, end);
    canvas_.Text({box.x + 8.0, box.y + box.height - 8.0}, span, kFaint, 0.4);
    canvas_.Text({box.x + box.width - 6.0, box.y + 18.0}, Digits(high, 4), kFaint, 0.4,
                 Canvas::Align::kRight);
    canvas_.Text({box.x + box.width - 6.0, box.y + box.height - 8.0}, Digits(low, 4), kFaint, 0.4,
                 Canvas::Align::kRight);
  }
  void Frame(const cv::Rect2d& box, const std::string& title) {
    canvas_.Path({{box.x, box.y},
                  {box.x + box.width, box.y},
                  {box.x + box.width, box.y + box.height},
                  {box.x, box.y + box.height}},
                 kRule, 1, true);
    canvas_.Text({box.x + 8.0, box.y + 18.0}, title, kFaint, 0.42);
  }

  /// Part of the panel that clips its contents.
  struct Inset {
    Inset(Canvas& panel, const cv::Rect2d& box)
        : image(panel.Part(box)), canvas(image), corner(box.tl()) {}
    cv::Point2d operator()(const cv::Point2d& point) const { return point - corner; }
    cv::Mat image;
    Canvas canvas;
    cv::Point2d corner;
  };

  Canvas canvas_;
  double height_, y_ = 0.0;
};

}  // namespace alidade::draw
