// SPDX-License-Identifier: Apache-2.0
//
// Tests configs with one fault each. A config is a base config of tests/faults/configs with one or
// two changed lines. Each row contains the expected exit code, and the line and words of the
// expected message.
#include <gtest/gtest.h>

#include "support/program.h"

namespace alidade::testing {
namespace {

using namespace std::string_literals;  // NOLINT(google-build-using-namespace): for text with NUL

const fs::path kBases = fs::path(ALIDADE_SOURCE_DIR) / "tests/faults/configs";

/// Replaces `from` by `to`. The text `from` must occur exactly once in the base config.
struct Change {
  std::string from, to;
};

/// Returns a change that inserts `lines` after the line that ends with `text`.
Change After(const std::string& text, const std::string& lines) {
  return {text, text + '\n' + lines};
}

struct Fault {
  std::string name;  ///< begins with the fault number of README.md, if the fault has one
  std::string base;  ///< name of the base config; empty: an empty config
  std::vector<Change> changes;
  int line = 0;  ///< line that the message names; 0: the message names only the file
  std::string words;
  int code = 78;
};

Fault MakeFault(std::string name, std::string base, std::vector<Change> changes, int line,
                std::string words, int code = 78) {
  return {std::move(name), std::move(base), std::move(changes), line, std::move(words), code};
}

void PrintTo(const Fault& fault, std::ostream* stream) { *stream << fault.name; }

// Texts in the base configs that several faults change.
const std::string kEkf = "{type: ekf}", kDepthSource = "{type: depth_target, seed: 1}",
                  kStereoRoles = "{depth: target.depth}", kStereoSigma = "    sigma_px: 1.0",
                  kTemplateBlock = "template.inverse_distance",
                  kTemplateBlocks = "{value: inverse_distance}",
                  kPrior = "prior: {inverse_distance: 0.5, sigma: 0.25}";
/// Returns a source that reads a table, as a replacement for the simulated target.
std::string Rows(const std::string& keys) {
  return "{type: tables, path: rows.csv, streams: {disparity: d, inverse_scale: s}, " + keys + "}";
}
/// Returns a source that reads the same table as one of a list of files.
std::string InFiles(const std::string& keys) {
  return "{type: tables, files: [{path: rows.csv, streams: {disparity: d, inverse_scale: s}, " +
         keys + "}]}";
}

/// Returns a change that adds a sensor with equations. Its first line is line 22, and the first of
/// `lines` is line 24.
Change WithFormula(const std::string& lines) {
  return After(kStereoSigma,
               "  offset:\n    model: formula\n" + lines +
                   "    stream: disparity\n    roles: {depth: target.depth}\n    sigma: {d: 1}");
}

const Fault kTextFaults[] = {
    MakeFault("01_duplicate_key", "depth", {After("focal_px: 400", "    focal_px: 401")}, 20,
              "focal_px: duplicate key; the first one is at line 19"),
    MakeFault("04_trailing_text", "depth", {{"400", "3.8x"}}, 19, "'3.8x'"),
    MakeFault("05_not_a_number", "depth", {{"400", ".nan"}}, 19, "finite"),
    MakeFault("06_underflow", "depth", {{"sigma_px: 1.0", "sigma_px: 1e-400"}}, 21, "1e-400"),
    MakeFault("07_leading_zeros", "depth", {{"400", "0400"}}, 19, "leading zero"),
    MakeFault("08_yes_for_a_flag", "depth",
              {{kDepthSource,
                "{type: tables, path: rows.csv,\n  streams: {disparity: d,\n    inverse_scale: "
                "{columns: [s], reciprocal: yes}}}"}},
              30, "true or false"),
    MakeFault("12_alias_bomb", "depth",
              {After("alidade: 1",
                     "a: &a [0, 0, 0, 0, 0, 0, 0, 0, 0]\n"
                     "b: &b [*a, *a, *a, *a, *a, *a, *a, *a, *a]\n"
                     "c: &c [*b, *b, *b, *b, *b, *b, *b, *b, *b]\n"
                     "d: &d [*c, *c, *c, *c, *c, *c, *c, *c, *c]\n"
                     "e: &e [*d, *d, *d, *d, *d, *d, *d, *d, *d]\n"
                     "f: &f [*e, *e, *e, *e, *e, *e, *e, *e, *e]")},
              7, "100000"),
    MakeFault("13_self_reference", "depth", {After("alidade: 1", "title: &x [*x]")}, 2,
              "refers to itself"),
    MakeFault("14_nesting", "depth",
              {After("alidade: 1", "title: " + std::string(80, '[') + std::string(80, ']'))}, 2,
              "64"),
    MakeFault("16_tab", "depth", {{"    focal_px", "\tfocal_px"}}, 19, "tab"),
    MakeFault("17_invalid_utf8", "depth", {After("alidade: 1", "title: caf\xE9")}, 2,
              "invalid UTF-8; expected UTF-8 text"),
    MakeFault("17_nul", "depth", {After("alidade: 1", "title: a\0b"s)}, 2,
              "the text contains a NUL byte"),
    MakeFault("19_merge_key", "depth", {{"focal_px: 400", "<<: {focal_px: 400}"}}, 19, "<<"),
    MakeFault("20_second_document", "depth", {After(kDepthSource, "---")}, 29, "document"),
    MakeFault("21_empty", "", {}, 0, "empty"),
    MakeFault("23_include_outside", "depth", {After("alidade: 1", "include: ../base.yaml")}, 2,
              "..", 77),
    MakeFault(
        "24_shell_text", "depth",
        {{kDepthSource,
          "{type: tables, path: \"$(touch hacked)\", streams: {disparity: d, inverse_scale: s}}"}},
        28, "$(touch hacked)", 66),
    MakeFault("26_newer_schema", "depth", {{"alidade: 1", "alidade: 2"}}, 1, "newer"),
};

const Fault kKeyFaults[] = {
    MakeFault("02_output_is_a_map", "depth", {{"alidade", "output: {a: b}\nalidade"}}, 1,
              "output: "),
    MakeFault("02_override_of_no_entry", "depth",
              {{kEkf, "{type: ekf,\n    overrides: {sensors: {stero: {sigma_px: 2}}}}"}}, 31,
              "estimators.ekf.overrides.sensors.stero: 'sensors' has no entry 'stero' to override; "
              "expected one of stereo, scale, or a new entry with a model; did you mean 'stereo'?"),
    MakeFault("02_title_is_a_list", "depth", {{"alidade", "title: [a, b]\nalidade"}}, 1, "title: "),
    MakeFault("02_truth_of_no_block", "depth",
              {{kDepthSource, Rows("truth: {depth_rate: s,\n  detph: d}")}}, 29,
              "source.truth.detph: the truth does not match a block: no block has this name; "
              "expected the name "
              "and size of one block, as in ENTRY.BLOCK; did you mean 'depth'?"),
    MakeFault("02_truth_of_no_block_in_a_file", "depth",
              {{kDepthSource, InFiles("truth: {depth_rate: s,\n  detph: d}")}}, 29,
              "source.files[0].truth.detph: the truth does not match a block: no block has this "
              "name; expected the name and size of one block, as in ENTRY.BLOCK; did you mean "
              "'depth'?"),
    MakeFault("02_truth_sigma_of_no_truth", "depth",
              {After(kEkf, "evaluate: {truth_sigma: {dept: 0.01}}")}, 31,
              "evaluate.truth_sigma.dept: the source has no truth 'dept'; expected a truth of the "
              "source: depth, depth_rate, inverse_distance; did you mean 'depth'?"),
    MakeFault("02_unknown_key_at_the_root", "depth", {{"source:", "estimator: {}\nsource:"}}, 28,
              "estimators"),
    MakeFault("02_unknown_key_of_a_model", "depth", {After(kStereoSigma, "    focal_pix: 3")}, 22,
              "did you mean 'focal_px'"),
    MakeFault("02_unknown_key_of_a_nested_map", "depth",
              {{"acceleration: 1.0", "acceleration: 1.0, acelleration: 2.0"}}, 6,
              "state.target.noise.acelleration: unknown key"),
    MakeFault("02_unknown_loss", "depth", {After(kStereoSigma, "    loss: {hubert: 1.345}")}, 22,
              "did you mean 'huber'"),
    MakeFault("03_initial_is_a_number", "depth", {{"{mean: 3.3, sigma: 0.5}", "3.3"}}, 13,
              "state.template.initial.inverse_distance: '3.3'; expected a map, as in {mean: 0, "
              "sigma: 0.1}"),
    MakeFault("03_initial_missing", "depth",
              {{"    initial: {inverse_distance: {mean: 3.3, sigma: 0.5}}\n", ""}}, 10,
              "state.template.initial: missing key, needed by the state entry 'template'; expected "
              "initial: {inverse_distance: {mean: 0, sigma: 0.1}}"),
    MakeFault("03_initial_sigma_missing", "depth", {{"mean: 3.3, sigma: 0.5", "mean: 3.3"}}, 13,
              "the uncertainty of the initial value is missing; expected sigma, a standard "
              "deviation, or covariance, a matrix"),
    MakeFault("03_initial_variance", "depth",
              {{"mean: 3.3, sigma: 0.5", "mean: 3.3, variance: 0.25"}}, 13,
              "inverse_distance.variance: unknown key; did you mean 'covariance'?"),
    MakeFault("03_initial_covariance_is_a_number", "depth",
              {{"mean: 3.3, sigma: 0.5", "mean: 3.3, covariance: 0.25"}}, 13,
              "not a list of rows; expected a list of one row of one number, as in [[0.01]]"),
    MakeFault(
        "03_estimators_are_a_list", "depth", {{"  ekf: {type: ekf}", "  - {type: ekf}"}}, 30,
        "estimators[0]: the item of the list is not a name; expected a name, or a map instead "
        "of the list"),
    MakeFault("03_estimator_is_a_name", "depth", {{kEkf, "ekf"}}, 30,
              "estimators.ekf: 'ekf'; expected a map, as in {type: ekf}"),
    MakeFault("03_missing_key_with_a_longer_one", "depth", {{"focal_px", "focal_length_px"}}, 15,
              "sensors.stereo.focal_px: missing; model 'stereo_disparity' needs it (px, > 0: "
              "rectified focal length); found 'focal_length_px' at line 19; did you mean "
              "'focal_px'?"),
    MakeFault("03_quaternion_is_a_word", "pose", {{"{w: 1, x: 0, y: 0, z: 0}", "identity"}}, 9,
              "orientation.mean: 'identity'; expected a map, as in {w: 1, x: 0, y: 0, z: 0}, with "
              "rpy_deg: [ROLL, PITCH, YAW] in place of a quaternion, or a list"),
    MakeFault("03_version_missing", "depth", {{"alidade: 1\n", ""}}, 1,
              "alidade: missing key, needed by every config, because it is the version of the "
              "schema; expected the first line `alidade: 1`"),
    MakeFault("04_unit_of_an_angle", "pose",
              {{"angular_velocity: {mean: [0, 0, 0], sigma: 0.1}",
                "angular_velocity: {mean: [0, 0, 0], sigma: 3deg/s}"}},
              11,
              "angular_velocity.sigma: '3deg/s' contains a unit; expected a number or a list of "
              "numbers (rad/s), without a unit: 0.0523598776"),
    MakeFault("04_unit_of_an_orientation", "pose", {{"z: 0}, sigma: 0}", "z: 0}, sigma: 3deg}"}}, 9,
              "(rad), without a unit: 0.0523598776"),
    MakeFault("04_unit_of_a_parameter", "depth", {{"baseline_m: 0.065", "baseline_m: 65mm"}}, 20,
              "sensors.stereo.baseline_m: '65mm' contains a unit; expected a number > 0 (m), "
              "without a unit: 0.065"),
    MakeFault("04_no_number_in_px", "depth", {{"400", "wide"}}, 19,
              "'wide' is not a finite number; expected a number > 0 (px)"),
    MakeFault(
        "10_gate_in_percent", "depth", {{kEkf, "{type: ekf, gate: 99.9}"}}, 30,
        "gate: '99.9' is out of range: 99.9 % is 0.999; expected a number in (0, 1), or none"),
    MakeFault("03_missing_key", "depth", {{"    focal_px: 400\n", ""}}, 15, "stereo_disparity"),
    MakeFault(
        "03_missing_nested_key_with_a_like_one", "depth", {{"noise", "niose"}}, 3,
        "state.target.noise.acceleration: missing; model 'constant_velocity' needs it (m/s^1.5, >= "
        "0: root of the spectral density of the acceleration); found 'niose' at line 6"),
    MakeFault("09_wrong_unit", "depth", {{"baseline_m: 0.065", "baseline_mm: 65"}}, 20,
              "baseline_m"),
    MakeFault("10_loss_scale_zero", "depth", {After(kStereoSigma, "    loss: {huber: 0}")}, 22,
              "sensors.stereo.loss.huber: '0' is out of range; expected a number > 0"),
    MakeFault("10_negative_sigma", "depth", {{"sigma_px: 1.0", "sigma_px: -1"}}, 21, "> 0"),
    MakeFault("10_out_of_range_in_overrides", "depth",
              {{kEkf, "{type: ekf,\n    overrides: {sensors: {stereo: {sigma_px: -1}}}}"}}, 31,
              "estimators.ekf.overrides.sensors.stereo.sigma_px: '-1' is out of range"),
    MakeFault("10_two_losses", "depth", {After(kStereoSigma, "    loss: {huber: 1, cauchy: 2}")},
              22, "one of {huber: SCALE}, {cauchy: SCALE}"),
    MakeFault("11_wrong_length", "depth", {{"mean: 0.3", "mean: [0.3, 1]"}}, 8, "1"),
    MakeFault("36_rollback_without_a_window", "depth",
              {After(kEkf, "out_of_sequence: {policy: rollback}")}, 31,
              "out_of_sequence.policy: 'policy: rollback' needs the key 'window_s'"),
    MakeFault("50_missing_motion_model", "depth",
              {{"model: constant_velocity", "model: hovercraft"}}, 4,
              "no plugin offers the motion model 'hovercraft'; expected one of attitude, bicycle, "
              "body_velocity, clock, constant, ",
              69),
    MakeFault("50_missing_source", "depth", {{kDepthSource, "{type: rosbag}"}}, 28,
              "no plugin offers the source 'rosbag'; expected one of depth_target, ", 69),
    MakeFault("50_missing_estimator_in_upper_case", "depth", {{kEkf, "{type: UKF}"}}, 30,
              "did you mean 'ukf'?\n", 69),
    MakeFault("50_missing_plugin", "depth", {{"stereo_disparity", "stereo_disparty"}}, 16,
              "stereo_disparity", 69),
    MakeFault("74_covariance_not_psd", "depth",
              {{"mean: 3.3, sigma: 0.5", "mean: 3.3, covariance: [[-1]]"}}, 13, "-1"),
};

const Fault kBlockFaults[] = {
    MakeFault(
        "25_constant_and_consider", "depth",
        {{"    noise:", "    consider: [depth_rate]\n    constant: [depth_rate]\n    noise:"}}, 7,
        "constant: block 'depth_rate' is also in `consider`; expected the block in only "
        "one of `constant` (exact) and `consider` (uncertain)"),
    MakeFault("25_cyclic_start", "depth",
              {{"{mean: 0.3, sigma: 0.1}", "{from_measurement: a_by_b}"},
               {"{mean: 3.3, sigma: 0.5}", "{from_measurement: b_by_a}"},
               {"source:",
                "  a_by_b: {model: ratio, stream: disparity, roles: {numerator: target.depth, "
                "denominator: template.inverse_distance}}\n"
                "  b_by_a: {model: ratio, stream: disparity, roles: {denominator: target.depth, "
                "numerator: template.inverse_distance}}\n"
                "source:"}},
              8, "cyclic"),
    MakeFault("25_name_of_a_block", "depth", {{"position: depth", "position: \"depth,m\""}}, 5,
              "state.target.blocks.position: 'depth,m' is not a valid name for a block; expected "
              "letters, digits, _ and -"),
    MakeFault("03_initial_of_an_owned_state_missing", "depth",
              {WithFormula("    owns:\n      bias: number\n    z: {d: depth + bias}\n")}, 25,
              "sensors.offset.owns.bias: the state has no initial value; expected initial: {bias: "
              "{mean: 0, sigma: 0.1}}, or constant: [bias], which is exactly 0\n"),
    MakeFault(
        "03_key_that_resembles_another_key", "depth",
        {{"  template:\n",
          "  car:\n    model: coordinated_turn\n    noise: {acceleration: 1}\n  template:\n"}},
        12,
        "state.car.noise.angular_acceleration: missing; model 'coordinated_turn' needs it "
        "(rad/s^1.5, >= 0: root of the spectral density of the angular acceleration)\n"),
    MakeFault(
        "03_angle_in_degrees", "depth",
        {{"  template:\n",
          "  car:\n    model: coordinated_turn\n    noise: {acceleration: 1, angular_acceleration: "
          "1}\n    initial: {position: {sigma: 1}, heading: {mean: 90, sigma: 1}}\n  template:\n"}},
        13,
        "state.car.initial.heading.mean: 90 rad is more than a revolution; expected a number in "
        "rad, "
        "or a number with a unit, as in 90deg\n"),
    MakeFault(
        "03_sigma_is_a_list_of_another_size", "depth",
        {After(kTemplateBlocks, "    size: 2"),
         {"{mean: 3.3, sigma: 0.5}", "{mean: [3, 1],\n  sigma: [0.5]}"}},
        15,
        "state.template.initial.inverse_distance.sigma: the list has 1 element; expected 2, or one "
        "number for all elements"),
    MakeFault("25_name_of_a_block_with_a_line_end", "depth",
              {{"velocity: depth_rate", R"(velocity: "depth\nrate")"}}, 5,
              R"('depth\nrate' is not a valid name for a block)"),
    MakeFault("25_name_of_a_segment", "depth",
              {After(kEkf, "evaluate: {segments: {\"a@b\": {with: stereo}}}")}, 31,
              "evaluate.segments.a@b: 'a@b' is not a valid name for a segment"),
    MakeFault("25_name_of_a_sensor", "depth", {{"  stereo:", "  \"stereo:left\":"}}, 16,
              "sensors.stereo:left: 'stereo:left' is not a valid name for a sensor"),
    MakeFault("25_name_of_a_state_entry", "depth", {{"  target:", "  the target:"}}, 4,
              "state.the target: 'the target' is not a valid name for a state entry"),
    MakeFault("25_one_block_in_two_roles", "depth",
              {{"{depth: target.depth, ", "{depth: template.inverse_distance, "}}, 25,
              "another role"),
    MakeFault("25_one_name_for_two_blocks", "depth", {{"velocity: depth_rate", "velocity: depth"}},
              5, "depth"),
    MakeFault("25_truth_given_twice", "depth",
              {{kDepthSource, Rows("truth: {target.depth: d,\n  depth: d}")}}, 29,
              "source.truth.depth: the truth does not match a block: target.depth already has "
              "a truth with its full name"),
    MakeFault("25_truth_of_two_blocks", "depth",
              {{kTemplateBlocks, "{value: depth}"},
               {"{inverse_distance: {mean", "{depth: {mean"},
               {kTemplateBlock, "template.depth"},
               {kDepthSource, Rows("truth: {depth_rate: s,\n  depth: d}")}},
              29,
              "source.truth.depth: the truth does not match a block: the name could mean "
              "target.depth or template.depth"),
    MakeFault("44_role_of_an_unknown_name", "depth", {{kStereoRoles, "{range: target.depth}"}}, 18,
              "sensors.stereo.roles.range: unknown key; expected depth"),
    MakeFault("44_role_missing", "depth", {{kStereoRoles, "{}"}}, 18,
              "sensors.stereo.roles.depth: missing key, needed by model 'stereo_disparity'; "
              "expected one of target.depth, template.inverse_distance"),
    MakeFault("44_role_without_its_entry", "depth", {{kStereoRoles, "{depth: depth}"}}, 18,
              "sensors.stereo.roles.depth: block 'depth' does not exist; expected one of "
              "target.depth, template.inverse_distance; did you mean 'target.depth'?"),
    MakeFault("44_role_of_no_block", "depth", {{kTemplateBlock, "template.lambda"}}, 25,
              "block 'template.lambda' does not exist; expected template.inverse_distance"),
    MakeFault("44_unit_of_a_role", "depth", {{kStereoRoles, "{depth: target.depth_rate}"}}, 18,
              "sensors.stereo.roles.depth: block 'target.depth_rate' has the unit m/s; expected m "
              "for role 'depth' of model 'stereo_disparity'"),
    MakeFault("44_geometry_of_a_role", "depth",
              {After(kTemplateBlocks, "    size: 2"), {"mean: 3.3", "mean: [3.3, 1]"}}, 26,
              "block 'template.inverse_distance' has geometry vector(2); expected vector(1) for "
              "role 'inverse_distance' of model 'scale_2d'"),
    MakeFault("44_unit_of_a_formula_is_unknown", "depth",
              {WithFormula("    units: {d: mps}\n    z: {d: depth}\n")}, 24,
              "sensors.offset.units.d: 'mps' is not a unit; expected an SI unit such as m, rad, "),
    MakeFault("44_unit_of_a_formula_is_not_si", "depth",
              {WithFormula("    units: {d: km/h}\n    z: {d: depth}\n")}, 24,
              "sensors.offset.units.d: 'km/h' is not an SI unit; expected an SI unit such as m, "),
    MakeFault(
        "44_unit_of_a_stream", "depth",
        {{kDepthSource,
          "{type: tables, path: rows.csv,\n  streams: {inverse_scale: s, disparity: {columns: "
          "d,\n    unit: deg}}}"}},
        30,
        "source.streams.disparity.unit: 'deg' cannot be converted to px, the unit of sensor "
        "'stereo'; expected a unit of the same dimension, or a gain that converts"),
    MakeFault(
        "44_unit_of_a_control_input", "depth",
        {{"  template:\n",
          "  vehicle:\n    model: formula\n    blocks: {p: number}\n"
          "    inputs: {v: number}\n    input: {stream: speed}\n"
          "    units: {p: m, v: m/s}\n    rate: {p: v}\n    noise: {}\n"
          "    initial: {p: {mean: 0, sigma: 1}}\n  template:\n"},
         {kDepthSource,
          "{type: tables, path: rows.csv, streams: {inverse_scale: s, disparity: d,\n    "
          "speed: {columns: d, unit: deg}}}"}},
        38,
        "source.streams.speed.unit: 'deg' cannot be converted to m/s, the unit of the control "
        "input of 'vehicle'"),
    MakeFault("44_truth_of_another_size", "depth",
              {{kDepthSource, Rows("truth: {depth_rate: s,\n  target.depth: [d, s]}")}}, 29,
              "source.truth.target.depth: the truth does not match a block: target.depth has size "
              "1, but the truth has size 2"),
    MakeFault("44_truth_of_another_size_in_a_file", "depth",
              {{kDepthSource, InFiles("truth: {depth_rate: s,\n  target.depth: [d, s]}")}}, 29,
              "source.files[0].truth.target.depth: the truth does not match a block: target.depth "
              "has size 1, but the truth has size 2"),
};

const Fault kEstimatorFaults[] = {
    MakeFault("02_iterations_of_an_ekf", "depth", {{kEkf, "{type: ekf, max_iterations: 5}"}}, 30,
              "unknown key"),
    MakeFault("02_reference_of_no_estimator", "depth",
              {After(kEkf, "  batch: {type: rts}\nreference: btach")}, 32,
              "reference: estimator 'btach' does not exist; expected truth, or an estimator: ekf, "
              "batch; did you mean 'batch'?"),
    MakeFault("02_unknown_key_of_an_estimator", "depth", {{kEkf, "{type: ekf, gaet: 1}"}}, 30,
              "did you mean 'gate'"),
    MakeFault(
        "02_use_of_no_choice", "depth", {After(kEkf, "  other: {type: ekf, use: some}")}, 31,
        "estimators.other.use: 'some' is not a valid choice of measurements; expected all, or "
        "{accepted_by: NAME}"),
    MakeFault("02_use_of_no_estimator", "depth",
              {After(kEkf, "  other: {type: ekf, use: {accepted_by: efk}}")}, 31,
              "estimators.other.use.accepted_by: estimator 'efk' does not exist; expected a name "
              "from `estimators`; did you mean 'ekf'?"),
    MakeFault("10_gate_one", "depth", {{kEkf, "{type: ekf, gate: 1, fuse: joint}"}}, 30,
              "estimators.ekf.gate: '1' is out of range; expected a number in (0, 1), or none"),
    MakeFault("10_gate_zero", "depth", {{kEkf, "{type: ekf, gate: 0, fuse: joint}"}}, 30,
              "expected a number in (0, 1), or none"),
    MakeFault("10_max_dt_zero", "depth", {{kEkf, "{type: ekf, max_dt_s: 0}"}}, 30, "max_dt_s"),
    MakeFault("10_one_iteration", "depth", {{kEkf, "{type: iekf, max_iterations: 1}"}}, 30,
              "max_iterations: '1' is out of range; expected an integer in [2, 1000]"),
    MakeFault(
        "25_use_of_a_smoother", "depth",
        {{"ekf: {type: ekf}",
          "smoother: {type: rts}\n  ekf: {type: ekf, use: {accepted_by: smoother}}"}},
        31,
        "estimators.ekf.use.accepted_by: 'smoother' has estimates only at the end of the run; "
        "expected a filter"),
    MakeFault("25_use_of_itself", "depth", {{kEkf, "{type: ekf, use: {accepted_by: ekf}}"}}, 30,
              "estimators.ekf.use.accepted_by: 'ekf' is this estimator itself; expected another "
              "estimator"),
    MakeFault("25_use_of_one_listed_after", "depth",
              {After("estimators:", "  first: {type: ekf, use: {accepted_by: ekf}}")}, 30,
              "estimators.first.use.accepted_by: 'ekf' is listed after 'first'; expected an "
              "earlier estimator, which processes each frame before 'first'"),
    MakeFault(
        "25_use_without_the_sensor", "depth",
        {{"ekf: {type: ekf}",
          "alone: {type: ekf, sensors: [stereo]}\n  ekf: {type: ekf, use: {accepted_by: alone}}"}},
        31,
        "estimators.ekf.use.accepted_by: 'alone' does not use sensor 'scale' on stream "
        "'inverse_scale'; expected an estimator with the same sensors"),
    MakeFault("invariant_error_of_no_block", "depth",
              {{kEkf, "{type: ekf, invariant_error: {side: left, blocks: [target.dept]}}"}}, 30,
              "estimators.ekf.invariant_error.blocks[0]: block 'target.dept' does not exist; "
              "expected one of target.depth, target.depth_rate, template.inverse_distance; did you "
              "mean 'target.depth'?"),
    MakeFault("invariant_error_of_no_group", "depth",
              {{kEkf, "{type: ekf, invariant_error: {side: left, blocks: [target.depth]}}"}}, 30,
              "estimators.ekf.invariant_error.blocks: blocks with the geometries vector(1) do not "
              "form a group; the blocks must be, in this order, a position in the plane and a "
              "heading; or a position and an orientation; or a position, an orientation and a "
              "velocity"),
    MakeFault("invariant_error_of_no_side", "depth",
              {{kEkf, "{type: ekf, invariant_error: {side: both, blocks: [target.depth]}}"}}, 30,
              "estimators.ekf.invariant_error.side: 'both'"),
    MakeFault("invariant_error_with_landmarks", "pose",
              {{kEkf,
                "{type: ekf, invariant_error: {side: right, blocks: [cam.position, "
                "cam.orientation]}}"}},
              26,
              "estimators.ekf.invariant_error.blocks: the state has landmarks, which the group "
              "would have to contain; expected"),
    MakeFault("key_of_another_estimator", "depth", {{kEkf, "{type: rts, alpha: 0.1}"}}, 30,
              "estimators.ekf.alpha: unknown key; expected one of expect, fuse, gate, "
              "invariant_error, max_covariance_repairs, max_dt_s, on_divergence, "
              "on_plugin_failure, overrides, rejection_recovery, sensors, type, use"),
    MakeFault("unsupported_consider_block", "depth",
              {After(kTemplateBlocks, "    consider: [inverse_distance]"), {kEkf, "{type: rts}"}},
              13,
              "state.template.consider[0]: estimator type 'rts' does not support consider blocks"),
    MakeFault("unsupported_consider_block_of_an_iekf", "depth",
              {After(kTemplateBlocks, "    consider: [inverse_distance]"), {kEkf, "{type: iekf}"}},
              13, "estimator type 'iekf' does not support consider blocks"),
    MakeFault("unsupported_consider_role", "depth",
              {{kTemplateBlock, "{block: template.inverse_distance, mode: consider}"},
               {kEkf, "{type: ukf}"}},
              25,
              "sensors.scale.roles.inverse_distance.mode: estimator type 'ukf' does not support "
              "consider roles"),
    MakeFault("unsupported_consider_role_of_an_iekf", "depth",
              {{kTemplateBlock, "{block: template.inverse_distance, mode: consider}"},
               {kEkf, "{type: iekf}"}},
              25, "estimator type 'iekf' does not support consider roles"),
    MakeFault("unsupported_first_estimate", "depth",
              {{kEkf, "{type: iekf, jacobian: first_estimate}"}}, 30,
              "estimator type 'iekf' has no option for the Jacobian"),
    MakeFault("unsupported_jacobian_at", "depth",
              {{kStereoRoles, "{depth: {block: target.depth, jacobian_at: measurement}}"},
               {kEkf, "{type: square_root_ekf}"}},
              18,
              "sensors.stereo.roles.depth.jacobian_at: estimator type 'square_root_ekf' does not "
              "support jacobian_at: measurement"),
    MakeFault("unsupported_jacobian_at_of_an_iekf", "depth",
              {{kStereoRoles, "{depth: {block: target.depth, jacobian_at: measurement}}"},
               {kEkf, "{type: iekf}"}},
              18, "estimator type 'iekf' does not support jacobian_at: measurement"),
    MakeFault("unsupported_landmarks_rts", "landmarks", {{kEkf, "{type: rts}"}}, 10,
              "estimator type 'rts' does not support landmarks"),
    MakeFault("unsupported_landmarks_square_root_ekf", "landmarks",
              {{kEkf, "{type: square_root_ekf}"}}, 10,
              "estimator type 'square_root_ekf' does not support landmarks"),
    MakeFault("unsupported_landmarks_ukf", "landmarks", {{kEkf, "{type: ukf}"}}, 10,
              "estimator type 'ukf' does not support landmarks"),
    MakeFault("unsupported_start_from_a_measurement", "depth",
              {{"{mean: 0.3, sigma: 0.1}", "{from_measurement: stereo}"}, {kEkf, "{type: rts}"}}, 8,
              "state.target.initial.depth.from_measurement: estimator type 'rts' does not support "
              "blocks that start from a measurement"),
};

const Fault kLandmarkFaults[] = {
    MakeFault("camera_key_missing", "landmarks", {{"focal_px", "focal"}}, 2, "camera.focal_px"),
    MakeFault("landmarks_attempts_without_a_ratio", "landmarks",
              {After(kPrior, "  prune: {min_attempts: 30}")}, 11,
              "landmarks.prune.min_attempts: this key has no effect without"),
    MakeFault("landmarks_known_position_of_two", "landmarks",
              {After(kPrior, "  known:\n    - {id: 3, position: [0, 1], sigma: 0}")}, 12,
              "landmarks.known[0].position"),
    MakeFault("landmarks_known_twice", "landmarks",
              {After(kPrior,
                     "  known:\n    - {id: 3, position: [0, 0, 1], sigma: 0}\n    - {id: 3, "
                     "position: [0, 1, 1], sigma: 0}")},
              13, "landmarks.known[1].id: landmark 3 is listed twice"),
    MakeFault("landmarks_max_per_frame_unknown", "landmarks",
              {After(kPrior, "  max_per_frame: all")}, 11,
              "landmarks.max_per_frame: 'all' is not a finite number; expected an integer in [1, "
              "1000000], or none"),
    MakeFault("landmarks_missing", "landmarks", {{"landmarks:\n  " + kPrior + '\n', ""}}, 0,
              "landmarks: missing key"),
    MakeFault("landmarks_name_of_a_state_entry", "landmarks",
              {{"  cam:", "  landmarks:"}, {"cam.position", "landmarks.position"}}, 5,
              "'landmarks' cannot name a state entry"),
    MakeFault("landmarks_negative_sigma", "landmarks", {{"0.25", "-0.25"}}, 10,
              "landmarks.prior.sigma"),
    MakeFault("landmarks_outlier_rejection_unknown", "landmarks",
              {After("sigma_px: 1.0", "    outlier_rejection: {method: two_point_ransac}")}, 17,
              "sensors.pixels.outlier_rejection.method"),
    MakeFault("landmarks_prior_missing", "landmarks", {{kPrior, "max_per_frame: 30"}}, 10,
              "landmarks: a prior is missing: model 'pixels' of sensor 'pixels' does not determine "
              "the distance"),
    MakeFault("landmarks_ransac_of_one", "pose",
              {After("sigma_px: 1.0", "    outlier_rejection: {method: one_point_ransac}"),
               {kEkf, "{type: ekf, fuse: per_measurement}"}},
              27, "estimators.ekf.fuse: the `outlier_rejection` of sensor 'pixels' needs several"),
    MakeFault("landmarks_representation_unknown", "landmarks",
              {After(kPrior, "  representation: polar")}, 11, "landmarks.representation"),
    MakeFault("landmarks_role_of_a_block", "landmarks",
              {{"landmark: landmarks", "landmark: cam.position"}}, 15,
              "sensors.pixels.roles.landmark: this role is not bound to `landmarks`"),
    MakeFault("landmarks_that_cannot_begin", "landmarks", {{kPrior, "representation: xyz"}}, 10,
              "landmarks: no sensor can initialise a landmark from its first measurement"),
    MakeFault("landmarks_unknown_key", "landmarks", {After(kPrior, "  max_per_fram: 30")}, 11,
              "did you mean 'max_per_frame'?"),
    MakeFault("landmarks_unknown_key_of_prune", "landmarks",
              {After(kPrior, "  prune: {max_missed: 30}")}, 11,
              "landmarks.prune.max_missed: unknown key"),
    MakeFault("landmarks_without_a_sensor", "depth",
              {{"sensors:", "landmarks:\n  " + kPrior + "\nsensors:"}}, 15,
              "landmarks: no sensor measures landmarks"),
    MakeFault("landmarks_xyz_at_infinity", "pose",
              {{"representation: inverse_depth", "representation: xyz"},
               {"inverse_distance: 0.5", "inverse_distance: 0"}},
              14,
              "landmarks.prior.inverse_distance: a landmark at infinity cannot have the "
              "representation xyz; expected "
              "an inverse distance above 0 (in 1/m)"),
    MakeFault(
        "landmarks_xyz_to_xyz", "landmarks",
        {After(kPrior, "  representation: xyz\n  convert_to_xyz: {max_linearity_index: 0.1}")}, 12,
        "landmarks.convert_to_xyz: landmarks already have the representation xyz"),
};

class ConfigFault : public ProgramTest, public ::testing::WithParamInterface<Fault> {
 protected:
  /// Returns the text of the base config after the changes of `fault`.
  static std::string Text(const Fault& fault) {
    std::string text = fault.base.empty() ? "" : ReadText(kBases / (fault.base + ".yaml"));
    for (const auto& [from, to] : fault.changes) {
      const std::size_t place = text.find(from);
      EXPECT_NE(place, std::string::npos) << from;
      EXPECT_EQ(text.rfind(from), place) << from;
      if (place != std::string::npos) text.replace(place, from.size(), to);
    }
    return text;
  }
};

TEST_P(ConfigFault, GetsItsCodePlaceAndWords) {
  const Fault& fault = GetParam();
  Write("fault.yaml", Text(fault));
  Write("rows.csv", "t_s,d,s\n0,80,1\n");
  const std::string plugins = ALIDADE_BINARY_DIR "/tests/faults";
  const Outcome outcome = Call({"run", "fault.yaml", "-o", "out", "--plugin-path", plugins});
  EXPECT_EQ(outcome.code, fault.code) << outcome.err;
  const std::string line = fault.line == 0 ? "" : std::to_string(fault.line) + ':';
  EXPECT_TRUE(outcome.err.starts_with("error: fault.yaml:" + line)) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, fault.words)) << outcome.err;
  EXPECT_TRUE(outcome.out.empty());
  EXPECT_FALSE(Exists("hacked"));
}

