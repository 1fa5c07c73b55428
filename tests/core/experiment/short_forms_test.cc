// SPDX-License-Identifier: Apache-2.0
//
// Tests the short forms of a config: each equals a long form, and each error names the place of the
// short form.
#include "alidade/experiment/short_forms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "alidade/experiment/make_filter.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/run.h"
#include "support/config_text.h"

namespace alidade {
namespace {

using testing::Message;
using testing::Read;

const PluginHost& Shipped() {
  static const PluginHost host(std::vector<std::filesystem::path>{});
  return host;
}

std::string Expanded(const std::string& text) {
  Config config = Read(text);
  ExpandShortForms(config, Shipped());
  return config.ToYaml();
}

/// Returns the error of the expansion, or else of the problem.
std::string ErrorOf(const std::string& text) {
  return Message([&] {
    Config config = Read(text);
    ExpandShortForms(config, Shipped());
    ReadProblem(config.root(), Shipped(), {});
  });
}

constexpr const char* kPose = R"(state:
  cam:
    model: quaternion_pose
    noise: {kind: continuous, linear_acceleration: 1, angular_acceleration: 1}
    initial:
      position: exact
      orientation: {sigma: 0.1}
      velocity: {mean: [1, 2, 3], sigma: 0.2}
      angular_velocity: {sigma: [1, 2, 3]}
)";
constexpr const char* kPixels = R"(  pixels:
    model: inverse_depth_feature
    stream: tracks
    sigma_px: 1
    camera: {width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}
)";
const std::string kSlam = std::string(kPose) +
                          "landmarks: {prior: {distance_m: [1, 4]}}\nsensors:\n" + kPixels +
                          "    roles: cam\n";

/// Motion in one dimension, of a target with a renamed block, and a template.
constexpr const char* kDepth = R"(state:
  target:
    model: constant_velocity
    blocks: {position: depth}
    noise: {acceleration: 1}
    initial: {depth: {mean: 1, sigma: 1}, velocity: {sigma: 1}}
  template: {model: constant, blocks: {value: inverse_distance},
             initial: {inverse_distance: {mean: 1, sigma: 1}}}
sensors:
)";
const std::string kStereo = std::string(kDepth) +
                            "  stereo: {model: stereo_disparity, stream: d, focal_px: 4, "
                            "baseline_m: 1, sigma_px: 1, roles: ";
const std::string kScale =
    std::string(kDepth) +
    "  scale: {model: scale_2d, stream: s, template_px: 300, sigma_px: 1, roles: ";

TEST(ShortForms, RolesOfAnEntryAreBoundByName) {
  const std::string text = Expanded(kSlam);
  EXPECT_NE(
      text.find("    roles:\n      position: cam.position\n      orientation: cam.orientation\n"
                "      landmark: landmarks\n"),
      std::string::npos)
      << text;
}

TEST(ShortForms, ExpansionIsIdempotent) {
  const std::string text = Expanded(kSlam + "estimators: [ekf, ukf]\ndefaults: {gate: 0.9}\n");
  EXPECT_EQ(Expanded(text), text);
}

TEST(ShortForms, TheRoleOfALandmarkIsOptional) {
  const std::string bound = std::string(kPose) +
                            "landmarks: {prior: {distance_m: [1, 4]}}\nsensors:\n" + kPixels +
                            "    roles: {position: cam.position, orientation: cam.orientation}\n";
  EXPECT_NE(Expanded(bound).find("landmark: landmarks"), std::string::npos);
}

TEST(ShortForms, TheOnlyBlockOfAnEntryNeedsNoName) {
  const std::string text = Expanded(
      "state: {range: {model: constant, initial: {value: exact}}}\n"
      "sensors: {stereo: {model: stereo_disparity, stream: d, focal_px: 4, baseline_m: 1, "
      "sigma_px: "
      "1, roles: range}}\n");
  EXPECT_NE(text.find("depth: range.value"), std::string::npos) << text;
}

// The reader of the sensor checks the only block, and selects the variant of the model by it.
TEST(ShortForms, TheOnlyBlockOfAnEntryIsChecked) {
  const std::string point = "state: {point: {model: constant, size: 2, initial: {value: exact}}}\n";
  EXPECT_EQ(ErrorOf(point + "sensors: {fix: {model: direct, stream: f, sigma: 1, roles: point}}\n"),
            "no error");
  EXPECT_EQ(ErrorOf(point + "sensors: {stereo: {model: stereo_disparity, stream: d, focal_px: 4, "
                            "baseline_m: 1, sigma_px: 1, roles: point}}\n"),
            "f.yaml:2:104 sensors.stereo.roles.depth: block 'point.value' has geometry vector(2); "
            "expected vector(1) for role 'depth' of model 'stereo_disparity'");
}

