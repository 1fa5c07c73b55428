// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "alidade/record/figures.h"
#include "support/recording.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

TEST(Recorder, DrawsWhereGnuplotIs) {
  const TemporaryFolder folder;
  Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
  Experiment experiment = MakeExperiment();
  recorder.Finish(RunInto(recorder, experiment));
  const std::string report = Read(folder / "out/report.html");
  EXPECT_NE(report.find("A &lt;swinging&gt; target"), std::string::npos);
  ASSERT_EQ(recorder.highlights().front(), "report.html");
  for (const std::string& file : recorder.highlights()) {
    EXPECT_TRUE(fs::exists(folder / "out" / file)) << file;
  }
  if (recorder.note() == "0 of 14 figures drawn: gnuplot is not installed")
    GTEST_SKIP() << recorder.note();
  EXPECT_EQ(recorder.note(), "");
  EXPECT_EQ(recorder.highlights()[1], "figures/measurements.png");
  for (const char* name :
       {"measurements", "comparison", "comparison.errors", "timing", "ekf.errors", "ekf.state",
        "ekf.covariance", "ekf.gain", "ekf.innovation", "alone.state"}) {
    const fs::path figure = folder / "out/figures" / name;
    EXPECT_GT(fs::file_size(figure.string() + ".svg"), 5000u) << name;
    EXPECT_TRUE(fs::exists(figure.string() + ".gp")) << name;
  }
  EXPECT_NE(report.find("<svg"), std::string::npos);
}

using Names = std::vector<std::string>;

Names SvgsOf(const fs::path& folder) {
  Names names = FilesIn(folder / "figures");
  std::erase_if(names, [](const std::string& name) { return !name.ends_with(".svg"); });
  return names;
}

TEST(Recorder, TheComparisonDrawsEveryEstimatorWhateverItsBlocksAreCalled) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  EstimatorSpec other;
  other.name = "other";
  testing::AddMotion(other.problem, "thing", testing::ConstantMotion(1), {{"depth", 0.3, 0.1}});
  testing::AddMotion(other.problem, "own", testing::ConstantMotion(1), {{"bias", 0.1, 0.1}});
  other.estimator =
      std::make_unique<Ekf>(other.problem, EkfOptions{}, experiment.source->streams());
  experiment.estimators.push_back(std::move(other));
  Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  const std::string script = Read(folder / "out/figures/comparison.gp");
  EXPECT_NE(script.find("'other/estimates.csv' using (column('t_s')-t0):(column('thing.depth'))"),
            std::string::npos);
  EXPECT_NE(script.find("title 'other: thing.depth'"), std::string::npos);
  EXPECT_NE(script.find("column('own.bias')"), std::string::npos);
  // Both names belong to the same truth, so there is one panel. It has the name that the other
  // estimators use, target.depth.
  EXPECT_EQ(script.find("set label 1 'thing.depth'"), std::string::npos);
  EXPECT_NE(script.find("set label 1 'target.depth'"), std::string::npos);
}

/// An angle that grows by 1 rad in each step.
struct Spinning : Motion<0, Angle> {
  static constexpr std::array kBlocks{Quantity{"heading", "rad"}};
  template <class T>
  void Step(const T* a, const T*, double, T* next) const {
    next[0] = a[0] + 1.0;
  }
  void SqrtQ(double, MatrixRef) const {}
};

TEST(Recorder, TheLineOfAnAngleIsBrokenWhereItLeaps) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  for (EstimatorSpec& named : experiment.estimators) {
    testing::AddMotion(named.problem, "top", MakeMotion(Spinning(), "spinning"),
                       {{"heading", 0.0, 0.1}});
    named.estimator =
        std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
  }
  Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  EXPECT_TRUE(recorder.note() == "" || recorder.note().ends_with("not installed"))
      << recorder.note();
  for (const char* name : {"comparison", "ekf.state"}) {
    const std::string script = Read(folder / "out/figures" / (std::string(name) + ".gp"));
    EXPECT_NE(script.find("((now = column('top.heading'), leap = column(0) > 0 && "
                          "abs(now - before) > pi, before = now, leap ? NaN : now))"),
              std::string::npos)
        << script;
    EXPECT_EQ(script.find("now = column('target.depth')"), std::string::npos) << script;
  }
}