std::string Name(const ::testing::TestParamInfo<Fault>& fault) { return "_" + fault.param.name; }

INSTANTIATE_TEST_SUITE_P(Text, ConfigFault, ::testing::ValuesIn(kTextFaults), Name);
INSTANTIATE_TEST_SUITE_P(Keys, ConfigFault, ::testing::ValuesIn(kKeyFaults), Name);
INSTANTIATE_TEST_SUITE_P(Blocks, ConfigFault, ::testing::ValuesIn(kBlockFaults), Name);
INSTANTIATE_TEST_SUITE_P(Estimators, ConfigFault, ::testing::ValuesIn(kEstimatorFaults), Name);
INSTANTIATE_TEST_SUITE_P(Landmarks, ConfigFault, ::testing::ValuesIn(kLandmarkFaults), Name);

class ConfigText : public ProgramTest {
 protected:
  Outcome RunText(const std::string& text) const {
    Write("text.yaml", text);
    return Call({"run", "text.yaml", "-o", "out", "--force"});
  }
};

// Tests fault 15 of tests/faults/README.md.
TEST_F(ConfigText, LargerThanOneMebibyteIsRefused) {
  constexpr std::size_t kLimit = 1 << 20;
  const std::string padded = kDepthConfig + '#' + std::string(kLimit, 'x');
  EXPECT_EQ(RunText(padded.substr(0, kLimit)).code, 0);
  const Outcome large = RunText(padded.substr(0, kLimit + 1));
  EXPECT_EQ(large.code, 78);
  EXPECT_EQ(large.err,
            "error: text.yaml: the config is larger than 1 MiB; expected at most 1 MiB\n");
}

