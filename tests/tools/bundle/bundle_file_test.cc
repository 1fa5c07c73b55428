// SPDX-License-Identifier: Apache-2.0
#include "alidade/bundle/bundle_file.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "alidade/bundle/bundle_folder.h"
#include "support/bundles.h"
#include "support/temporary_folder.h"

namespace alidade {
namespace {

using testing::TrueBundle;

class BundleFiles : public ::testing::Test {
 protected:
  BundleFile ReadText(const std::string& text) const {
    std::ofstream(folder_ / "p", std::ios::binary) << text;
    return ReadBundle(folder_ / "p");
  }
  /// Expects that reading `text` fails with a message that contains all of `words`.
  void ExpectBad(const std::string& text, const std::vector<std::string>& words) const {
    try {
      ReadText(text);
      ADD_FAILURE() << "no error; expected: " << words.front();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      const std::string what = e.what();
      EXPECT_EQ(what.find((folder_ / "p").string() + ":"), 0u) << what;
      for (const std::string& word : words)
        EXPECT_NE(what.find(word), what.npos) << "'" << word << "' is not in: " << what;
    }
  }
  static void ExpectSame(const BundleFile& a, const BundleFile& b) {
    ASSERT_EQ(a.problem.cameras.size(), b.problem.cameras.size());
    for (std::size_t i = 0; i < a.problem.cameras.size(); ++i) {
      EXPECT_EQ(a.problem.cameras[i].position, b.problem.cameras[i].position);
      EXPECT_EQ(a.problem.cameras[i].orientation, b.problem.cameras[i].orientation);
      EXPECT_EQ(a.problem.cameras[i].intrinsics, b.problem.cameras[i].intrinsics);
    }
    EXPECT_EQ(a.problem.intrinsics, b.problem.intrinsics);
    EXPECT_EQ(a.problem.points, b.problem.points);
    ASSERT_EQ(a.problem.observations.size(), b.problem.observations.size());
    for (std::size_t i = 0; i < a.problem.observations.size(); ++i) {
      EXPECT_EQ(a.problem.observations[i].camera, b.problem.observations[i].camera);
      EXPECT_EQ(a.problem.observations[i].point, b.problem.observations[i].point);
      EXPECT_EQ(a.problem.observations[i].z, b.problem.observations[i].z);
    }
    EXPECT_EQ(a.camera_ids, b.camera_ids);
    EXPECT_EQ(a.point_ids, b.point_ids);
    EXPECT_EQ(a.colours, b.colours);
    EXPECT_EQ(a.keys, b.keys);
  }
  /// Returns the sensor of BAL.
  static SharedSensor Sensor() { return MakeSensor(SelfCalibratingFeature<RadialLens>(1.0, true)); }
  testing::TemporaryFolder folder_;
};

/// The camera is rotated by 90 degrees about its z axis, (x, y) -> (-y, x), and translated. It has
/// f = 100 px and k1 = 1. In the frame of the camera, the point (0.2, 0.1, -3) is at (-0.1, 0.2,
/// -3) + (0, 0, 1): p = (-0.05, 0.1), q = 0.0125, z = 101.25 p.
const std::string kBal =
    "1 1 1\n0 0 -5.0625e+00 1.0125e+01\n"
    "0\n0\n1.5707963267948966\n0\n0\n1\n100\n1\n0\n0.2\n0.1\n-3\n";

TEST_F(BundleFiles, ReadsBal) {
  const BundleFile file = ReadText(kBal);
  EXPECT_EQ(file.format, BundleFormat::kBal);
  ASSERT_EQ(file.problem.observations.size(), 1u);
  EXPECT_EQ(file.problem.observations[0].z[1], -10.125) << "v grows downwards";
  const SharedSensor sensor =
      MakeSensor(SelfCalibratingFeature<RadialLens>(1.0), "self_calibrating_feature");
  EXPECT_LT(BundleRms(*sensor, file.problem), 1e-12);
}

TEST_F(BundleFiles, BalIsReadAndWrittenWithoutALoss) {
  BundleFile file = TrueBundle();
  file.problem.points[0] = {0.1, 1e-17, -1e22};
  const BundleFile once = ReadText(BundleText(file));
  const BundleFile twice = ReadText(BundleText(once));
  ExpectSame(once, twice);
  EXPECT_EQ(BundleText(once), BundleText(twice));
  EXPECT_EQ(once.problem.points, file.problem.points);
  for (std::size_t i = 0; i < file.problem.cameras.size(); ++i) {
    double d[3];
    UnitQuaternion::Minus(once.problem.cameras[i].orientation.data(),
                          file.problem.cameras[i].orientation.data(), d);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(d[k], 0.0, 1e-14);
      EXPECT_NEAR(once.problem.cameras[i].position[k], file.problem.cameras[i].position[k], 1e-14);
    }
  }
}

/// The text contains the camera of kBal, an unregistered camera, and a point without an
/// observation.
const std::string kBundler =
    "# Bundle file v0.3\n2 2\n100 1 0\n0 -1 0\n1 0 0\n0 0 1\n0 0 1\n"
    "0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n"
    "0.2 0.1 -3\n255 0 7\n1 0 42 -5.0625 10.125\n0 0 0\n1 2 3\n0\n";

TEST_F(BundleFiles, ReadsBundler) {
  const BundleFile file = ReadText(kBundler);
  EXPECT_EQ(file.format, BundleFormat::kBundler);
  EXPECT_EQ(file.colours, (std::vector<std::string>{"255 0 7", "1 2 3"}));
  EXPECT_EQ(file.keys, std::vector<std::int64_t>{42});
  const SharedSensor sensor =
      MakeSensor(SelfCalibratingFeature<RadialLens>(1.0), "self_calibrating_feature");
  EXPECT_LT(BundleRms(*sensor, file.problem), 1e-12);
  EXPECT_EQ(BundleText(file), kBundler);
}

TEST_F(BundleFiles, WritesBundlerOfCamerasThatMoved) {
  BundleFile file = ReadText(kBundler);
  file.problem.cameras[0].position[0] += 1e-9;
  const BundleFile again = ReadText(BundleText(file));
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(again.problem.cameras[0].position[k], file.problem.cameras[0].position[k], 1e-15);
}

std::string Libmv(bool little) {
  std::string bytes = little ? "vP" : "VP";
  const auto add = [&](std::uint32_t word) {
    for (int i = 0; i < 4; ++i)
      bytes += static_cast<char>(word >> 8 * (little ? i : 3 - i) & 0xFFu);
  };
  const auto number = [&](float value) {
    std::uint32_t word = 0;
    std::memcpy(&word, &value, 4);
    add(word);
  };
  for (const float k : {100.f, 320.f, 240.f, 1.f, 0.f, 0.f, 0.f, 0.f}) number(k);
  add(1);  // camera of image 7: the columns of R, then t
  add(7);
  for (const float k : {0.f, 1.f, 0.f, -1.f, 0.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f}) number(k);
  add(1);  // point of track 9; in the frame of the camera it is (-0.1, 0.2, 2)
  add(9);
  for (const float k : {0.2f, 0.1f, 1.f}) number(k);
  add(1);
  add(7);
  add(9);
  number(314.9375f);
  number(250.125f);
  return bytes;
}

TEST_F(BundleFiles, ReadsLibmvOfEitherByteOrder) {
  const SharedSensor sensor =
      MakeSensor(SelfCalibratingFeature<RadtanLens>(1.0), "self_calibrating_feature");
  for (const bool little : {true, false}) {
    const BundleFile file = ReadText(Libmv(little));
    EXPECT_EQ(file.format, BundleFormat::kLibmv);
    EXPECT_EQ(file.camera_ids, std::vector<std::int64_t>{7});
    EXPECT_EQ(file.point_ids, std::vector<std::int64_t>{9});
    EXPECT_LT(BundleRms(*sensor, file.problem), 1e-4)
        << "the tolerance covers the rounding of 32-bit numbers";
    EXPECT_EQ(BundleText(file), Libmv(true));
  }
}

TEST_F(BundleFiles, ATextOfAnotherFormatNamesTheFormats) {
  for (const char* text : {"alidade: 1\n", "# a comment\n1 1 1\n"})
    ExpectBad(text, {":1:1: the format of the file is unknown", "(BAL)", "(Bundler)", "(libmv)"});
}

TEST_F(BundleFiles, APoseGraphOfG2oIsNamed) {
  for (const std::string word : {"VERTEX_SE3:QUAT", "EDGE_SE3:QUAT", "VERTEX_SE2", "FIX"}) {
    ExpectBad("\n" + word + " 0 0 0 0 0 0 0 1\n",
              {":1:1: the file is a graph of g2o (" + word + ")", "relative poses", "COLMAP",
               "the sensor relative_pose"});
  }
}

TEST_F(BundleFiles, RefusesBadBal) {
  ExpectBad("", {":1:1: the file is empty"});
  ExpectBad("1 1 1\n0 1 2 3\n", {":2:3: '1' is out of range; expected the point", "from 0 to 0"});
  ExpectBad("1 1 1\n-1 0 2 3\n", {":2:1: '-1' is out of range", "from 0 to 0"});
  ExpectBad("1 1 1\n0 0 nan 3\n", {":2:5: 'nan' is not finite", "u of an observation"});
  ExpectBad("1 1 1\n0 0 2,5 3\n", {":2:5:"});
  ExpectBad("1 1 1\n0 0 1e999 3\n", {":2:5: '1e999' is too large or too small"});
  ExpectBad("1 x 1\n", {":1:3: 'x' is not a whole number; expected the number of points"});
  ExpectBad("99999999999999999999 1 1\n", {":1:1: '99999999999999999999' is out of range"});
  ExpectBad(kBal.substr(0, kBal.size() - 4), {"the file ends here; expected a point"});
  std::string text = kBal;
  ExpectBad(text.replace(text.find("100"), 3, "-10"),
            {":9:1: the focal length is not positive", "a positive number in px"});
  ExpectBad(kBal + "5\n", {":15:1: the file contains additional numbers"});
  for (const char* magic : {"\x1F\x8B\x08", "BZh9",
                            "\xFD"
                            "7zXZ",
                            "\x28\xB5\x2F\xFD"})
    ExpectBad(magic,
              {":1:1: the file is compressed; expected uncompressed text, for example from zcat"});
  ExpectBad(std::string("1 1 1\0", 6),
            {":1:1: the file is not text; expected a bundle adjustment problem"});
  ExpectBad("frame,feature,dim,value\n",
            {":1:1: the columns are separated by commas", "--camera FILE"});
}

TEST_F(BundleFiles, RefusesBadBundler) {
  ExpectBad("# Bundle file v0.4\n1 1\n",
            {":1:1: the header is '# Bundle file v0.4'; expected '# Bundle file v0.3'"});
  std::string text = kBundler;
  ExpectBad(text.replace(text.find("0 -1 0"), 6, "0 -2 0"), {":6:5:", "are not a rotation matrix"});
  text = kBundler;
  ExpectBad(text.replace(text.find("1 0 42"), 6, "1 1 42"), {"observed camera is not registered"});
  text = kBundler;
  ExpectBad(text.replace(text.find("100"), 3, "-10"), {":3:1: the focal length is not positive"});
  text = kBundler;
  ExpectBad(text.replace(text.find("1 0 42"), 6, "1 2 42"),
            {"'2' is out of range; expected a camera"});
  ExpectBad(kBundler.substr(0, 60), {"the file ends here"});
}

TEST_F(BundleFiles, RefusesBadLibmv) {
  const std::string good = Libmv(true);
  std::string bad = good;
  bad.replace(2, 4, 4, '\0');
  ExpectBad(bad, {"byte 2: the focal length is not positive"});
  bad = good;
  bad[1] = 'N';
  ExpectBad(bad, {"byte 1: the markers are in normalised coordinates"});
  ExpectBad(good.substr(0, good.size() - 2), {"byte 128: the file ends before a marker"});
  ExpectBad(good + "x", {"byte 130: there are data after the last marker"});
  bad = good;
  bad[bad.size() - 16] = 8;
  ExpectBad(bad, {"byte 114: the image of the marker has no camera"});
  bad = good;
  bad[5] = static_cast<char>(0x7F), bad[4] = static_cast<char>(0xC0);
  ExpectBad(bad, {"byte 2: a number of the intrinsics is not finite"});
}

TEST_F(BundleFiles, SavesTheProblemPosesAndPoints) {
  const BundleFile file = ReadText(kBal);
  BundleResult result;
  result.end = BundleEnd::kConverged;
  result.steps = {{2.0, 0.5, true}, {3.0, 0.5, false}};
  BundleProblem start = file.problem;
  start.points.at(0)[0] += 1.0;
  BundleFolder(folder_ / "o", false).Save(file, start, *Sensor(), result);
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "o")) {
    names.insert(entry.path().filename().string());
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"bundle.json", "files.txt", "iterations.csv", "observations.csv",
                                   "points.csv", "points_before.csv", "poses.tum",
                                   "poses_before.tum", "problem.txt", "report.html"}));
  const auto line = [&](const char* name, int number) {
    std::ifstream stream(folder_ / "o" / name);
    std::string text;
    for (int i = 0; i < number; ++i) std::getline(stream, text);
    return text;
  };
  EXPECT_EQ(line("points.csv", 2), "0,0.2,0.1,-3");
  EXPECT_EQ(line("points_before.csv", 2), "0,1.2,0.1,-3");
  EXPECT_EQ(line("poses_before.tum", 1), line("poses.tum", 1));
  EXPECT_EQ(line("iterations.csv", 1), "iteration,cost,accepted,gradient");
  EXPECT_EQ(line("iterations.csv", 3), "1,3,0,0.5");
  EXPECT_TRUE(line("poses.tum", 1).starts_with("0 ")) << line("poses.tum", 1);
  EXPECT_NE(line("bundle.json", 3).find("\"status\": \"converged\""), std::string::npos);
  std::ostringstream page;
  page << std::ifstream(folder_ / "o/report.html").rdbuf();
  EXPECT_NE(page.str().find("<li>The rms reprojection error changed from "), std::string::npos);
  ExpectSame(ReadBundle(folder_ / "o" / "problem.txt"), file);
  EXPECT_THROW(BundleFolder(folder_ / "o", false), Error) << "the folder already exists";
}

