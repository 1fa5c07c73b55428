// SPDX-License-Identifier: Apache-2.0
//
// Tests parameters that sensors and the source share: the maps `camera` and `landmarks` at the
// root.
#include "alidade/experiment/source_plugin.h"
#include "alidade/testing/jacobians.h"
#include "host_fixture.h"

namespace alidade {
namespace {

using SharedParametersTest = HostTest;
using testing::Pointers;

const std::string kCamera =
    "camera: {width: 640, height: 480, fx: 500, fy: 500, cx: 320, cy: 240}\n";

const PluginHost& Shipped() {
  static const PluginHost host;
  return host;
}

SharedSensor Pixels(const Config& config, const char* name = "pixels") {
  const Node entry = config.root().At("sensors").At(name);
  entry.Declare("model");
  SharedSensor model = Shipped().CreateSensor("inverse_depth_feature", entry);
  entry.RejectUnread();
  return model;
}

/// Returns u of a point 2 m ahead and 1 m to the right: cx + fx / 2.
double U(const SharedSensor& xyz) {
  const testing::Blocks roles{{0, 0, 0}, {1, 0, 0, 0}, {1, 0, 2}};
  double z[2];
  EXPECT_EQ(xyz->Predict(Pointers(roles).data(), z), Status::kOk);
  return z[0];
}

TEST_F(SharedParametersTest, AreReadFromTheRoot) {
  const Config config =
      Parse(kCamera + "landmarks: {representation: xyz}\nsensors: {pixels: {sigma_px: 1}}");
  const SharedSensor pixels = Pixels(config);
  EXPECT_EQ(pixels->roles()[2].geometry, Geometry::Vector(3));
  EXPECT_EQ(U(pixels), 320.0 + 500.0 / 2);
  EXPECT_NO_THROW(config.root().RejectUnread());
}

TEST_F(SharedParametersTest, TheEntryComesFirstKeyByKey) {
  const Config config =
      Parse(kCamera +
            "landmarks: {representation: anchored}\n"
            "sensors:\n"
            "  pixels: {sigma_px: 1, camera: {fx: 400}, landmarks: {representation: xyz}}\n"
            "  others: {sigma_px: 1}");
  EXPECT_EQ(U(Pixels(config)), 320.0 + 400.0 / 2);
  EXPECT_EQ(Pixels(config, "others")->roles().size(), 5u);
}

TEST_F(SharedParametersTest, ErrorsNameTheMapThatIsWrong) {
  const auto refused = [&](const std::vector<std::string>& words, const std::string& text) {
    const Config config = Parse(text);
    ExpectError(ExitCode::kBadConfig, words, [&] {
      Pixels(config);
      config.root().RejectUnread();
    });
  };
  const std::string sensors = "sensors: {pixels: {sigma_px: 1}}\n";
  // If a key is missing in both maps, the error names the map at the root, because this map is the
  // usual place.
  refused({"test.yaml:2:1 camera.fy: missing; model 'inverse_depth_feature' needs it (px, > 0"},
          sensors + "camera: {width: 640, height: 480, fx: 500, cx: 320, cy: 240}");
  refused({"camera.width: missing; model 'inverse_depth_feature' needs it"}, sensors);
  refused({"test.yaml:2:45 camera.fx: '-5'", "> 0"},
          sensors + "camera: {width: 640, height: 480,       fx: -5, fy: 5, cx: 1, cy: 1}");
  // The key is unknown, or it belongs to another lens.
  refused({"test.yaml:2:81 camera.fz: unknown key", "did you mean 'fx'?"},
          sensors + kCamera.substr(0, kCamera.size() - 2) + ",           fz: 3}");
  refused({"camera.k1: unknown key"}, sensors + kCamera.substr(0, kCamera.size() - 2) + ", k1: 3}");
  refused({"landmarks.representation: 'xzy'", "one of inverse_depth, anchored, xyz",
           "did you mean 'xyz'?"},
          sensors + kCamera + "landmarks: {representation: xzy}");
  // The map in the sensor entry is checked, too.
  refused({"sensors.pixels.camera.fx: '-5'"},
          kCamera + "sensors: {pixels: {sigma_px: 1, camera: {fx: -5}}}");
  refused({"sensors.pixels.camera.fz: unknown key"},
          kCamera + "sensors: {pixels: {sigma_px: 1, camera: {fz: 5}}}");
  refused({"camera: ", "a map"}, sensors + "camera: 5");
}

TEST_F(SharedParametersTest, AModelsOwnComplaintNamesTheMap) {
  const Config config =
      Parse(kCamera.substr(0, kCamera.size() - 2) +
            ", model: photogrammetric, k1: 0, k2: 0, baseline_m: 1}\nsensors: {s: {sigma_px: 1}}");
  ExpectError(
      ExitCode::kBadConfig,
      {"test.yaml:1:78 camera.model: is not 'pinhole'; expected pinhole, because a rectified "
       "stereo pair"},
      [&] { Shipped().CreateSensor("stereo_feature", config.root().At("sensors").At("s")); });
}

TEST_F(SharedParametersTest, OtherKeysAreTheEntrysOwn) {
  const Config config = Parse(kCamera + "sigma_px: 1\nsensors: {pixels: {}}");
  ExpectError(ExitCode::kBadConfig, {"sensors.pixels.sigma_px: missing"}, [&] { Pixels(config); });
}

TEST_F(SharedParametersTest, ASourceSharesThem) {
  const PluginHost host({Built("sources")});
  const Config config = Parse(kCamera + "source: {type: sees}");
  EXPECT_NO_THROW(CreateSource(host, config, 1));
  const Config none = Parse("source: {type: sees}");
  ExpectError(ExitCode::kBadConfig, {"camera.fx: missing; source 'sees' needs it"},
              [&] { CreateSource(host, none, 1); });
}

}  // namespace
}  // namespace alidade