// Tests fault 18 of tests/faults/README.md.
TEST_F(ConfigText, ByteOrderMarkAndCarriageReturnsMakeNoDifference) {
  ASSERT_EQ(RunText(kDepthConfig).code, 0);
  const std::string estimates = Read("out/ekf/estimates.csv");
  std::string text = "\xEF\xBB\xBF";
  for (const char c : kDepthConfig) text += c == '\n' ? "\r\n" : std::string(1, c);
  const Outcome outcome = RunText(text);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(Read("out/ekf/estimates.csv"), estimates);
}

// Tests fault 22 of tests/faults/README.md.
TEST_F(ConfigText, AFolderAndAMissingFileAreInputMissing) {
  const auto expect = [&](const std::string& config, const std::string& reason) {
    const Outcome outcome = Call({"run", config, "-o", "out"});
    EXPECT_EQ(outcome.code, 66);
    EXPECT_EQ(outcome.err, "error: " + config + ": cannot be read: " + reason + '\n');
  };
  fs::create_directory(folder_ / "folder");
  Write("folder/config.yaml", kDepthConfig);
  expect("folder", "it is a directory; did you mean 'folder/config.yaml'?");
  expect("confg.yaml", "No such file or directory; did you mean 'config.yaml'?");
  fs::create_directory(folder_ / "folder.yaml");
  fs::create_symlink("nothing", folder_ / "link.yaml");
  expect("folder.yaml", "it is a directory");
  expect("missing.yaml", "No such file or directory");
  expect("link.yaml", "No such file or directory");
}

}  // namespace
}  // namespace alidade::testing