/// A robot whose blocks a sensor `direct` could all measure.
constexpr const char* kRobot = R"(state:
  robot:
    model: planar_body_velocity
    noise: {linear_acceleration: 1, angular_acceleration: 1}
    initial: {position: exact, heading: exact, body_velocity: exact, turn_rate: exact}
sensors:
)";

// Of these blocks, only the turn rate has the size of the default variant of `direct`. The sensor
// may measure the heading.
TEST(ShortForms, ABlockIsNotChosenByItsSize) {
  EXPECT_EQ(ErrorOf(std::string(kRobot) +
                    "  compass: {model: direct, stream: c, sigma: 1, roles: robot}\n"),
            "f.yaml:7:56 sensors.compass.roles: no block matches role 'value' of model 'direct' "
            "(block that is measured) in name, geometry and unit; expected a map with value: "
            "robot.position or robot.heading or robot.body_velocity or robot.turn_rate");
}

// The sensor needs the velocity in the world. The state has that in the frame of the body.
TEST(ShortForms, ABlockIsNotChosenByItsUnit) {
  EXPECT_EQ(ErrorOf(std::string(kRobot) +
                    "  wheels: {model: body_velocity, stream: w, sigma_m_s: 1, roles: robot}\n"),
            "f.yaml:7:66 sensors.wheels.roles: no block matches role 'velocity' of model "
            "'body_velocity' (m/s: velocity of the body in the world) in name, geometry and unit; "
            "expected a map with velocity: robot.body_velocity");
}

// The geometry of the block selects the variant of the sensor `position`.
TEST(ShortForms, RolesSelectTheVariantOfAModel) {
  const std::string text = Expanded(
      "state: {robot: {model: constant_velocity, dimensions: 2, noise: {acceleration: 1}, initial: "
      "{position: exact, velocity: exact}}}\n"
      "sensors: {gnss: {model: position, stream: p, sigma_m: 1, roles: robot}}\n");
  EXPECT_NE(text.find("roles:\n      position: robot.position\n"), std::string::npos) << text;
}

TEST(ShortForms, RolesOfSeveralEntries) {
  const std::string text = Expanded(kScale + "[target, template]}\n");
  EXPECT_NE(text.find("depth: target.depth\n      inverse_distance: template.inverse_distance\n"),
            std::string::npos)
      << text;
}

TEST(ShortForms, RolesOfAFormulaHaveTheNamesOfTheBlocks) {
  const std::string formula =
      std::string(kDepth) +
      "  s: {model: formula, stream: s, z: {a: depth}, sigma: {a: 1}, roles: ";
  const std::string text = Expanded(formula + "[target, template]}\n");
  EXPECT_NE(text.find("depth: target.depth\n      velocity: target.velocity\n      "
                      "inverse_distance: template.inverse_distance\n"),
            std::string::npos)
      << text;
}

TEST(ShortForms, RolesOfMatricesAreThoseOfH) {
  const std::string linear = std::string(kDepth) +
                             "  s: {model: linear, stream: s, z: {a: number}, sigma: {a: 1}, "
                             "H: {depth: 1, bias: 1}, owns: {bias: number}, initial: {bias: "
                             "{mean: 0, sigma: 1}}, roles: ";
  const std::string text = Expanded(linear + "target}\n");
  EXPECT_NE(text.find("roles:\n      depth: target.depth\n"), std::string::npos) << text;
  EXPECT_EQ(text.find("velocity: target.velocity"), std::string::npos) << text;
  EXPECT_EQ(ErrorOf(linear + "target}\n"), "no error");
}

TEST(ShortForms, AFormulaHasTheShortFormsOfItsStates) {
  const std::string formula = std::string(kDepth) +
                              "  s: {model: formula, stream: s, z: {a: depth + bias}, sigma: {a: "
                              "1}, owns: {bias: number}, roles: target, initial: {bias: ";
  for (const char* initial : {"{sigma: 0.5}", "exact"}) {
    EXPECT_EQ(ErrorOf(formula + initial + "}}\n"), "no error") << initial;
  }
}

TEST(ShortForms, TheRoleOfALandmarkOfAFormulaIsOptional) {
  const std::string text = Expanded(
      std::string(kDepth) +
      "  s: {model: formula, stream: s, landmark: [x], z: {a: depth - landmark.x}, sigma: {a: 1}, "
      "roles: target}\n");
  EXPECT_NE(text.find("landmark: landmarks\n"), std::string::npos) << text;
}