/// Gives access to the scripts of the figures of a run. gnuplot need not be installed.
class ScriptsOf {
 public:
  explicit ScriptsOf(Experiment& experiment) {
    Recorder recorder(OptionsFor(folder_ / "out", false, true), MakeConfig());
    recorder.Finish(RunInto(recorder, experiment));
  }
  bool Has(const std::string& name) const {
    return fs::exists(folder_ / "out/figures" / (name + ".gp"));
  }
  std::string operator[](const std::string& name) const {
    return Read(folder_ / "out/figures" / (name + ".gp"));
  }

 private:
  TemporaryFolder folder_;
};

TEST(Recorder, ErrorsOfAllEstimatorsAreDrawnInOnePanel) {
  Experiment experiment = MakeExperiment();
  const ScriptsOf scripts(experiment);
  const std::string script = scripts["comparison.errors"];
  for (const char* curve : {"'ekf/errors.csv' using (column('t_s')-t0):(column('target.depth')) "
                            "with lines ls 1 title 'ekf'",
                            "'alone/errors.csv' using (column('t_s')-t0):(column('target.depth')) "
                            "with lines ls 2 title 'alone'"}) {
    EXPECT_NE(script.find(curve), std::string::npos) << curve << '\n' << script;
  }
  // this block has no truth
  EXPECT_EQ(script.find("'template.inverse_distance'"), std::string::npos) << script;
  experiment = MakeExperiment();
  experiment.estimators.pop_back();
  EXPECT_FALSE(ScriptsOf(experiment).Has("comparison.errors"));
}

TEST(DrawFigures, DrawsTheVarianceOfARotationAndNoTwoCurvesAlike) {
  internal::RecordedRun run;
  run.estimators.push_back({"ekf"});
  for (const char* axis : {"rx", "ry", "rz"}) {
    run.estimators[0].sigmas.push_back({std::string("cam.orientation.") + axis, "rad", true});
  }
  for (int i = 0; i < 6; ++i) {
    run.estimators[0].sigmas.push_back({"other." + std::to_string(i), "m", true});
  }
  run.estimators[0].sigmas.push_back({"exact", "m", false});
  const TemporaryFolder folder;
  const internal::OutputFolder output(folder / "out", false);
  internal::DrawFigures(output, run, {[] { return true; }});
  const std::string script = Read(output.partial() / "figures/ekf.covariance.gp");
  EXPECT_NE(script.find("with lines ls 1 title 'cam.orientation.rx [rad^2]'"), std::string::npos);
  EXPECT_NE(script.find("with lines ls 1 dt 2 title 'other.5 [m^2]'"), std::string::npos) << script;
  EXPECT_EQ(script.find("exact"), std::string::npos) << script;
}

TEST(Recorder, AConstantBlockHasNoPanel) {
  Experiment experiment = MakeExperiment();
  for (EstimatorSpec& named : experiment.estimators) {
    named.problem = WithStatus(named.problem, "template.inverse_distance", BlockStatus::kConstant);
    named.estimator =
        std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
  }
  const ScriptsOf scripts(experiment);
  for (const char* name : {"comparison", "ekf.state"}) {
    EXPECT_NE(scripts[name].find("set label 1 'target.depth'"), std::string::npos) << name;
    EXPECT_EQ(scripts[name].find("template.inverse_distance"), std::string::npos) << name;
  }
}

TEST(Recorder, AGainHasItsUnit) {
  Experiment experiment = MakeExperiment();
  const std::string script = ScriptsOf(experiment)["ekf.gain"];
  // The gain of a disparity is per px. The gain of a scale, which has no unit, is in m/s.
  EXPECT_NE(script.find("title 'target.depth_rate [(m/s)/px]'"), std::string::npos) << script;
  EXPECT_NE(script.find("title 'target.depth_rate [m/s]'"), std::string::npos) << script;
}

