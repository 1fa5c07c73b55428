// SPDX-License-Identifier: Apache-2.0
//
// Tests the models of tests/faults/plugins/bad_models.cc, each of which has at most one fault. The
// corresponding check must report the fault, and no other check may fail.
#include "alidade/check/check.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "host_fixture.h"
#include "support/sanitized.h"

namespace alidade {
namespace {

using Verdict = CheckResult::Verdict;

/// Returns `CHECK: TEXT` of every failure.
std::vector<std::string> Failures(const std::vector<CheckResult>& findings) {
  std::vector<std::string> failures;
  for (const CheckResult& finding : findings) {
    if (finding.verdict == Verdict::kFail) failures.push_back(finding.check + ": " + finding.text);
  }
  return failures;
}

std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + '\n';
  return text;
}

class CheckTest : public HostTest {
 protected:
  std::vector<CheckResult> Checked(const std::string& model, const CheckOptions& options = {}) {
    return CheckModel(FindModels(host_, Built("bad_models").string(), model).at(0),
                      Config::FromText("{}", model).root(), options);
  }
  PluginHost host_{{Built("bad_models")}};
};

struct Fault {
  int number;  ///< number in tests/faults/README.md; 0: the fault has no number
  const char* model;
  const char* check;
  std::vector<const char*> words;
};

std::string Name(const ::testing::TestParamInfo<Fault>& info) {
  return "Fault" + std::to_string(info.param.number) + '_' + info.param.model;
}

class OneFault : public CheckTest, public ::testing::WithParamInterface<Fault> {};

TEST_P(OneFault, IsFoundByItsCheckAlone) {
  // In a sanitizer build the sanitizer ends these processes, and the layout of the stack is
  // different.
  const std::string model = GetParam().model;
  const bool differs = model == "exits" || model == "eats_memory" || model == "unwritten";
  if (testing::kSanitized && differs) GTEST_SKIP() << "a sanitizer ends the process differently";
  CheckOptions options;
  if (model.starts_with("hangs") || model == "stops_itself") options.timeout_s = 1.0;
  options.memory_mb = 64;
  const auto findings = Checked(GetParam().model, options);
  const auto failures = Failures(findings);
  ASSERT_EQ(failures.size(), 1u) << Joined(failures);
  EXPECT_TRUE(failures[0].starts_with(std::string(GetParam().check) + ": ")) << failures[0];
  for (const char* word : GetParam().words) {
    EXPECT_NE(failures[0].find(word), std::string::npos) << word << " in: " << failures[0];
  }
}

INSTANTIATE_TEST_SUITE_P(
    Models, OneFault,
    ::testing::Values(
        Fault{58, "throws_in_create", "create", {"could not be created: the dog ate it"}},
        Fault{66, "crashes_in_create", "create", {"create crashed (signal 11"}},
        Fault{66, "wild_description", "create", {"create crashed (signal 11"}},
        Fault{58, "throws_in_noise", "calls", {"SqrtNoise at x = ", "failed: the dog ate it"}},
        Fault{58,
              "throws_in_destroy",
              "create",
              {"function destroy of model", "threw: never let go"}},
        Fault{59, "throws_int", "calls", {"Predict at", "an exception of unknown type"}},
        Fault{60, "unwritten", "outputs", {"Predict at", "z.second is not written"}},
        Fault{60, "nan_output", "outputs", {"Predict at x = 0, y = ", "z.second is nan"}},
        Fault{60, "nan_noise", "noise", {"SqrtNoise at", "(0, 0) of the noise factor is nan"}},
        Fault{60, "infinite_q", "noise", {"SqrtQ at", "dt = ", "the noise factor is -inf"}},
        Fault{61, "past_the_end", "bounds", {"Predict at", "writes outside the buffer of z"}},
        Fault{61, "writes_its_input", "bounds", {"Predict at", "writes to the input y"}},
        Fault{61, "ignores_strides", "bounds", {"writes outside the buffer of Jacobian 0"}},
        Fault{62, "wrong_jacobian", "jacobian", {"Predict: d z.second / d x is", "from numeric"}},
        Fault{63,
              "two_values",
              "same_value",
              {"all Jacobians differs from the value with no Jacobian: z = (", ", difference "}},
        Fault{64,
              "not_deterministic",
              "deterministic",
              {"Predict at", "two consecutive calls return different results"}},
        Fault{65, "hidden_state", "pure", {"Predict at", "the result depends on earlier calls"}},
        Fault{66, "crashes", "calls", {"Predict crashed (signal 11", ") at x = "}},
        Fault{66, "exits", "calls", {"Predict ended the process with exit code 0 at x = "}},
        Fault{66, "exits_at_once", "calls", {"Predict ended the process with exit code 0 at x = "}},
        Fault{67, "stops_itself", "calls", {"1 s (--timeout); it was stopped in Predict at x = "}},
        Fault{67, "hangs_in_create", "create", {"than 1 s (--timeout); it was stopped in create"}},
        Fault{67, "hangs_in_destroy", "create", {"1 s (--timeout); it was stopped in destroy"}},
        Fault{67,
              "hangs_in_noise",
              "calls",
              {"the check took longer than 1 s (--timeout); it was stopped in SqrtNoise at x = "}},
        Fault{67,
              "hangs",
              "calls",
              {"the check took longer than 1 s (--timeout); it was stopped in Predict at x = "}},
        Fault{68, "leaks", "leaks", {"Predict leaks 10", "bytes per call"}},
        Fault{68, "loses_itself", "leaks", {"create and destroy leaks", "bytes per call"}},
        Fault{68, "leaks_files", "leaks", {"Predict leaves files open"}},
        Fault{69, "rounds_upward", "environment", {"Predict changed the rounding mode"}},
        Fault{69, "sets_locale", "environment", {"Predict changed the locale from 'C'"}},
        Fault{0, "prints", "environment", {"the model prints text", "output of a run: 'hello'"}},
        Fault{
            0, "eats_memory", "calls", {"Predict at", "std::bad_alloc; the memory limit is 64 MB"}},
        Fault{0, "singular_noise", "noise", {"R is singular: the smallest eigenvalue"}},
        Fault{0, "no_noise", "noise", {"R is singular: the noise is 0 for z.second"}},
        Fault{0, "writes_and_fails", "failure", {"Predict at", "fails, but writes an output"}},
        Fault{0, "strange_status", "calls", {"returned 77, which is not a valid status"}},
        Fault{0, "nowhere_defined", "calls", {"Predict is defined at 0 of", "--states N"}},
        Fault{0,
              "wrong_inverse",
              "initialise",
              {"Initialise at", "returns x = ", "Predict returns z"}},
        Fault{0, "wrong_landmark", "initialise", {"prior = ", "returns bearing = ", ", rho = "}},
        Fault{61, "past_the_landmark", "bounds", {"Initialise at", "outside the buffer of rho"}},
        Fault{0, "two_covers", "double_cover", {"q and -q of orientation yield different results"}},
        Fault{0,
              "two_covers_of_a_part",
              "double_cover",
              {"Initialise at", "q and -q of pose yield different results"}},
        Fault{0, "ignores_dt", "step", {"a step over dt = 0 without noise changes the state"}},
        Fault{0, "euler", "step", {"parts of dt differ by", "of order 2 in dt", "--step-order N"}},
        Fault{0, "euler_overstated", "step", {"of order 2 in dt, not 3", "kStepOrder = N"}},
        Fault{0, "drifts", "step", {"a step over dt = 0 without noise changes the state"}},
        Fault{0,
              "held_undeclared",
              "noise_kind",
              {"declares continuous noise, but", "differs from the covariance over dt by 47 %",
               "NoiseKind::kDiscrete; }`"}},
        Fault{0,
              "adds_up_undeclared",
              "noise_kind",
              {"declares discrete noise, but", "differs from the covariance over dt by 50 %",
               "NoiseKind::kContinuous"}},
        Fault{0,
              "noise_of_each_step",
              "noise_kind",
              {"declares continuous noise, but", "differs from the covariance over dt by 100 %",
               "neither discrete nor continuous"}}),
    Name);

TEST_F(CheckTest, EveryModelWithAFaultIsTested) {
  std::set<std::string> tested = {"right",   "may_have_bias", "landmark",      "gravity",
                                  "turning", "held",          "euler_declared"};
  tested.insert({"unwrapped_heading", "unwrapped_bearing"});  // the check `angles` warns of them
  const auto* suite = ::testing::UnitTest::GetInstance();
  for (int i = 0; i < suite->total_test_suite_count(); ++i) {
    const auto* tests = suite->GetTestSuite(i);
    for (int k = 0; k < tests->total_test_count(); ++k) {
      const std::string name = tests->GetTestInfo(k)->name();
      const std::size_t at = name.find("/Fault");
      if (at != name.npos) tested.insert(name.substr(name.find('_', at) + 1));
    }
  }
  for (const PluginEntry& entry : FindModels(host_, Built("bad_models").string())) {
    EXPECT_TRUE(tested.contains(entry.name)) << entry.name;
  }
}

TEST_F(CheckTest, ModelsWithoutFaultPass) {
  for (const char* model : {"right", "may_have_bias", "landmark", "gravity", "turning", "held",
                            "euler_declared", "unwrapped_heading", "unwrapped_bearing"}) {
    const auto findings = Checked(model);
    EXPECT_EQ(Joined(Failures(findings)), "") << model;
    EXPECT_FALSE(AnyFailure(findings));
  }
}

TEST_F(CheckTest, NamesADestroyThatHangsAfterParametersAreRefused) {
  CheckOptions options;
  options.timeout_s = 1.0;
  const Config config = Config::FromText("{unread: 1}", "test");
  const auto findings =
      CheckModel(FindModels(host_, Built("bad_models").string(), "hangs_in_destroy").at(0),
                 config.root(), options);
  EXPECT_EQ(Joined(Failures(findings)),
            "create: the check took longer than 1 s (--timeout); it was stopped in destroy\n");
}

TEST_F(CheckTest, ADiscretisationPassesWhereItsOrderIsGiven) {
  CheckOptions options;
  options.step_order = 2;
  EXPECT_EQ(Joined(Failures(Checked("euler", options))), "");
  options.step_order = 3;
  EXPECT_TRUE(AnyFailure(Checked("euler", options)));
  EXPECT_TRUE(AnyFailure(Checked("euler_declared", options)));  // the option takes precedence
  EXPECT_TRUE(AnyFailure(Checked("ignores_dt", options)));
}

TEST_F(CheckTest, NamesTheWorstEntryOfAWrongJacobian) {
  const auto findings = Checked("wrong_jacobian");
  const auto is = [](const CheckResult& finding) { return finding.check == "jacobian"; };
  const std::string words = std::find_if(findings.begin(), findings.end(), is)->text;
  double written = 0.0, numeric = 0.0, x = 0.0, y = 0.0;
  ASSERT_EQ(std::sscanf(words.c_str(),
                        "Predict: d z.second / d x is %lf from the model, but %lf from "
                        "numeric differences; "
                        "Predict at x = %lf, y = %lf",
                        &written, &numeric, &x, &y),
            4)
      << words;
  EXPECT_NEAR(written / y, 1.001, 1e-5) << words;  // six digits are printed
  EXPECT_NEAR(numeric / y, 1.0, 1e-5) << words;
}

/// Returns the text of the check `angles`. Expects the given verdict.
std::string AnglesText(const std::vector<CheckResult>& findings, Verdict verdict) {
  const auto found = std::ranges::find(findings, "angles", &CheckResult::check);
  EXPECT_EQ(found->verdict, verdict) << found->text;
  return found->text;
}

TEST_F(CheckTest, WarnsOfAnAngleThatIsDeclaredAsAVector) {
  const auto heading = Checked("unwrapped_heading");
  EXPECT_EQ(Joined(Failures(heading)), "");
  double at = 0.0;
  const std::string text = AnglesText(heading, Verdict::kWarning);
  const std::string start =
      "z is a vector in rad, but jumps by 2 pi, so innovations near the jump are wrong by 2 pi; "
      "declare it as Angle; Predict at heading = ";
  EXPECT_EQ(text.substr(0, start.size()), start);
  ASSERT_EQ(std::sscanf(text.substr(start.size()).c_str(), "%lf", &at), 1) << text;
  EXPECT_NEAR(std::abs(at), 3.14159, 1e-4);
  EXPECT_EQ(AnglesText(Checked("unwrapped_bearing"), Verdict::kWarning).substr(0, 10),
            "z.bearing ");
  EXPECT_FALSE(AnyFailure(heading));
  AnglesText(Checked("right"), Verdict::kSkipped);
}

TEST_F(CheckTest, SkipsWhatAFailureLeavesUnsaid) {
  const auto findings = Checked("not_deterministic");
  const auto failed =
      std::find_if(findings.begin(), findings.end(),
                   [](const CheckResult& finding) { return finding.verdict == Verdict::kFail; });
  ASSERT_NE(failed, findings.end());
  for (auto later = failed + 1; later != findings.end(); ++later) {
    EXPECT_EQ(later->verdict, Verdict::kSkipped) << later->check;
    EXPECT_EQ(later->text, "'deterministic' failed");
  }
}

TEST_F(CheckTest, GivesTheSameFindingsForTheSameSeed) {
  const auto text = [&](std::uint64_t seed) {
    CheckOptions options;
    options.seed = seed;
    return Joined(Failures(Checked("wrong_jacobian", options)));
  };
  EXPECT_EQ(text(3), text(3));
  EXPECT_NE(text(3), text(4));
}

TEST_F(CheckTest, ParametersThatDoNotFitAreErrorsOfTheConfig) {
  const auto stereo = FindModels(host_, "stereo_disparity").at(0);
  const auto check = [&](const std::string& parameters) {
    const Config config = Parse(parameters);
    CheckModel(stereo, config.root());
  };
  ExpectError(ExitCode::kBadConfig, {"test.yaml:1:1 sigma_px: missing", "focal_px: missing"},
              [&] { check("{baseline_m: 0.1}"); });
  ExpectError(ExitCode::kBadConfig, {"test.yaml", "basline_m", "did you mean 'baseline_m'?"},
              [&] { check("{baseline_m: 1, focal_px: 1, sigma_px: 1, basline_m: 1}"); });
}

TEST_F(CheckTest, FindsPluginsByFileStemAndModel) {
  EXPECT_EQ(FindModels(host_, "bad_models").size(), FindModels(host_, Built("bad_models")).size());
  EXPECT_EQ(FindModels(host_, "scale_2d").at(0).name, "scale_2d");
  EXPECT_EQ(FindModels(host_, "gravity").size(), 1u);
  ExpectError(ExitCode::kPlugin,
              {"no sensor or motion model was found for 'scale_2'; did you mean 'scale_2d'?"},
              [&] { FindModels(host_, "scale_2"); });
  // The name is similar to that of a source, which is not a model.
  ExpectError(ExitCode::kPlugin, {"no sensor or motion model was found for 'depth_targe'\n"},
              [&] { FindModels(host_, "depth_targe"); });
  ExpectError(ExitCode::kPlugin, {"does not contain a model 'righ'", "did you mean 'right'?"},
              [&] { FindModels(host_, "bad_models", "righ"); });
}

/// Adds parameters of landmark sensors with every representation and every lens.
void AddLandmarkSensors(std::multimap<std::string, std::string>& parameters) {
  const std::string camera = "camera: {width: 640, height: 480, fx: 525, fy: 520, cx: 320, cy: 240";
  const std::pair<std::string, std::string> sensors[] = {
      {"inverse_depth_feature", ""},
      {"stereo_feature", ""},
      {"depth_feature", ", sigma_depth_m: 0.01, sigma_depth_quadratic_1_m: 0.003"}};
  for (const auto& [model, keys] : sensors) {
    for (const char* form : {"inverse_depth", "anchored", "xyz"}) {
      for (const char* lens : {"", ", model: radtan, k1: -0.28, k2: 0.07, p1: 0.001, p2: -0.0007",
                               ", model: equidistant, k1: -0.012, k2: 0.034",
                               ", model: photogrammetric, k1: 0.3, k2: 0.3"}) {
        const bool other_lens = *lens != '\0', other_form = *form != 'i';
        if (other_lens && (other_form || model == "stereo_feature")) continue;
        parameters.emplace(model, "{sigma_px: 1" + keys + ", landmarks: {representation: " + form +
                                      "}, " + camera + lens +
                                      (model[0] == 's' ? ", baseline_m: 0.1}}" : "}}"));
      }
    }
  }
}

// At 1e6 rad/s the camera rotates many times within a step. With these seeds, numeric differences
// over long steps agree on a mean slope.
TEST_F(CheckTest, AMotionThatTurnsManyTimesInAStepPasses) {
  const PluginEntry odometry = FindModels(host_, "odometry_pose").at(0);
  const Config config = Parse("{noise: {linear_velocity: 0.3, angular_velocity: 0.002}}");
  CheckOptions options;
  for (const std::uint64_t seed : {9, 99, 119, 124, 139}) {
    options.seed = seed;
    EXPECT_EQ(Joined(Failures(CheckModel(odometry, config.root(), options))), "") << seed;
  }
}

/// Every shipped model passes the check with each row of its parameters.
TEST_F(CheckTest, ShippedModelsPass) {
  std::multimap<std::string, std::string> parameters = {
      {"constant", "{}"},
      {"constant", "{size: 3, noise: {random_walk: 0.1}}"},
      {"constant_velocity", "{noise: {acceleration: 1, kind: discrete}}"},
      {"constant_velocity", "{dimensions: 3, noise: {acceleration: 2}}"},
      {"gauss_markov", "{time_constant_s: 5, noise: {sigma: 0.3}}"},
      {"gauss_markov", "{size: 3, time_constant_s: 0.1, noise: {sigma: 2}}"},
      {"constant_acceleration", "{noise: {jerk: 1, kind: discrete}}"},
      {"constant_acceleration", "{dimensions: 3, noise: {jerk: 2}}"},
      {"singer", "{time_constant_s: 20, noise: {acceleration: 3}}"},
      {"singer", "{dimensions: 3, time_constant_s: 0.1, noise: {acceleration: 3}}"},
      {"clock", "{noise: {bias: 0.1, drift: 0.01}}"},
      {"clock", "{unit: s, noise_model: power_law, h_0: 2.0e-19, h_minus_2: 2.0e-20}"},
      {"coordinated_turn", "{noise: {acceleration: 0.5, angular_acceleration: 0.1}}"},
      {"unicycle", "{noise: {speed: 0.1, turn_rate: 0.05}}"},
      {"unicycle", "{noise: {kind: discrete, speed: 0.1, turn_rate: 0.05}}"},
      {"differential_drive",
       "{noise: {wheel_speed: 0.1}, wheel_radius_m: 0.1, track_width_m: 0.5}"},
      {"differential_drive",
       "{noise: {kind: discrete, wheel_speed: [0.1, 0.2]}, wheel_radius_m: 0.1, "
       "track_width_m: 0.5}"},
      {"bicycle", "{noise: {speed: 0.1, steering_angle: 0.01}, wheelbase_m: 2.5}"},
      {"bicycle", "{noise: {kind: discrete, speed: 0.1, steering_angle: 0.01}, wheelbase_m: 2.5}"},
      {"planar_body_velocity",
       "{noise: {linear_acceleration: [0.5, 0.1], angular_acceleration: 0.1}}"},
      {"motion model body_velocity",
       "{noise: {linear_acceleration: 0.6, angular_acceleration: [1, 2, 3]}}"},
      {"attitude", "{noise: {gyro: 0.01}}"},
      {"inertial", "{noise: {gyro: 0.01, accelerometer: 0.1}}"},
      {"inertial",
       "{integration: euler, gravity_m_s2: [0, 9.81, 0], noise: {gyro: 0.01, accelerometer: 0.1}}"},
      {"inertial", "{integration: midpoint, noise: {gyro: 0.01, accelerometer: 0.1}}"},
      {"stereo_disparity", "{focal_px: 400, baseline_m: 0.065, sigma_px: 1}"},
      {"stereo_disparity", "{focal_px: 400, baseline_m: 0.065, sigma_px: 1, min_range_m: 0.3}"},
      {"pose", "{sigma_position_m: 0.1, sigma_orientation_rad: [0.01, 0.02, 0.03]}"},
      {"relative_pose", "{sigma_position_m: 0.1, sigma_orientation_rad: [0.01, 0.02, 0.03]}"},
      {"pseudorange", "{sigma_m: 2}"},
      {"pseudorange_rate", "{sigma_m_s: 0.1}"},
      {"direct", "{sigma: 0.1}"},
      {"zero", "{sigma: 0.1}"},
      {"position", "{sigma_m: 0.1}"},
      {"velocity", "{sigma_m_s: 0.1}"},
      {"sensor body_velocity", "{sigma_m_s: 0.1}"},
      {"sensor body_velocity", "{sigma_m_s: 0.1, axes: y}"},
      {"speed", "{sigma_m_s: 0.1}"},
      {"heading", "{sigma_rad: 0.1, declination_rad: 0.05}"},
      {"turn_rate", "{sigma_rad_s: 0.1}"},
      {"range", "{sigma_m: 0.1}"},
      {"range", "{sigma_m: 0.1, point_m: [1, 2, 3]}"},
      {"bearing", "{sigma_rad: 0.01}"},
      {"bearing", "{sigma_rad: 0.01, measures: angles, point_m: [1, 2, 3]}"},
      {"bearing_landmark", "{sigma_rad: 0.01}"},
      {"tdoa", "{sigma_m: 0.1}"},
      {"radar", "{sigma_range_m: 10, sigma_azimuth_rad: 0.01, sigma_elevation_rad: 0.01}"},
      {"radar", "{sigma_range_m: 10, sigma_range_rate_m_s: 0.3}"},
      {"specific_force", "{sigma_m_s2: 0.1}"},
      {"magnetometer", "{field_ut: [20, 0, -44], sigma_ut: 1}"},
      {"altitude", "{sigma_m: 0.3}"},
      {"altitude", "{measures: pressure, sigma_pa: 4}"},
      {"known_pixel",
       "{sigma_px: 1, camera: {width: 640, height: 480, fx: 525, fy: 520, cx: 320, cy: 240}}"},
      {"range_bearing",
       "{sigma_range_m: 0.1, sigma_bearing_rad: 0.01, landmarks: {representation: inverse_depth}}"},
      {"range_bearing",
       "{sigma_range_m: 0.1, sigma_bearing_rad: 0.01, landmarks: {representation: anchored}}"},
      {"range_bearing",
       "{sigma_range_m: 0.1, sigma_bearing_rad: 0.01, landmarks: {representation: xyz}}"},
      {"scale_2d", "{template_px: 300, sigma_px: 1}"},
      {"scale_2d", "{noise_model: constant, sigma_inverse_scale: 0.1}"},
      {"quaternion_pose", "{noise: {linear_acceleration: 0.6, angular_acceleration: [1, 2, 3]}}"},
      {"quaternion_pose",
       "{noise: {kind: discrete, linear_acceleration: 0.6, angular_acceleration: [1, 2, 3]}}"},
      {"odometry_pose",
       "{noise: {kind: discrete, linear_velocity: 0.3, angular_velocity: 0.002}, "
       "vehicle_from_cam: {position: [1, 0, 1.5]}}"},
      {"odometry_pose",
       "{noise: {linear_velocity: [0.03, 0.3, 0.3], angular_velocity: 0.002}, vehicle_from_cam: "
       "{position: [1, 0, 1.5], orientation: {w: 0.5, x: -0.5, y: 0.5, z: -0.5}}}"},
  };
  for (const char* lens : {"radial", "radtan", "opencv"}) {
    parameters.emplace("self_calibrating_feature",
                       std::string("{sigma_px: 1, lens: ") + lens + "}");
  }
  parameters.emplace("self_calibrating_feature", "{sigma_px: 1, domain: projective}");
  AddLandmarkSensors(parameters);
  const std::filesystem::path shipped = ALIDADE_BINARY_DIR "/lib/alidade/plugins";
  int checked = 0;
  for (const PluginEntry& entry : host_.entries()) {
    if (!entry.is_model() || entry.plugin.parent_path() != std::filesystem::canonical(shipped))
      continue;
    // A motion model and a sensor may have the same name.
    const std::string name =
        parameters.contains(entry.name) ? entry.name : entry.kind + ' ' + entry.name;
    const auto [first, last] = parameters.equal_range(name);
    EXPECT_NE(first, last) << "this test has no parameters for " << name;
    for (auto row = first; row != last; ++row, ++checked) {
      const Config config = Parse(row->second);
      EXPECT_EQ(Joined(Failures(CheckModel(entry, config.root()))), "")
          << entry.name << ' ' << row->second;
    }
  }
  EXPECT_GE(checked, 25);
}

}  // namespace
}  // namespace alidade
