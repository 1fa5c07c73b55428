// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "alidade/record/run_view.h"

namespace alidade::draw {

inline const cv::Scalar kPaper(30, 27, 24), kInk(235, 235, 235), kFaint(160, 155, 150);
inline const cv::Scalar kRule(72, 66, 60), kTruth(190, 190, 120);

/// Blue, green, red.
inline cv::Scalar ColourOf(Mark mark) {
  switch (mark) {
    case Mark::kAccepted:
      return {80, 220, 60};
    case Mark::kRejected:
      return {60, 50, 240};
    case Mark::kNew:
      return {255, 190, 50};
    case Mark::kLost:
      return {0, 150, 255};
    case Mark::kUnused:
      break;
  }
  return {190, 190, 190};
}

inline const char* NameOf(Mark mark) {
  constexpr const char* kNames[] = {"accepted", "rejected", "new", "lost", "unused"};
  return kNames[static_cast<std::size_t>(mark)];
}

/// A number with so many digits, as many after the point as one below 10 has: `0.0123`, `-40.72`.
inline std::string Digits(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  char text[32];
  if (size >= 1e5) {
    std::snprintf(text, sizeof text, "%.1e", value);
  } else {
    const int whole = size >= 1.0 ? static_cast<int>(std::log10(size)) + 1 : 1;
    std::snprintf(text, sizeof text, "%.*f", std::max(0, digits - whole), value);
  }
  return text;
}

/// A small number in two digits that count: `0.0029`, `14`, `3.1e-04`.
inline std::string TwoDigits(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  if (size == 0.0) return "0";
  char text[32];
  if (size < 1e-3 || size >= 1e5) {
    std::snprintf(text, sizeof text, "%.1e", value);
  } else {
    const int decimals = 1 - static_cast<int>(std::floor(std::log10(size)));
    std::snprintf(text, sizeof text, "%.*f", std::max(0, decimals), value);
  }
  return text;
}

/// An image to draw on at places between its pixels, px.
class Canvas {
 public:
  explicit Canvas(cv::Mat& image) : image_(image) {}

  /// The pixels of a part, which are those of this one.
  cv::Mat Part(const cv::Rect2d& box) {
    return image_(cv::Rect(box) & cv::Rect({0, 0}, image_.size()));
  }

  enum class Align { kLeft, kRight, kMiddle };
  /// `at` is on the base line; what OpenCV has no letters for is shown as '?'.
  void Text(cv::Point2d at, const std::string& text, const cv::Scalar& colour, double size = 0.45,
            Align align = Align::kLeft, int thickness = 1) {
    std::string ascii;
    for (const char c : text) {
      if ((static_cast<unsigned char>(c) & 0xC0U) == 0x80U) continue;  // the rest of a UTF-8 letter
      ascii += c >= ' ' && c <= '~' ? c : '?';
    }
    int below = 0;
    const int width = cv::getTextSize(ascii, kFont, size, thickness, &below).width;
    if (align == Align::kRight) at.x -= width;
    if (align == Align::kMiddle) at.x -= 0.5 * width;
    cv::putText(image_, ascii, {cvRound(at.x), cvRound(at.y)}, kFont, size, colour, thickness,
                cv::LINE_AA);
  }
  void Line(cv::Point2d a, cv::Point2d b, const cv::Scalar& colour, int thickness = 1) {
    Path({a, b}, colour, thickness);
  }
  void Path(const std::vector<cv::Point2d>& points, const cv::Scalar& colour, int thickness = 1,
            bool closed = false) {
    const std::vector<cv::Point> at = Fixed(points);
    if (at.size() > 1) {
      cv::polylines(image_, at, closed, colour, thickness, cv::LINE_AA, kShift);
    }
  }
  void Area(const std::vector<cv::Point2d>& points, const cv::Scalar& colour) {
    const std::vector<cv::Point> at = Fixed(points);
    if (at.size() > 2) cv::fillPoly(image_, {at}, colour, cv::LINE_AA, kShift);
  }
  void Disc(cv::Point2d centre, double radius, const cv::Scalar& colour) {
    if (!Near(centre)) return;
    cv::circle(image_, Fixed(centre), cvRound(radius * kOne), colour, cv::FILLED, cv::LINE_AA,
               kShift);
  }
  void Cross(cv::Point2d centre, double reach, const cv::Scalar& colour) {
    Line({centre.x - reach, centre.y - reach}, {centre.x + reach, centre.y + reach}, colour, 2);
    Line({centre.x - reach, centre.y + reach}, {centre.x + reach, centre.y - reach}, colour, 2);
  }
  /// The ellipse r' P^-1 r = 9 about a mean, both in units of `per_unit` px; y grows upwards where
  /// that is negative in y.
  void ThreeSigma(cv::Point2d centre, const PlaneGaussian& of, cv::Point2d per_unit,
                  const cv::Scalar& colour, int thickness = 1) {
    constexpr int kCorners = 40;
    const double middle = 0.5 * (of.xx + of.yy), half = 0.5 * (of.xx - of.yy);
    const double reach = std::hypot(half, of.xy);
    const double turn = 0.5 * std::atan2(of.xy, half);
    const double a = 3.0 * std::sqrt(std::max(0.0, middle + reach));
    const double b = 3.0 * std::sqrt(std::max(0.0, middle - reach));
    std::vector<cv::Point2d> ring;
    for (int i = 0; i < kCorners; ++i) {
      const double angle = 2.0 * CV_PI * i / kCorners;
      const double x = a * std::cos(angle), y = b * std::sin(angle);
      ring.emplace_back(centre.x + per_unit.x * (x * std::cos(turn) - y * std::sin(turn)),
                        centre.y + per_unit.y * (x * std::sin(turn) + y * std::cos(turn)));
    }
    Path(ring, colour, thickness, true);
  }

 private:
  static constexpr int kShift = 4, kFont = cv::FONT_HERSHEY_SIMPLEX;
  static constexpr double kOne = 1 << kShift;
  static constexpr double kFar = 1e5;  ///< px: OpenCV takes no place beyond 2^31 / 2^kShift

  static bool Near(cv::Point2d at) { return std::abs(at.x) < kFar && std::abs(at.y) < kFar; }
  static cv::Point Fixed(cv::Point2d at) { return {cvRound(at.x * kOne), cvRound(at.y * kOne)}; }
  static std::vector<cv::Point> Fixed(const std::vector<cv::Point2d>& points) {
    std::vector<cv::Point> fixed;
    for (const cv::Point2d& at : points) {
      if (Near(at)) fixed.push_back(Fixed(at));
    }
    return fixed;
  }

  cv::Mat& image_;
};

}  // namespace alidade::draw
