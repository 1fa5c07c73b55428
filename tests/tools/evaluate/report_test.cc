// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/report.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "alidade/config/config.h"
#include "support/recording.h"
#include "support/trajectories.h"

namespace alidade {
namespace {

using Eigen::Vector3d;
using testing::Curve;

/// The curve, moved by 5 cm and measured against itself.
Evaluation Moved(Alignment alignment, const std::string& label, EvaluateOptions options = {}) {
  Trajectory estimate = Curve(30);
  estimate.positions.row(0).array() += 0.05;
  options.alignment = alignment;
  Evaluation evaluation = Evaluate(Curve(30), estimate, options);
  evaluation.label = label;
  return evaluation;
}

TEST(EvaluationReport, EveryTableSaysWhatItsFiguresDependOn) {
  const std::vector<Evaluation> both = {Moved(Alignment::kNone, "a_b"),
                                        Moved(Alignment::kSe3, "c")};
  EXPECT_EQ(EvaluationMarkdown(both),
            "| estimate | align | scale | matched | within [s] | ATE trans_part [m] | ATE "
            "angle_deg [deg] | RPE trans_part [m] | RPE angle_deg [deg] |\n"
            "|---|---|---:|---:|---:|---:|---:|---:|---:|\n"
            "| a_b | none | 1.000000 | 30 of 30 | 0.01 | 0.050000 | 0.000000 | 0.000000 | 0.000000 "
            "|\n"
            "| c | se3 | 1.000000 | 30 of 30 | 0.01 | 0.000000 | 0.000000 | 0.000000 | 0.000000 |\n"
            "\nRMSE, compared with curve.tum; RPE of consecutive pairs, 1 f apart.\n");
  const std::string latex = EvaluationLatex(both);
  EXPECT_TRUE(latex.starts_with("% RMSE, compared with curve.tum; ")) << latex;
  EXPECT_NE(latex.find("\\begin{tabular}{llrrrrrrr}\n"), std::string::npos) << latex;
  EXPECT_NE(latex.find("a\\_b & none & 1.000000 & 30 of 30 & 0.01 & 0.050000 & "),
            std::string::npos)
      << latex;
  const std::string text = EvaluationText(both);
  for (const char* part : {"align", "scale", "matched", "within [s]", "none", "se3", "30 of 30"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  const std::string one = EvaluationText({both[1]});
  for (const char* part :
       {"matched    30 of 30 possible poses, within 0.01 s\n", "aligned    se3, scale 1.000000\n",
        "RPE        29 consecutive pairs, 1 f apart\n", "ATE trans_part [m]"}) {
    EXPECT_NE(one.find(part), std::string::npos) << one;
  }
}

TEST(EvaluationReport, EveryTableSaysByHowManyPosesIsAligned) {
  EvaluateOptions options;
  options.align_poses = 20;
  const std::vector<Evaluation> all = {Moved(Alignment::kSe3, "a", options),
                                       Moved(Alignment::kOrigin, "b", options)};
  EXPECT_NE(EvaluationMarkdown(all).find("| a | se3 by the first 20 poses | "), std::string::npos);
  EXPECT_NE(EvaluationMarkdown(all).find("| b | origin | "), std::string::npos);
  EXPECT_NE(EvaluationLatex(all).find("\na & se3 by the first 20 poses & "), std::string::npos);
  EXPECT_NE(EvaluationText(all).find(" se3 by the first 20 poses "), std::string::npos);
  EXPECT_NE(EvaluationText({all[0]}).find("aligned    se3 by the first 20 poses, scale 1.000000"),
            std::string::npos);
  EXPECT_NE(EvaluationText({all[1]}).find("aligned    origin, scale"), std::string::npos);
}

TEST(EvaluationReport, NamesAreQuotedWhereTheFormAsksForIt) {
  const std::vector<Evaluation> one = {Moved(Alignment::kNone, "a|b_{c}")};
  EXPECT_NE(EvaluationMarkdown(one).find("| a\\|b_{c} |"), std::string::npos);
  EXPECT_NE(EvaluationLatex(one).find("\na|b\\_\\{c\\} & none"), std::string::npos);
  const std::vector<Evaluation> other = {Moved(Alignment::kNone, "a^b~c\\d")};
  EXPECT_NE(EvaluationMarkdown(other).find("| a^b~c\\\\d |"), std::string::npos);
  EXPECT_NE(EvaluationLatex(other).find("\na\\^{}b\\~{}c\\textbackslash{}d & none"),
            std::string::npos)
      << EvaluationLatex(other);
}

TEST(EvaluationReport, NeesNamesItsQuantityItsDofAndItsPoses) {
  Evaluation evaluation = Moved(Alignment::kNone, "a");
  evaluation.position_nees = Nees{2, 1.5, 1.0};
  EXPECT_NE(EvaluationText({evaluation})
                .find("NEES position (3 dof) 1.5 per dof, 100 % within 95 %, 2 of 30 poses\n"
                      "NEES is marginal here: of each quantity alone. nees.mean in the run.json of "
                      "a run is joint, over all states of a model.\n"),
            std::string::npos)
      << EvaluationText({evaluation});
  EXPECT_NE(EvaluationMarkdown({evaluation}).find(" | NEES position (3 dof) | NEES orientation |"),
            std::string::npos)
      << EvaluationMarkdown({evaluation});
  Evaluation planar = evaluation;
  planar.position_nees->dof = 2;
  planar.orientation_nees = Nees{2, 1.0, 1.0, 1};
  EXPECT_NE(EvaluationMarkdown({evaluation, planar})
                .find(" | NEES position (2 or 3 dof) | NEES orientation (1 dof) |"),
            std::string::npos)
      << EvaluationMarkdown({evaluation, planar});
}

TEST(EvaluationReport, JsonHasAllOfIt) {
  Evaluation evaluation = Moved(Alignment::kNone, "a");
  evaluation.innovations = {{"pixels", 100, 0.9, 0.96, 0.01, 0.02}};
  evaluation.position_nees = Nees{30, 1.5, 0.9};
  evaluation.warnings = {"w"};
  const Config json = Config::FromText(EvaluationJson({evaluation}), "json");
  const Node one = json.root().At("evaluations").Items().front();
  EXPECT_EQ(one.At("estimate").Text(), "a");
  EXPECT_EQ(one.At("align").Text(), "none");
  EXPECT_EQ(one.At("scale").Number(), 1.0);
  EXPECT_EQ(one.At("matched").Integer(0, 100), 30);
  EXPECT_EQ(one.At("possible").Integer(0, 100), 30);
  EXPECT_EQ(one.At("t_max_diff").Number(), 0.01);
  EXPECT_NEAR(one.At("ate").At("trans_part").At("rmse").Number(), 0.05, 1e-15);
  EXPECT_EQ(one.At("pairs").At("delta_unit").Text(), "f");
  EXPECT_EQ(one.At("nees_position").At("mean").Number(), 1.5);
  EXPECT_EQ(one.At("nees_position").At("dof").Integer(0, 3), 3);
  EXPECT_EQ(one.At("nis").At("pixels").At("autocorrelation").Number(), 0.01);
  EXPECT_EQ(one.At("warnings").Items().front().Text(), "w");
}

/// Stored, not compressed, entries of a zip by their names, as its central directory has them.
std::map<std::string, std::string> Unzip(const std::string& zip) {
  const auto number = [&](std::size_t at, int bytes) {
    std::size_t value = 0;
    for (int i = bytes - 1; i >= 0; --i) {
      value = 256 * value + static_cast<unsigned char>(zip.at(at + static_cast<std::size_t>(i)));
    }
    return value;
  };
  const std::size_t end = zip.rfind("PK\x05\x06");
  std::map<std::string, std::string> entries;
  std::size_t at = number(end + 16, 4);
  for (std::size_t left = number(end + 10, 2); left > 0; --left) {
    EXPECT_EQ(zip.substr(at, 4), "PK\x01\x02");
    EXPECT_EQ(number(at + 10, 2), 0u) << "compressed";
    const std::size_t size = number(at + 24, 4), name = number(at + 28, 2);
    const std::size_t local = number(at + 42, 4);
    const std::size_t data = local + 30 + number(local + 26, 2) + number(local + 28, 2);
    entries[zip.substr(at + 46, name)] = zip.substr(data, size);
    at += 46 + name + number(at + 30, 2) + number(at + 32, 2);
  }
  return entries;
}

/// The numbers of a file of numpy, and the shape in its header.
std::pair<std::string, std::vector<double>> Numbers(const std::string& npy) {
  EXPECT_EQ(npy.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const std::size_t header =
      static_cast<unsigned char>(npy[8]) + 256u * static_cast<unsigned char>(npy[9]);
  EXPECT_EQ((10 + header) % 64, 0u);
  EXPECT_EQ(npy[9 + header], '\n');
  const std::string text = npy.substr(10, header);
  EXPECT_TRUE(text.starts_with("{'descr': '<f8', 'fortran_order': False, 'shape': ")) << text;
  std::vector<double> values((npy.size() - 10 - header) / sizeof(double));
  std::memcpy(values.data(), npy.data() + 10 + header, values.size() * sizeof(double));
  const std::size_t from = text.find("'shape': ") + 9;
  return {text.substr(from, text.find(')') + 1 - from), values};
}

TEST(SaveEvoResult, IsAZipAsEvoWritesIt) {
  const testing::TemporaryFolder folder;
  const Evaluation evaluation = Moved(Alignment::kSe3, "ekf");
  SaveEvoResult(evaluation, SavedErrors::kAbsolute, folder / "ate.zip", false);
  const std::string zip = testing::Read(folder / "ate.zip");
  const std::map<std::string, std::string> entries = Unzip(zip);
  std::vector<std::string> names;
  for (const auto& [name, content] : entries) names.push_back(name);
  EXPECT_EQ(names,
            (std::vector<std::string>{"alignment_transformation_sim3.npy", "distances.npy",
                                      "distances_from_start.npy", "error_array.npy", "info.json",
                                      "seconds_from_start.npy", "stats.json", "timestamps.npy"}));
  const Config info = Config::FromText(entries.at("info.json"), "info.json");
  EXPECT_EQ(info.root().At("title").Text(),
            "APE w.r.t. translation part (m)\n(with SE(3) Umeyama alignment)");
  EXPECT_EQ(info.root().At("label").Text(), "APE (m)");
  EXPECT_EQ(info.root().At("est_name").Text(), "ekf");
  EXPECT_EQ(info.root().At("ref_name").Text(), "curve.tum");
  const Config stats = Config::FromText(entries.at("stats.json"), "stats.json");
  EXPECT_EQ(stats.root().At("rmse").Number(), evaluation.absolute[0].statistics.rmse);
  for (const char* name : {"mean", "median", "std", "min", "max", "sse"}) {
    EXPECT_TRUE(stats.root().Find(name)) << name;
  }
  EXPECT_EQ(Numbers(entries.at("error_array.npy")),
            std::pair(std::string("(30,)"), evaluation.absolute[0].errors));
  const auto [shape, times] = Numbers(entries.at("timestamps.npy"));
  EXPECT_NEAR(times[29], 102.9, 1e-9);
  EXPECT_NEAR(Numbers(entries.at("seconds_from_start.npy")).second[29], 2.9, 1e-9);
  EXPECT_NEAR(Numbers(entries.at("distances_from_start.npy")).second[29],
              evaluation.reference.Length(0, 29), 1e-12);
  const auto [square, matrix] = Numbers(entries.at("alignment_transformation_sim3.npy"));
  EXPECT_EQ(square, "(4, 4)");
  EXPECT_NEAR(matrix[3], -0.05, 1e-12);
  EXPECT_EQ(matrix[15], 1.0);

  // The same result is the same bytes; another one does not replace it unasked.
  SaveEvoResult(evaluation, SavedErrors::kAbsolute, folder / "again.zip", false);
  EXPECT_EQ(testing::Read(folder / "again.zip"), zip);
  EXPECT_THROW(SaveEvoResult(evaluation, SavedErrors::kRelative, folder / "ate.zip", false), Error);
  SaveEvoResult(evaluation, SavedErrors::kRelative, folder / "ate.zip", true);
  const auto relative = Unzip(testing::Read(folder / "ate.zip"));
  EXPECT_EQ(Numbers(relative.at("error_array.npy")),
            std::pair(std::string("(29,)"), evaluation.relative[0].errors));
  EXPECT_NEAR(Numbers(relative.at("seconds_from_start.npy")).second[0], 0.1, 1e-9);
  EXPECT_NE(relative.at("info.json").find("for delta = 1 (frames) using consecutive pairs"),
            std::string::npos);
}

TEST(SaveEvoResult, DistancesAreThoseOfThePosesWhateverTheirOrder) {
  const testing::TemporaryFolder folder;
  Trajectory turning = Curve(6);
  const double angles_deg[] = {0.0, 10.0, 20.0, 30.0, 5.0, 20.0};
  for (std::size_t i = 0; i < 6; ++i) {
    turning.orientations[i] =
        Eigen::AngleAxisd(angles_deg[i] * 3.14159265358979323846 / 180.0, Vector3d::UnitX());
  }
  EvaluateOptions options;
  options.alignment = Alignment::kSe3;
  options.align_poses = 5;
  options.pairs = {20.0, DeltaUnit::kDegrees, true, 0.01};
  const Evaluation evaluation = Evaluate(turning, turning, options);
  ASSERT_EQ(evaluation.pairs, (std::vector<std::pair<int, int>>{{0, 2}, {0, 5}, {1, 3}}));
  SaveEvoResult(evaluation, SavedErrors::kRelative, folder / "r.zip", false);
  const auto entries = Unzip(testing::Read(folder / "r.zip"));
  const std::vector<double> reference = Numbers(entries.at("distances_from_start.npy")).second;
  const std::vector<double> estimate = Numbers(entries.at("distances.npy")).second;
  ASSERT_EQ(reference.size(), evaluation.pairs.size());
  ASSERT_EQ(estimate.size(), evaluation.pairs.size());
  for (std::size_t k = 0; k < evaluation.pairs.size(); ++k) {
    const int end = evaluation.pairs[k].second;
    EXPECT_NEAR(reference[k], evaluation.reference.Length(0, end), 1e-12) << k;
    EXPECT_NEAR(estimate[k], evaluation.estimate.Length(0, end), 1e-12) << k;
  }
  EXPECT_NE(entries.at("info.json").find("Umeyama alignment) (aligned poses: 5)"),
            std::string::npos)
      << entries.at("info.json");
}

}  // namespace
}  // namespace alidade