TEST(ShortForms, AFormulaReportsABlockThatDoesNotExist) {
  const std::string error = ErrorOf(
      std::string(kDepth) +
      "  s: {model: formula, stream: s, z: {a: d}, sigma: {a: 1}, roles: {d: target.dpth}}\n");
  EXPECT_NE(error.find("'target.dpth' does not exist"), std::string::npos) << error;
}

TEST(ShortForms, ErrorsOfRolesListTheCandidates) {
  EXPECT_EQ(
      ErrorOf(kStereo + "tagret}\n"),
      "f.yaml:10:96 sensors.stereo.roles: state entry 'tagret' does not exist; expected target, "
      "template, or a map {ROLE: ENTRY.BLOCK}; did you mean 'target'?");
  EXPECT_EQ(ErrorOf(std::string(kPose) + "sensors:\n  stereo: {model: stereo_disparity, stream: d, "
                                         "focal_px: 4, baseline_m: 1, sigma_px: 1, roles: cam}\n"),
            "f.yaml:11:96 sensors.stereo.roles: no block matches role 'depth' of model "
            "'stereo_disparity' (m: depth along the optical axis) in name, geometry and unit; "
            "expected a map with depth: cam.position or cam.orientation");
}

TEST(ShortForms, AnAmbiguousRoleIsAnError) {
  std::string text = kStereo + "[target, other]}\n";
  text.replace(text.find("  template:"), 0,
               "  other: {model: constant_velocity, noise: {acceleration: 1}, blocks: {position: "
               "depth}, initial: {depth: exact, velocity: exact}}\n");
  EXPECT_EQ(ErrorOf(text),
            "f.yaml:11:96 sensors.stereo.roles: several blocks match role 'depth' of model "
            "'stereo_disparity' (m: depth along the optical axis) in name, geometry and unit; "
            "expected a map with depth: target.depth or other.depth");
}