/// A target with additional streams that never have a measurement.
class SilentStreams : public SwingingTarget {
 public:
  SilentStreams() : SwingingTarget(60), streams_(SwingingTarget::streams()) {
    for (const char* name : {"left", "right", "top"}) streams_.push_back({name, 1});
  }
  const std::vector<StreamInfo>& streams() const override { return streams_; }

 private:
  std::vector<StreamInfo> streams_;
};

TEST(Recorder, StreamsThatNeverComeDoNotLetALineBridgeMore) {
  const auto gap_of = [](const std::string& script) {
    const std::size_t at = script.find("gap = ");
    return script.substr(at, script.find(',', at) - at);
  };
  Experiment experiment = MakeExperiment(), silent = MakeExperiment();
  silent.source = std::make_unique<SilentStreams>();
  const std::string gap = gap_of(ScriptsOf(experiment)["measurements"]);
  EXPECT_TRUE(gap.starts_with("gap = 0.")) << gap;
  EXPECT_EQ(gap_of(ScriptsOf(silent)["measurements"]), gap);
}

TEST(Recorder, TheTimeOfEachFrameIsDrawnAndNotInThePage) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  const std::vector<std::string> rows = Lines(folder / "out/timing.csv");
  ASSERT_EQ(rows.size(), 61u);
  EXPECT_EQ(rows[0], "t_s,ekf,alone");
  for (const std::string& cell : Cells(rows[60])) EXPECT_GT(std::stod(cell), 0.0);
  const std::string script = Read(folder / "out/figures/timing.gp");
  EXPECT_NE(script.find("period = 0.033\n"), std::string::npos) << script;
  EXPECT_NE(script.find("100 * C2_sum / (C2_records * period)"), std::string::npos) << script;
  if (!recorder.note().empty()) GTEST_SKIP() << recorder.note();
  EXPECT_NE(Read(folder / "out/report.html").find("<img src=\"figures/timing.svg\""),
            std::string::npos);
}

TEST(Recorder, WhatSmoothsHasNoTimeOfAFrame) {
  struct Offline : Ekf {
    using Ekf::Ekf;
    bool offline() const override { return true; }
    void Smooth(const Emit&) override {}
  };
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  experiment.estimators[0].estimator = std::make_unique<Offline>(
      experiment.estimators[0].problem, EkfOptions{}, experiment.source->streams());
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  EXPECT_EQ(Lines(folder / "out/timing.csv").at(0), "t_s,alone");
}

TEST(Recorder, TheComparisonSaysWhatItLeavesOut) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  while (experiment.estimators.size() < 9) {
    EstimatorSpec more;
    more.name = "more_" + std::to_string(experiment.estimators.size());
    more.problem = DepthFilter();
    more.estimator =
        std::make_unique<Ekf>(more.problem, EkfOptions{}, experiment.source->streams());
    experiment.estimators.push_back(std::move(more));
  }
  const int code = InChild([&] {
    ::setenv("PATH", "/nowhere", 1);  // gnuplot is not found; the test reads the script
    Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
    recorder.Finish(RunInto(recorder, experiment));
  });
  EXPECT_EQ(code, 0);
  EXPECT_NE(Read(folder / "out/figures/comparison.gp")
                .find("title 'estimators side by side: the first 8 of 9'"),
            std::string::npos);
}

TEST(Recorder, DoesWithoutGnuplot) {
  const TemporaryFolder folder;
  const int code = InChild([&] {
    ::setenv("PATH", "/nowhere", 1);
    Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
    Experiment experiment = MakeExperiment();
    recorder.Finish(RunInto(recorder, experiment));
    if (recorder.note() != "0 of 14 figures drawn: gnuplot is not installed") ::_exit(1);
  });
  EXPECT_EQ(code, 0);
  EXPECT_TRUE(fs::exists(folder / "out/report.html"));
  EXPECT_EQ(SvgsOf(folder / "out"), Names{});
  // The script is kept, so the figure can be drawn on another machine.
  EXPECT_TRUE(fs::exists(folder / "out/figures/alone.innovation.gp"));
}