/// The point (0.2, 0.1, -3) of kBal has the pixel (-5.0625, -10.125). The start is 1 m to the side:
/// p = (-0.05, 0.6), q = 0.3625, z = 136.25 p.
TEST_F(BundleFiles, SavesResidualsBeforeAndAfter) {
  BundleFile file = ReadText(kBal);
  BundleObservation unused = file.problem.observations.at(0);
  unused.used = false;
  file.problem.observations.push_back(unused);
  BundleProblem start = file.problem;
  start.points.at(0)[0] += 1.0;
  BundleFolder(folder_ / "o", false).Save(file, start, *Sensor(), {});
  std::ifstream stream(folder_ / "o/observations.csv");
  std::string names, used, skipped;
  std::getline(std::getline(std::getline(stream, names), used), skipped);
  EXPECT_EQ(names, "camera,point,used,measured.u,measured.v,before.u,before.v,after.u,after.v");
  double before[2], after[2];
  ASSERT_EQ(std::sscanf(used.c_str(), "0,0,1,-5.0625,-10.125,%lf,%lf,%lf,%lf", &before[0],
                        &before[1], &after[0], &after[1]),
            4)
      << used;
  EXPECT_NEAR(before[0], -5.0625 + 0.05 * 136.25, 1e-9);
  EXPECT_NEAR(before[1], -10.125 + 0.6 * 136.25, 1e-9);
  EXPECT_NEAR(after[0], 0.0, 1e-9);
  EXPECT_NEAR(after[1], 0.0, 1e-9);
  EXPECT_EQ(skipped, "0,0,0,-5.0625,-10.125,,,,");
}

/// The unregistered camera of kBundler has no pose. A zero is written without a sign.
TEST_F(BundleFiles, SavesPosesOfRegisteredCamerasOnly) {
  std::string text = kBundler;
  text.replace(text.find("0 -1 0\n1 0 0\n0 0 1\n0 0 1\n"), 25, "1 0 0\n0 1 0\n0 0 1\n0 0 0\n");
  const BundleFile file = ReadText(text);
  BundleFolder(folder_ / "o", false).Save(file, file.problem, *Sensor(), {});
  std::ostringstream poses;
  poses << std::ifstream(folder_ / "o" / "poses.tum").rdbuf();
  EXPECT_EQ(poses.str(), "0 0 0 0 1 0 0 0\n");
}

}  // namespace
}  // namespace alidade
