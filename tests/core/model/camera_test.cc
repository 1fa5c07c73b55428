// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/camera.h"

#include <gtest/gtest.h>

#include "alidade/model/jet.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using Point = std::array<double, 3>;
using Pixel = std::array<double, 2>;
using testing::MapHost;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Camera Made(CameraModel model, const std::array<double, 4>& k = {},
            const std::array<double, 2>& p = {}) {
  return Camera(640, 480, 525, 520, 320.5, 239.25, model, k, p);
}

Camera Pinhole() { return Made(CameraModel::kPinhole); }
Camera Radtan() { return Made(CameraModel::kRadtan, {-0.28, 0.07, 0.015, 0.0}, {0.0012, -0.0007}); }
Camera Equidistant() { return Made(CameraModel::kEquidistant, {-0.012, 0.034, -0.021, 0.005}); }
Camera Rational() {
  return Camera(640, 480, 525, 520, 320.5, 239.25, CameraModel::kRationalPolynomial,
                {-0.16, 0.05, 0.004, 0.0}, {0.0012, -0.0007}, {0.12, -0.03, 0.008});
}
// The lens of MonoSLAM has f = 2.1735 mm, pixels of 0.0112 mm, k1 = 0.06333 mm^-2 and
// k2 = 0.0139 mm^-4.
Camera Photogrammetric() {
  constexpr double kFocal_mm = 2.1735, kPixel_mm = 0.0112, kF2 = kFocal_mm * kFocal_mm;
  return Camera(320, 240, kFocal_mm / kPixel_mm, kFocal_mm / kPixel_mm, 1.7945 / kPixel_mm,
                1.4433 / kPixel_mm, CameraModel::kPhotogrammetric,
                {6.333e-2 * kF2, 1.39e-2 * kF2 * kF2, 0.0, 0.0});
}
const std::vector<Camera>& All() {
  static const std::vector<Camera> all{Pinhole(), Radtan(), Equidistant(), Photogrammetric(),
                                       Rational()};
  return all;
}

const Point kPoints[] = {
    {0.3, -0.2, 1.0}, {-0.9, 0.6, 2.0}, {0.0, 0.0, 1.5}, {0.55, 0.41, 0.9}, {1e-4, -2e-4, 1.0}};

Pixel Projected(const Camera& camera, const Point& h) {
  Pixel z{kNaN, kNaN};
  EXPECT_TRUE(camera.Project(h.data(), z.data()));
  return z;
}

void ExpectPixels(const Camera& camera, const std::array<Pixel, 5>& expected) {
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Pixel z = Projected(camera, kPoints[i]);
    // The expected pixels were printed with 15 digits.
    EXPECT_NEAR(z[0], expected[i][0], 2e-12) << "point " << i;
    EXPECT_NEAR(z[1], expected[i][1], 2e-12) << "point " << i;
  }
}

TEST(Camera, ProjectsAsOpenCvDoes) {
  // The expected pixels were computed by cv::projectPoints of OpenCV 4.6 with (k1, k2, p1, p2, k3).
  ExpectPixels(Radtan(), {{{472.2689879125, 139.08386068},
                           {101.668874202051, 383.859553225312},
                           {320.5, 239.25},
                           {597.528566563672, 444.315605924274},
                           {320.55249994834, 239.146000097136}}});
  // Likewise, with (k1, k2, p1, p2, k3, k4, k5, k6).
  ExpectPixels(Rational(), {{{472.371221148703, 139.01635428911},
                             {101.016300901233, 384.290458769979},
                             {320.5, 239.25},
                             {599.939375287704, 446.095638547525},
                             {320.55249994834, 239.146000097136}}});
  // The expected pixels were computed by cv::fisheye::projectPoints.
  ExpectPixels(Equidistant(), {{{471.513622615548, 139.533068241162},
                                {104.188698091775, 382.084129514002},
                                {320.5, 239.25},
                                {594.521003699692, 441.574772255495},
                                {320.552499999094, 239.146000001796}}});
}

