// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/report.h"

#include <gtest/gtest.h>

#include "alidade/config/config.h"
#include "support/trajectories.h"

namespace alidade {
namespace {

using Eigen::Vector3d;
using testing::Curve;

/// Returns the evaluation of a curve that is shifted by 5 cm, relative to the original curve.
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
                .find("NEES position (3 dof) 1.5 per dof, 100 % within the 95 % bound, 2 of 30 "
                      "poses\n"
                      "This NEES is marginal: position and orientation are evaluated separately. "
                      "nees.mean in "
                      "run.json is the joint NEES of all states of a model.\n"),
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

}  // namespace
}  // namespace alidade
