// SPDX-License-Identifier: Apache-2.0
//
// Tests errors.csv, which contains the error of each element with truth.
#include "alidade/record/errors_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/recording.h"
#include "support/systems.h"

namespace alidade::testing {
namespace {

/// A camera with an estimated position and orientation and a known heading. The camera also has a
/// bias without truth.
class ErrorsOfACamera : public ::testing::Test {
 protected:
  ErrorsOfACamera() {
    const auto declare = [&](const char* name, const char* unit, Geometry geometry,
                             BlockStatus status) {
      const Space space{name, unit, "", {}, std::move(geometry)};
      return system_.layout.Declare(std::string("cam.") + name, "cam", space, status);
    };
    position_ = declare("position", "m", Geometry::Vector(2), BlockStatus::kEstimated);
    orientation_ = declare("orientation", "", Geometry::UnitQuaternion(), BlockStatus::kEstimated);
    heading_ = declare("heading", "rad", Geometry::Angle(), BlockStatus::kConstant);
    declare("bias", "m", Geometry::Vector(1), BlockStatus::kEstimated);
    state_ = State(system_.layout);
  }

  void AddBlocks() {
    const double position[] = {1.25, 2.0}, heading = 3.1;
    // The orientation is a rotation by 0.2 rad about x.
    const double orientation[] = {std::cos(0.1), std::sin(0.1), 0.0, 0.0};
    state_.Add(position_, position, Eigen::Vector2d(0.25, 4.0).asDiagonal().toDenseMatrix());
    state_.Add(orientation_, orientation, 1e-4 * Eigen::Matrix3d::Identity());
    state_.Add(heading_, &heading, Eigen::MatrixXd(0, 0));
  }

  /// Adds a frame with the truth of the position, the orientation and the heading.
  void Add(internal::ErrorsFile& file, bool has_position = true) {
    const std::vector<double> position = {1.0, 2.5};
    file.Add({FrameAt(0.5, {}),
              {has_position ? position : std::vector<double>(), {1.0, 0.0, 0.0, 0.0}, {-3.1}}},
             state_);
  }
  /// Returns the layouts of the blocks. `truths` contains the index of the truth of each block.
  std::vector<internal::BlockLayout> Layouts(const std::vector<int>& truths) const {
    std::vector<internal::BlockLayout> layouts = internal::BlockLayoutsOf(system_, {});
    for (std::size_t i = 0; i < truths.size(); ++i) layouts.at(i).truth = truths[i];
    return layouts;
  }

  Problem system_;
  BlockId position_, orientation_, heading_;
  State state_;
};

TEST_F(ErrorsOfACamera, IsEstimateMinusTruthInTheTangent) {
  const TemporaryFolder folder;
  internal::OutputFolder out(folder / "out", false);
  internal::RunColumns columns;
  internal::ErrorsFile file(out, "ekf", Layouts({0, 1, 2, -1}), columns);
  Add(file);  // no block has a value yet
  AddBlocks();
  Add(file);
  Add(file, false);
  file.Close();
  out.Commit();
  const std::vector<std::string> lines = Lines(folder / "out/ekf/errors.csv");
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0],
            "t_s,cam.position.0,cam.position.1,sigma:cam.position.0,sigma:cam.position.1,"
            "cam.orientation.rx,cam.orientation.ry,cam.orientation.rz,sigma:cam.orientation.rx,"
            "sigma:cam.orientation.ry,sigma:cam.orientation.rz,cam.heading,sigma:cam.heading,"
            "nees:cam");
  EXPECT_EQ(lines[1], "0.500000000,,,,,,,,,,,,,");
  const std::vector<std::string> cells = Cells(lines[2]);
  ASSERT_EQ(cells.size(), 14u);
  EXPECT_EQ(cells[1] + ' ' + cells[2], "0.25 -0.5");  // the errors are in m
  EXPECT_EQ(cells[3] + ' ' + cells[4], "0.5 2");
  EXPECT_NEAR(std::stod(cells[5]), 0.2, 1e-12);  // the error is in rad and in the frame of the body
  EXPECT_EQ(cells[6] + cells[7], "00");
  EXPECT_EQ(cells[9], "0.01");
  // The error is wrapped to (-pi, pi].
  EXPECT_NEAR(std::stod(cells[11]), 6.2 - 2.0 * std::acos(-1.0), 1e-12);
  EXPECT_EQ(cells[12], "");
  // The heading is constant. NEES = (0.25^2 / 0.25 + 0.5^2 / 4 + 0.2^2 / 1e-4) / 5
  EXPECT_NEAR(std::stod(cells[13]), (0.25 + 0.0625 + 400.0) / 5.0, 1e-9);
  EXPECT_EQ(Cells(lines[3])[1] + ' ' + Cells(lines[3])[3], " 0.5");
  EXPECT_NEAR(std::stod(Cells(lines[3])[13]), 400.0 / 3.0, 1e-9);  // the position is unknown
}

TEST_F(ErrorsOfACamera, WithoutTruthIsNoFile) {
  const TemporaryFolder folder;
  internal::OutputFolder out(folder / "out", false);
  internal::RunColumns columns;
  internal::ErrorsFile file(out, "ekf", Layouts({-1, -1, -1, -1}), columns);
  AddBlocks();
  Add(file);
  file.Close();
  out.Write("other.csv", "");
  out.Commit();
  EXPECT_FALSE(fs::exists(folder / "out/ekf"));
}

}  // namespace
}  // namespace alidade::testing
