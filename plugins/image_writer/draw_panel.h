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

/// The text and the plot next to the image of a frame.
class Panel {
 public:
  static constexpr int kWidth = 400;  ///< px

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
  /// So that it fits the width.
  static double TitleSize(const std::string& title) {
    constexpr double kUsual = 0.6, kLetter = 18.5;  // px of a letter, for a size of 1
    const double width = kLetter * static_cast<double>(std::max<std::size_t>(1, title.size()));
    return std::clamp((kRight - kLeft) / width, 0.35, kUsual);
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
  /// For each measurement its value and where its innovation lies between -4 and 4 sigma.
  void Innovations(const std::vector<ViewInnovation>& innovations) {
    constexpr double kMiddle = 0.5 * (250.0 + kRight), kPerSigma = (kRight - 250.0) / 8.0;
    canvas_.Text({kLeft, y_}, "measured", kFaint);
    for (const int sigma : {-3, 0, 3}) {
      canvas_.Text({kMiddle + sigma * kPerSigma, y_}, std::to_string(sigma), kFaint, 0.4,
                   Canvas::Align::kMiddle);
    }
    canvas_.Text({246.0, y_}, "sigma", kFaint, 0.4, Canvas::Align::kRight);
    y_ += kRow + 1.0;
    for (const ViewInnovation& one : innovations) {
      const double middle = y_ - 4.5;
      canvas_.Text({kLeft, y_}, one.name, kInk);
      canvas_.Text({200.0, y_}, Digits(one.measured, 5), kInk, 0.45, Canvas::Align::kRight);
      canvas_.Line({kMiddle - 4.0 * kPerSigma, middle}, {kMiddle + 4.0 * kPerSigma, middle}, kRule);
      for (const int sigma : {-3, 0, 3}) {
        const double x = kMiddle + sigma * kPerSigma;
        canvas_.Line({x, middle - 5.0}, {x, middle + 5.0}, kRule);
      }
      if (std::isfinite(one.sigmas)) {
        const double x = kMiddle + kPerSigma * std::clamp(one.sigmas, -4.0, 4.0);
        canvas_.Line({kMiddle, middle}, {x, middle}, ColourOf(one.mark), 2);
        canvas_.Disc({x, middle}, 4.5, ColourOf(one.mark));
      } else {
        canvas_.Disc({kMiddle, middle}, 4.5, ColourOf(one.mark));
      }
      y_ += kRow;
    }
    y_ -= 4.0;
    Rule();
  }
  void Elements(const std::vector<ViewElement>& elements) {
    const bool known = std::ranges::any_of(
        elements, [](const ViewElement& one) { return std::isfinite(one.truth); });
    const double fitting = known ? 19.0 : 26.0;  // letters
    const double value = known ? 234.0 : 290.0, sigma = known ? 308.0 : kRight;
    canvas_.Text({kLeft, y_}, "estimate", kFaint);
    canvas_.Text({sigma, y_}, "sigma", kFaint, 0.45, Canvas::Align::kRight);
    if (known) canvas_.Text({kRight, y_}, "error", kFaint, 0.45, Canvas::Align::kRight);
    y_ += kRow + 1.0;
    for (const ViewElement& one : elements) {
      std::string name = one.name.substr(one.name.find('.') + 1);
      if (!one.unit.empty()) name += " [" + one.unit + ']';
      canvas_.Text({kLeft, y_}, name, kInk,
                   std::min(0.45, 0.45 * fitting / static_cast<double>(name.size())));
      canvas_.Text({value, y_}, Digits(one.value, 5), kInk, 0.45, Canvas::Align::kRight);
      canvas_.Text({sigma, y_}, TwoDigits(one.sigma), kFaint, 0.43, Canvas::Align::kRight);
      const double error = one.value - one.truth;
      if (std::isfinite(error)) {
        const bool far = std::abs(error) > 3.0 * one.sigma;
        canvas_.Text({kRight, y_}, TwoDigits(error), far ? ColourOf(Mark::kRejected) : kTruth, 0.45,
                     Canvas::Align::kRight);
      }
      y_ += kRow;
    }
    y_ -= 4.0;
    canvas_.Line({kLeft, y_}, {kRight, y_}, kRule);
  }

  /// Path, landmarks and 3 sigma from above, all axes to one scale.
  void Map(const ViewMap& map, const cv::Rect2d& box) {
    const double left = map.bounds[0], right = map.bounds[1];
    const double bottom = map.bounds[2], top = map.bounds[3];
    constexpr double kMargin = 14.0;
    const double wide = std::max(right - left, 1e-9), high = std::max(top - bottom, 1e-9);
    const double times =
        std::min((box.width - 2.0 * kMargin) / wide, (box.height - 2.0 * kMargin) / high);
    const cv::Point2d middle(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
    const auto place = [&](double x, double y) {
      return cv::Point2d(middle.x + times * (x - 0.5 * (left + right)),
                         middle.y - times * (y - 0.5 * (bottom + top)));
    };
    Inset inset(canvas_, box);
    for (const PlaneGaussian& one : map.landmarks) {
      // The longer, the paler: what is uncertain does not hide what is not.
      constexpr double kShort = 25.0;  // px
      const double length = 3.0 * times * std::sqrt(std::max(one.xx, one.yy));
      const double strength = std::clamp(kShort / length, 0.12, 1.0);
      inset.canvas.ThreeSigma(inset(place(one.x, one.y)), one, {times, -times},
                              kPaper * (1.0 - strength) + cv::Scalar(150, 160, 80) * strength);
    }
    for (const PlaneGaussian& one : map.landmarks) {
      inset.canvas.Disc(inset(place(one.x, one.y)), 1.8, {210, 220, 130});
    }
    const auto trajectory = [&](const std::vector<std::array<double, 2>>& path,
                                const cv::Scalar& colour) {
      std::vector<cv::Point2d> points;
      for (const auto& [x, y] : path) points.push_back(inset(place(x, y)));
      inset.canvas.Path(points, colour, 2);
    };
    trajectory(map.true_path, kTruth);
    trajectory(map.path, kInk);
    const cv::Point2d here = inset(place(map.position.x, map.position.y));
    inset.canvas.ThreeSigma(here, map.position, {times, -times}, ColourOf(Mark::kAccepted), 2);
    const double length = std::hypot(map.heading[0], map.heading[1]);
    if (length > 1e-6) {
      const cv::Point2d ahead(map.heading[0] / length, -map.heading[1] / length);
      const cv::Point2d aside(-ahead.y, ahead.x);
      inset.canvas.Area(
          {here + 16.0 * ahead + 8.0 * aside, here, here + 16.0 * ahead - 8.0 * aside},
          ColourOf(Mark::kAccepted));
    }
    inset.canvas.Disc(here, 3.5, kInk);
    Frame(box, map.right + ", " + map.up + " [m]");
    ScaleBar(box, times);
  }
  /// A round length of a fifth to a half of the width.
  void ScaleBar(const cv::Rect2d& box, double px_per_m) {
    double length_m = std::pow(10.0, std::floor(std::log10(0.5 * box.width / px_per_m)));
    for (const double more : {5.0, 2.0}) {
      if (more * length_m * px_per_m < 0.5 * box.width) {
        length_m *= more;
        break;
      }
    }
    const double y = box.y + box.height - 10.0, x = box.x + 10.0;
    canvas_.Line({x, y}, {x + length_m * px_per_m, y}, kInk, 2);
    char text[32];
    std::snprintf(text, sizeof text, "%g m", length_m);
    canvas_.Text({x, y - 7.0}, text, kFaint, 0.4);
  }

  /// One element over time within 3 sigma, and its truth.
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
    const auto place = [&](std::size_t i, double y) {
      const double x = (series.t_s[i] - start) / (end - start);
      return inset({box.x + x * box.width, box.y + box.height * (high - y) / (high - low)});
    };
    std::vector<cv::Point2d> line, upper, lower, truth;
    for (std::size_t i = 0; i < series.value.size(); ++i) {
      // What lies outside of the box is cut at it: a band may be wide at first.
      const double reach = std::min(3.0 * series.sigma[i], 10.0 * (high - low));
      line.push_back(place(i, series.value[i]));
      upper.push_back(place(i, series.value[i] + reach));
      lower.push_back(place(i, series.value[i] - reach));
      if (std::isfinite(series.truth[i])) truth.push_back(place(i, series.truth[i]));
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

  /// A part of the panel that clips what is drawn in it.
  struct Inset {
    Inset(Canvas& of, const cv::Rect2d& box)
        : image(of.Part(box)), canvas(image), corner(box.tl()) {}
    cv::Point2d operator()(const cv::Point2d& at) const { return at - corner; }
    cv::Mat image;
    Canvas canvas;
    cv::Point2d corner;
  };

  Canvas canvas_;
  double height_, y_ = 0.0;
};

}  // namespace alidade::draw
