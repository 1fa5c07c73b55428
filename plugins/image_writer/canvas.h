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

/// Returns the colour of a mark, as blue, green, red.
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

/// Formats a number with `digits` digits, at least one of them before the decimal point. Examples
/// with 5 digits: `0.0123`, `-40.720`.
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

/// Formats a number with two significant digits: `0.0029`, `14`, `3.1e-04`.
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

/// Image to draw on. Positions can be fractions of a pixel.
class Canvas {
 public:
  explicit Canvas(cv::Mat& image) : image_(image) {}

  /// Returns a part of the image. The part shares its pixels with the image.
  cv::Mat Part(const cv::Rect2d& box) {
    return image_(cv::Rect(box) & cv::Rect({0, 0}, image_.size()));
  }

  enum class Align { kLeft, kRight, kMiddle };
  /// Draws a text with its base line at the height of `position`. `align` determines whether the
  /// left end, the right end or the middle of the text is at `position`. Characters that OpenCV
  /// cannot draw are shown as '?'.
  void Text(cv::Point2d position, const std::string& text, const cv::Scalar& colour,
            double size = 0.45, Align align = Align::kLeft, int thickness = 1) {
    std::string ascii;
    for (const char c : text) {
      if ((static_cast<unsigned char>(c) & 0xC0U) == 0x80U) continue;  // continuation byte of UTF-8
      ascii += c >= ' ' && c <= '~' ? c : '?';
    }
    int baseline = 0;
    const int width = cv::getTextSize(ascii, kFont, size, thickness, &baseline).width;
    if (align == Align::kRight) position.x -= width;
    if (align == Align::kMiddle) position.x -= 0.5 * width;
    cv::putText(image_, ascii, {cvRound(position.x), cvRound(position.y)}, kFont, size, colour,
                thickness, cv::LINE_AA);
  }
  void Line(cv::Point2d a, cv::Point2d b, const cv::Scalar& colour, int thickness = 1) {
    Path({a, b}, colour, thickness);
  }
  void Path(const std::vector<cv::Point2d>& points, const cv::Scalar& colour, int thickness = 1,
            bool closed = false) {
    const std::vector<cv::Point> vertices = ToFixedPoint(points);
    if (vertices.size() > 1) {
      cv::polylines(image_, vertices, closed, colour, thickness, cv::LINE_AA, kShift);
    }
  }
  void Area(const std::vector<cv::Point2d>& points, const cv::Scalar& colour) {
    const std::vector<cv::Point> vertices = ToFixedPoint(points);
    if (vertices.size() > 2) cv::fillPoly(image_, {vertices}, colour, cv::LINE_AA, kShift);
  }
  void Disc(cv::Point2d centre, double radius, const cv::Scalar& colour) {
    if (!IsDrawable(centre)) return;
    cv::circle(image_, ToFixedPoint(centre), cvRound(radius * kFixedPointScale), colour, cv::FILLED,
               cv::LINE_AA, kShift);
  }
  void Cross(cv::Point2d centre, double reach, const cv::Scalar& colour) {
    Line({centre.x - reach, centre.y - reach}, {centre.x + reach, centre.y + reach}, colour, 2);
    Line({centre.x - reach, centre.y + reach}, {centre.x + reach, centre.y - reach}, colour, 2);
  }
  /// Draws the ellipse r' P^-1 r = 9 about a mean. `per_unit` is the length of one unit of the
  /// plane, px. If per_unit.y is negative, y grows upwards.
  void ThreeSigma(cv::Point2d centre, const PlaneGaussian& gaussian, cv::Point2d per_unit,
                  const cv::Scalar& colour, int thickness = 1) {
    constexpr int kCorners = 40;
    const double middle = 0.5 * (gaussian.xx + gaussian.yy),
                 half = 0.5 * (gaussian.xx - gaussian.yy);
    const double reach = std::hypot(half, gaussian.xy);
    const double turn = 0.5 * std::atan2(gaussian.xy, half);
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
  static constexpr double kFixedPointScale = 1 << kShift;
  static constexpr double kDrawableLimit = 1e5;  ///< px; OpenCV has the limit 2^31 / 2^kShift

  static bool IsDrawable(cv::Point2d point) {
    return std::abs(point.x) < kDrawableLimit && std::abs(point.y) < kDrawableLimit;
  }
  static cv::Point ToFixedPoint(cv::Point2d point) {
    return {cvRound(point.x * kFixedPointScale), cvRound(point.y * kFixedPointScale)};
  }
  static std::vector<cv::Point> ToFixedPoint(const std::vector<cv::Point2d>& points) {
    std::vector<cv::Point> fixed;
    for (const cv::Point2d& point : points) {
      if (IsDrawable(point)) fixed.push_back(ToFixedPoint(point));
    }
    return fixed;
  }

  cv::Mat& image_;
};

}  // namespace alidade::draw