TEST(Camera, ProjectsAsMonoSlamDoes) {
  // The expected pixels solve r_d (1 + k1 r_d^2 + k2 r_d^4) = r_u in mm, after 200 bisections.
  ExpectPixels(Photogrammetric(), {{{216.180981148085, 91.5608935203241},
                                    {80.2554343010394, 182.177924751688},
                                    {160.223214285714, 128.866071428571},
                                    {260.797146968682, 203.839366701329},
                                    {160.242620535424, 128.827258929152}}});
}

TEST(Camera, UnprojectIsTheInverseOverTheImage) {
  for (const Camera& camera : All()) {
    for (double u = -0.5; u <= camera.width; u += 21.3) {
      for (double v = -0.5; v <= camera.height; v += 19.7) {
        const Pixel z{u, v};
        Point h;
        ASSERT_TRUE(camera.Unproject(z.data(), h.data())) << u << ' ' << v;
        const Pixel again = Projected(camera, h);
        EXPECT_NEAR(again[0], u, 1e-10);
        EXPECT_NEAR(again[1], v, 1e-10);
      }
    }
  }
}

using Jet2 = Jet<double, 2>;
using Jet3 = Jet<double, 3>;

TEST(Camera, DerivativesOfProjectAgreeWithDifferences) {
  constexpr double kStep = 1e-5;
  for (const Camera& camera : All()) {
    for (const Point& point : kPoints) {
      Jet3 h[3], z[2];
      for (int i = 0; i < 3; ++i) h[i] = Jet3(point[static_cast<std::size_t>(i)], i);
      ASSERT_TRUE(camera.Project(h, z));
      EXPECT_NEAR(z[0].a, Projected(camera, point)[0], 1e-12);  // the order of operations differs
      EXPECT_NEAR(z[1].a, Projected(camera, point)[1], 1e-12);
      for (int k = 0; k < 3; ++k) {
        Point more = point, less = point;
        more[static_cast<std::size_t>(k)] += kStep;
        less[static_cast<std::size_t>(k)] -= kStep;
        const Pixel a = Projected(camera, more), b = Projected(camera, less);
        // The error of a difference is h^2 times third derivatives of order 1e4 px, plus a rounding
        // error of 1e-13 / h.
        EXPECT_NEAR(z[0].v[k], (a[0] - b[0]) / (2 * kStep), 1e-5);
        EXPECT_NEAR(z[1].v[k], (a[1] - b[1]) / (2 * kStep), 1e-5);
      }
    }
  }
}

TEST(Camera, DerivativesOfUnprojectInvertThoseOfProject) {
  for (const Camera& camera : All()) {
    for (const Point& point : kPoints) {
      const Pixel pixel = Projected(camera, point);
      const Jet2 z[2] = {Jet2(pixel[0], 0), Jet2(pixel[1], 1)};
      Jet2 h[3], again[2];
      ASSERT_TRUE(camera.Unproject(z, h));
      ASSERT_TRUE(camera.Project(h, again));
      for (int i = 0; i < 2; ++i) {
        for (int k = 0; k < 2; ++k) EXPECT_NEAR(again[i].v[k], i == k ? 1.0 : 0.0, 1e-10);
      }
    }
  }
}

TEST(Camera, IsDefinedInFrontOfIt) {
  for (const Camera& camera : All()) {
    for (const Point& h : {Point{0, 0, 0}, Point{0, 0, -1}, Point{0.1, 0.1, kNaN}}) {
      Pixel z{7, 7};
      EXPECT_FALSE(camera.Project(h.data(), z.data()));
      EXPECT_EQ(z, (Pixel{7, 7}));
    }
  }
  const Point aside{1, 0, 0};
  Pixel z;
  EXPECT_FALSE(Pinhole().Project(aside.data(), z.data()));
  const Camera fisheye = Made(CameraModel::kEquidistant);
  ASSERT_TRUE(fisheye.Project(aside.data(), z.data()));
  EXPECT_NEAR(z[0], 320.5 + 525 * std::acos(0.0), 1e-12);
}