/// Puts a slow gnuplot on PATH. It draws the first figure and its PNG, then writes half of the next
/// figure and sleeps.
void UseSlowGnuplot(const TemporaryFolder& folder) {
  const fs::path program = folder / "bin/gnuplot";
  fs::create_directory(program.parent_path());
  std::ofstream(program) << "#!/bin/sh\n"
                            "case \"$*\" in\n"
                            "  *measurements*) echo '<svg>one</svg>' > figures/measurements.svg\n"
                            "                  echo > figures/measurements.png;;\n"
                            "  *) echo '<svg>half' > figures/comparison.svg; exec sleep 100;;\n"
                            "esac\n";
  fs::permissions(program, fs::perms::owner_all);
  ::setenv("PATH", (program.parent_path().string() + ":/usr/bin:/bin").c_str(), 1);
}

/// Records a run in a child process that uses the slow gnuplot. `note` is the expected note on the
/// missing figures.
int RecordSlowly(const TemporaryFolder& folder, Recorder::Options options, const char* note) {
  return InChild([&] {
    UseSlowGnuplot(folder);
    Recorder recorder(options, MakeConfig());
    Experiment experiment = MakeExperiment();
    recorder.Finish(RunInto(recorder, experiment));
    if (recorder.note() != note) ::_exit(1);
  });
}

TEST(Recorder, AStopLeavesOutTheRestOfTheFigures) {
  const TemporaryFolder folder;
  Recorder::Options options = OptionsFor(folder / "out", false, true);
  options.stop = [&] {  // stops as soon as gnuplot sleeps
    return fs::exists(folder / "out.partial/figures/comparison.svg");
  };
  EXPECT_EQ(RecordSlowly(folder, options, "1 of 14 figures drawn: the drawing was stopped"), 0);
  EXPECT_EQ(SvgsOf(folder / "out"), Names{"measurements.svg"});
  EXPECT_TRUE(fs::exists(folder / "out/run.json"));
  const std::string report = Read(folder / "out/report.html");
  EXPECT_NE(report.find("<svg>one</svg>"), std::string::npos);
  EXPECT_EQ(report.find("<svg>half"), std::string::npos);
  EXPECT_NE(report.find("1 of 14 figures drawn: the drawing was stopped"), std::string::npos);
}

TEST(Recorder, AFigureThatGnuplotDidNotWriteIsNotThere) {
  const TemporaryFolder folder;
  const int code = InChild([&] {
    fs::create_directory(folder / "bin");
    fs::create_symlink("/bin/true", folder / "bin/gnuplot");
    ::setenv("PATH", (folder / "bin").c_str(), 1);
    Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
    Experiment experiment = MakeExperiment();
    recorder.Finish(RunInto(recorder, experiment));
    const std::string note = recorder.note();
    if (note != "0 of 14 figures drawn: measurements is not: gnuplot wrote nothing") ::_exit(1);
  });
  EXPECT_EQ(code, 0);
  EXPECT_EQ(Read(folder / "out/report.html").find("<figure>"), std::string::npos);
}

TEST(Recorder, DrawsNothingOnceItIsStopped) {
  const TemporaryFolder folder;
  Recorder::Options options = OptionsFor(folder / "out", false, true);
  options.stop = [] { return true; };
  EXPECT_EQ(RecordSlowly(folder, options, "0 of 14 figures drawn: the drawing was stopped"), 0);
  EXPECT_EQ(SvgsOf(folder / "out"), Names{});
}

TEST(Recorder, GivesGnuplotSoMuchTimeAndNoMore) {
  const TemporaryFolder folder;
  Recorder::Options options = OptionsFor(folder / "out", false, true);
  options.drawing_s = 1.0;
  EXPECT_EQ(RecordSlowly(folder, options, "1 of 14 figures drawn: gnuplot took too long"), 0);
  EXPECT_EQ(SvgsOf(folder / "out"), Names{"measurements.svg"});
}

}  // namespace
}  // namespace alidade