TEST(ShortForms, MissingMeansAreNeutralElements) {
  Config config = Read(kSlam);
  ExpandShortForms(config, Shipped());
  const Problem problem = ReadProblem(config.root(), Shipped(), {});
  ASSERT_EQ(problem.priors.size(), 4U);
  EXPECT_EQ(problem.priors[0].mean, (std::vector<double>{0, 0, 0}));
  EXPECT_EQ(problem.priors[0].covariance, Eigen::MatrixXd::Zero(3, 3));
  EXPECT_EQ(problem.priors[1].mean, (std::vector<double>{1, 0, 0, 0}));
  EXPECT_EQ(problem.priors[2].mean, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(problem.priors[3].mean, (std::vector<double>{0, 0, 0}));
}

TEST(ShortForms, AMisspeltMeanIsAnUnknownKey) {
  std::string text = kSlam;
  text.replace(text.find("mean:"), 5, "maen:");
  EXPECT_EQ(ErrorOf(text),
            "f.yaml:8:18 state.cam.initial.velocity.maen: unknown key; did you mean 'mean'?");
}

/// Returns the mean of the orientation of kSlam with this text.
std::vector<double> Orientation(const std::string& mean) {
  std::string text = kSlam;
  text.replace(text.find("{sigma: 0.1}"), 12, "{mean: " + mean + ", sigma: 0.1}");
  Config config = Read(text);
  ExpandShortForms(config, Shipped());
  return ReadProblem(config.root(), Shipped(), {}).priors[1].mean;
}

// Ry(90 deg) = (c, 0, c, 0) and Rz(90 deg) = (c, 0, 0, c) with c = sqrt(1/2). Their product
// Rz Ry is (1/2, -1/2, 1/2, 1/2).
TEST(ShortForms, OrientationsAreAnglesListsOrMaps) {
  EXPECT_EQ(Orientation("[0.6, 0, 0, 0.8]"), (std::vector<double>{0.6, 0, 0, 0.8}));
  EXPECT_EQ(Orientation("{w: 0.6, x: 0, y: 0, z: 0.8}"), (std::vector<double>{0.6, 0, 0, 0.8}));
  EXPECT_EQ(Orientation("{rpy_deg: [0, 0, 0]}"), (std::vector<double>{1, 0, 0, 0}));
  const double c = std::sqrt(0.5);
  const std::vector<std::pair<const char*, std::vector<double>>> turns = {
      {"{rpy_deg: [90, 0, 0]}", {c, c, 0, 0}},
      {"{rpy_deg: [0, 90, 0]}", {c, 0, c, 0}},
      {"{rpy_deg: [0, 0, 90]}", {c, 0, 0, c}},
      {"{rpy_deg: [0, 90, 90]}", {0.5, -0.5, 0.5, 0.5}}};
  for (const auto& [text, expected] : turns) {
    const std::vector<double> value = Orientation(text);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(value[i], expected[i], 1e-15) << text;
  }
}

TEST(ShortForms, ErrorsOfOrientations) {
  const auto error = [](const std::string& mean) { return Message([&] { Orientation(mean); }); };
  EXPECT_EQ(error("[1, 0, 0]"),
            "f.yaml:7:27 state.cam.initial.orientation.mean: has 3 items; expected 4");
  EXPECT_EQ(error("[2, 0, 0, 0]"),
            "f.yaml:7:27 state.cam.initial.orientation.mean: the value does not have unit length; "
            "expected a length within 1e-3 of 1");
  EXPECT_EQ(error("{rpy_deg: [1, 0, 0], w: 1}"),
            "f.yaml:7:48 state.cam.initial.orientation.mean.w: unknown key; expected rpy_deg");
  EXPECT_EQ(error("identity"),
            "f.yaml:7:27 state.cam.initial.orientation.mean: 'identity'; expected a map, as in {w: "
            "1, x: 0, y: 0, z: 0}, with rpy_deg: [ROLL, PITCH, YAW] in place of a quaternion, or a "
            "list");
}

/// Returns the prior of kSlam with this text.
LandmarkOptions::Prior PriorOf(const std::string& prior) {
  std::string text = kSlam;
  text.replace(text.find("{distance_m: [1, 4]}"), 20, prior);
  Config config = Read(text);
  ExpandShortForms(config, Shipped());
  return ReadProblem(config.root(), Shipped(), {}).landmarks->prior.value();
}

// From 1 m to 4 m: the inverse distances 1 and 1/4 are mean +- 2 sigma.
TEST(ShortForms, DistancesOfThePriorAreTwoSigma) {
  const LandmarkOptions::Prior prior = PriorOf("{distance_m: [1, 4], min_observations: 2}");
  EXPECT_DOUBLE_EQ(prior.inverse_distance + 2.0 * prior.sigma, 1.0);
  EXPECT_DOUBLE_EQ(prior.inverse_distance - 2.0 * prior.sigma, 0.25);
  EXPECT_EQ(prior.min_observations, 2);
  // [Civera2008]: mean 1 / (2 NEAR), sigma 1 / (4 NEAR)
  const LandmarkOptions::Prior unbounded = PriorOf("{distance_m: [0.5, none]}");
  EXPECT_DOUBLE_EQ(unbounded.inverse_distance, 1.0);
  EXPECT_DOUBLE_EQ(unbounded.sigma, 0.5);
}

TEST(ShortForms, ErrorsOfDistances) {
  const auto error = [](const std::string& prior) { return Message([&] { PriorOf(prior); }); };
  EXPECT_EQ(
      error("{distance_m: 2}"),
      "f.yaml:10:33 landmarks.prior.distance_m: the value is not a list; expected [NEAR, FAR] "
      "in m, or [NEAR, none]");
  EXPECT_EQ(
      error("{distance_m: [4, 1]}"),
      "f.yaml:10:37 landmarks.prior.distance_m[1]: '1' is out of range; expected a number > 4 "
      "(m)");
  EXPECT_EQ(
      error("{distance_m: [0, 1]}"),
      "f.yaml:10:34 landmarks.prior.distance_m[0]: '0' is out of range; expected a number > 0 "
      "(m)");
  EXPECT_EQ(
      error("{distance_m: [1, 4], sigma: 1}"),
      "f.yaml:10:41 landmarks.prior.sigma: the prior is also defined by `distance_m`; expected "
      "distance_m, or inverse_distance and sigma");
}

/// Returns `estimators` after the expansion.
std::string Estimators(const std::string& text) {
  Config config = Read(text);
  ExpandShortForms(config, Shipped());
  return config.root().At("estimators").ToYaml();
}

TEST(ShortForms, TheNameOfAnEstimatorIsItsType) {
  EXPECT_EQ(Estimators("estimators: [ekf, ukf]\n"), "ekf:\n  type: ekf\nukf:\n  type: ukf\n");
  EXPECT_EQ(Estimators("estimators: {ekf: {gate: 0.9}, a: {type: ukf}}\n"),
            "ekf:\n  gate: 0.9\n  type: ekf\na:\n  type: ukf\n");
}

// The batch has no gate, so the default does not apply to it.
TEST(ShortForms, DefaultsApplyToEachEstimatorWithTheKey) {
  EXPECT_EQ(Estimators("estimators: {ekf: {}, rts: {gate: 0.9}, batch: {type: ceres_batch}}\n"
                       "defaults: {gate: 0.99, rejection_recovery: {after: 7}}\n"),
            "ekf:\n  type: ekf\n  gate: 0.99\n  rejection_recovery:\n    after: 7\n"
            "rts:\n  gate: 0.9\n  type: rts\n  rejection_recovery:\n    after: 7\n"
            "batch:\n  type: ceres_batch\n");
  EXPECT_EQ(Estimators("estimators: {a: {}, b: {type: ukf}}\ndefaults: {type: ekf}\n"),
            "a:\n  type: ekf\nb:\n  type: ukf\n");
  EXPECT_EQ(Estimators("estimators: {ekf: {rejection_recovery: {action: none}}}\n"
                       "defaults: {rejection_recovery: {after: 7, action: reset}}\n"),
            "ekf:\n  rejection_recovery:\n    action: none\n    after: 7\n  type: ekf\n");
}

TEST(ShortForms, ErrorsOfDefaultsNameTheirPlace) {
  EXPECT_EQ(Message([&] { Estimators("estimators: [ekf]\ndefaults: {gat: 0.9}\n"); }),
            "f.yaml:2:12 defaults.gat: no type of estimator has this key; did you mean 'gate'?");
  Config config = Read(kSlam + "estimators: [ekf]\ndefaults: {gate: 3}\n");
  EXPECT_EQ(Message([&] { MakeFilter(config, Shipped(), "ekf"); }).substr(0, 46),
            "f.yaml:19:18 defaults.gate: '3' is out of rang");
}

TEST(ShortForms, ErrorsOfListedEstimators) {
  EXPECT_EQ(Message([] { Read("estimators: [ekf, ekf]\n"); }),
            "f.yaml:1:19 estimators[1]: 'ekf' is listed twice; expected each name only once");
  EXPECT_EQ(
      Message([] { Read("estimators: [{type: ekf}]\n"); }),
      "f.yaml:1:14 estimators[0]: the item of the list is not a name; expected a name, or a map "
      "instead of the list");
  Config config = Read(kSlam + "estimators: [efk]\n");
  try {
    MakeFilter(config, Shipped(), "efk");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kPlugin);
    const std::string text = e.what();
    EXPECT_EQ(text.find("f.yaml:18:14 estimators.efk.type: estimator type 'efk'"), 0U) << text;
    EXPECT_NE(text.find("did you mean 'ekf'?"), std::string::npos) << text;
  }
}