// k1 = -0.3 and the other coefficients are zero, so r (1 - 0.3 r^2) has its maximum at
// r^2 = 1 / 0.9.
TEST(Camera, IsDefinedWhereTheDistortionGrows) {
  const Camera camera = Made(CameraModel::kRadtan, {-0.3, 0, 0, 0});
  const double turn = 1.0 / std::sqrt(0.9);
  Pixel z{7, 7};
  for (const double r : {turn * 1.001, 2.0, 100.0}) {
    const Point h{r, 0, 1};
    EXPECT_FALSE(camera.Project(h.data(), z.data())) << r;
  }
  EXPECT_EQ(z, (Pixel{7, 7}));
  const Point within{turn * 0.99, 0, 1};
  EXPECT_TRUE(camera.Project(within.data(), z.data()));
  const Pixel beyond{320.5 + 525 * turn, 239.25};  // no ray is projected to this pixel
  Point h{7, 7, 7};
  EXPECT_FALSE(camera.Unproject(beyond.data(), h.data()));
}

// With k4 = -0.5 and the other coefficients zero, s(q) = 1 / (1 - 0.5 q) has a pole at q = 2.
TEST(Camera, IsDefinedBeforeThePoleOfTheDistortion) {
  const Camera camera(640, 480, 525, 520, 320.5, 239.25, CameraModel::kRationalPolynomial, {}, {},
                      {-0.5, 0.0, 0.0});
  const double pole = std::sqrt(2.0);
  Pixel z{7, 7};
  for (const double r : {pole * 1.001, 2.0, 100.0}) {
    const Point h{r, 0, 1};
    EXPECT_FALSE(camera.Project(h.data(), z.data())) << r;
  }
  EXPECT_EQ(z, (Pixel{7, 7}));
  const Point within{pole * 0.98, 0, 1};
  EXPECT_TRUE(camera.Project(within.data(), z.data()));
}

TEST(Camera, RationalPolynomialIsReadFromParameters) {
  const MapHost host({{"camera.model", {4}},
                      {"camera.width", {640}},
                      {"camera.height", {480}},
                      {"camera.fx", {525}},
                      {"camera.fy", {520}},
                      {"camera.cx", {320.5}},
                      {"camera.cy", {239.25}},
                      {"camera.k1", {-0.16}},
                      {"camera.k2", {0.05}},
                      {"camera.k3", {0.004}},
                      {"camera.k4", {0.12}},
                      {"camera.k5", {-0.03}},
                      {"camera.k6", {0.008}},
                      {"camera.p1", {0.0012}},
                      {"camera.p2", {-0.0007}}});
  Params params(host.c());
  const Camera camera(params);
  EXPECT_TRUE(host.missing().empty());
  for (const Point& h : kPoints) EXPECT_EQ(Projected(camera, h), Projected(Rational(), h));
}

TEST(Camera, ContainsItsPixelsWhole) {
  const Camera camera = Pinhole();
  for (const Pixel& z : {Pixel{-0.5, 0}, Pixel{639.5, 479.5}}) {
    EXPECT_TRUE(camera.Contains(z.data()));
  }
  for (const Pixel& z : {Pixel{-0.51, 0}, Pixel{639.51, 0}, Pixel{0, 479.51}, Pixel{0, kNaN}}) {
    EXPECT_FALSE(camera.Contains(z.data()));
  }
}

TEST(Camera, IsReadFromParameters) {
  const MapHost host({{"camera.model", {1}},
                      {"camera.width", {640}},
                      {"camera.height", {480}},
                      {"camera.fx", {525}},
                      {"camera.fy", {520}},
                      {"camera.cx", {320.5}},
                      {"camera.cy", {239.25}},
                      {"camera.k1", {-0.28}},
                      {"camera.k2", {0.07}},
                      {"camera.k3", {0.015}},
                      {"camera.p1", {0.0012}},
                      {"camera.p2", {-0.0007}}});
  Params params(host.c());
  const Camera camera(params);
  EXPECT_TRUE(host.missing().empty());
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  for (const Point& h : kPoints) EXPECT_EQ(Projected(camera, h), Projected(Radtan(), h));
}

}  // namespace
}  // namespace alidade