// A list counts as a map, so its entries can be set and merged.
TEST(ShortForms, AListOfEstimatorsCanBeSetAndMerged) {
  Config config = Read("estimators: [ekf, ukf]\n");
  config.Set("estimators.ukf.gate", "0.9", "--set");
  const Config merged = config.Merged(Read("estimators: [rts]\n").root());
  EXPECT_EQ(merged.root().At("estimators").ToYaml(), "ekf: {}\nukf:\n  gate: 0.9\nrts: {}\n");
}

// The overrides of an estimator may contain short forms, and may replace short forms.
TEST(ShortForms, OverridesAreExpanded) {
  const Config config = Read(
      kSlam +
      "estimators:\n  ekf:\n    overrides:\n      state: {cam: {initial: {position: {sigma: 2}}}}\n"
      "      landmarks: {prior: {distance_m: [2, none]}}\n");
  const auto filter = MakeFilter(config, Shipped(), "ekf");
  EXPECT_EQ(filter->problem().priors[0].covariance(0, 0), 4.0);
  EXPECT_EQ(filter->problem().landmarks->prior->inverse_distance, 0.25);
}

TEST(ShortForms, TheExperimentContainsTheExpandedConfig) {
  const Config config = Read("alidade: 1\n" + kStereo +
                             "target}\nestimators: [ekf]\nsource: {type: depth_target}\n"
                             "defaults: {gate: 0.9}\n");
  Config renamed = config.Copy();
  renamed.Set("sensors.stereo.stream", "disparity", "--set");
  const Experiment experiment = BuildExperiment(renamed, Shipped());
  const Node root = experiment.config->root();
  EXPECT_EQ(root.At("sensors").At("stereo").At("roles").At("depth").Text(), "target.depth");
  EXPECT_TRUE(root.At("sensors").At("stereo").At("roles").At("depth").is_filled());
  EXPECT_TRUE(root.At("estimators").At("ekf").At("gate").is_filled());
  EXPECT_FALSE(root.At("sensors").At("stereo").At("stream").is_filled());
  EXPECT_FALSE(root.Find("defaults").has_value());
}

}  // namespace
}  // namespace alidade
