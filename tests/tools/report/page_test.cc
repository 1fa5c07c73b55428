// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/page.h"

#include <gtest/gtest.h>

#include "alidade/config/config.h"
#include "support/recording.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

constexpr const char* kDataStart = "<script type=\"application/json\" id=\"data\">";

/// Returns the text of the data of a page. A browser ends this text at the first `</script`.
std::string DataTextOf(const std::string& page) {
  const std::size_t start = page.find(kDataStart);
  EXPECT_NE(start, page.npos);
  const std::size_t begin = start + std::string(kDataStart).size();
  return page.substr(begin, page.find("</script", begin) - begin);
}

/// Parses the data of a page. JSON is also YAML.
Config DataOf(const std::string& page) { return Config::FromText(DataTextOf(page), "page"); }

/// Returns the page of a run whose config has this title.
std::string PageWithTitle(const std::string& title) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment(5);
  Recorder recorder(OptionsFor(folder / "out"),
                    Config::FromText("alidade: 1\ntitle: " + title + '\n', "swing.yaml"));
  recorder.Finish(RunInto(recorder, experiment));
  return Read(folder / "out/report.html");
}

TEST(ReportPage, HasTheNumbersOfTheRun) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  const std::string page = Read(folder / "out/report.html");
  EXPECT_EQ(ReportPage(folder / "out"), page);
  const Config data = DataOf(page), run = Config::FromText(Read(folder / "out/run.json"), "run");
  EXPECT_EQ(data.root().At("format").Text(), "alidade-report");
  EXPECT_EQ(data.root().At("title").Text(), "A <swinging> target");
  const auto estimators = data.root().At("run").At("estimators").Items();
  ASSERT_EQ(estimators.size(), 2u);
  for (const Node& estimator : estimators) {
    const Node entry = run.root().At("estimators").At(estimator.At("name").Text());
    EXPECT_EQ(estimator.At("verdict").At("because").Text(),
              entry.At("verdict").At("because").Text());
    EXPECT_EQ(estimator.At("metrics").Entries().size(), entry.At("metrics").Entries().size());
    EXPECT_EQ(estimator.At("blocks").Items().at(0).At("name").Text(), "target.depth");
  }
  // 60 frames are 33 ms apart.
  const auto columns = data.root().At("columns").Items();
  const auto times = columns.at(static_cast<std::size_t>(data.root().At("run").At("t").Number()));
  EXPECT_EQ(times.At("n").Number(), 60.0);
  EXPECT_EQ(times.At("s").Number(), 0.033);
}

TEST(ReportPage, ListsTheFilesOfTheFolderExceptItself) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  std::vector<std::string> names;
  const Config data = DataOf(Read(folder / "out/report.html"));
  for (const Node& name : data.root().At("files").Items()) {
    names.push_back(name.Text());
  }
  std::vector<std::string> files = FilesIn(folder / "out");
  std::erase_if(files,
                [](const auto& name) { return name == "report.html" || name == "files.txt"; });
  EXPECT_EQ(names, files);
  const std::vector<std::string> listed = Lines(folder / "out/files.txt");
  EXPECT_EQ(std::ranges::count(listed, "report.html"), 1);
}

TEST(ReportPage, TextsCannotEndTheElementThatContainsThem) {
  for (const std::string title :
       {"</script><script>alert(1)</script>", "\\\"><img src=x onerror=alert(1)>",
        "<!-- {{script}}", "\\u2028 \\u2029 &lt;"}) {
    const std::string page = PageWithTitle('"' + title + '"');
    const std::string text = DataTextOf(page);
    EXPECT_EQ(text.find('<'), text.npos) << title;
    EXPECT_EQ(text.find("\u2028"), text.npos);
    EXPECT_EQ(text.find("\u2029"), text.npos);
    const Config expected = Config::FromText("title: \"" + title + '"', "title");
    const std::string shown = expected.root().At("title").Text();
    EXPECT_EQ(DataOf(page).root().At("title").Text(), shown);
    // The page has the same elements as any other page.
    const std::string plain = PageWithTitle("plain");
    const auto count = [](const std::string& where, const char* what) {
      std::size_t number = 0;
      for (std::size_t at = where.find(what); at != where.npos; at = where.find(what, at + 1)) {
        ++number;
      }
      return number;
    };
    for (const char* const tag : {"<script", "</script", "<img", "<!--", "</title"}) {
      EXPECT_EQ(count(page, tag), count(plain, tag)) << title << ' ' << tag;
    }
  }
}

TEST(ReportPage, HasASummaryForABrowserWithoutScripts) {
  const std::string page = PageWithTitle("a < b & c");
  const std::size_t begin = page.find("<noscript>");
  ASSERT_NE(begin, page.npos);
  const std::string text = page.substr(begin, page.find("</noscript>") - begin);
  EXPECT_NE(text.find("<h1>a &lt; b &amp; c</h1>"), text.npos) << text;
  EXPECT_NE(text.find("<li>ekf: not tested: "), text.npos) << text;
  EXPECT_NE(text.find("<li>alone: not tested: "), text.npos) << text;
}

TEST(ReportPage, QuotesTheLineOfAnError) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment(5);
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  RunResult result = RunInto(recorder, experiment);
  std::ofstream(folder / "data.csv") << "t_s,d\n0,80\n0.1,abc\n0.2,81\n";
  result.status = RunStatus::kFailed;
  result.reason = (folder / "data.csv").string() + ":3:5 d: 'abc' is not a number";
  recorder.Finish(result);
  const Config data = DataOf(Read(folder / "out/report.html"));
  EXPECT_EQ(data.root().At("status").Text(), "failed");
  const Node failure = data.root().At("failure");
  EXPECT_EQ(failure.At("file").Text(), "data.csv");
  EXPECT_EQ(failure.At("line").Number(), 3.0);
  EXPECT_EQ(failure.At("column").Number(), 5.0);
  EXPECT_EQ(failure.At("lines").Items().at(2).Items().at(1).Text(), "0.1,abc");
}

TEST(ReportPage, RefusesAFolderWithoutResults) {
  const TemporaryFolder folder;
  try {
    (void)ReportPage(folder.path());
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kInputMissing);
  }
}

TEST(ReportPage, RefusesAnInvalidFile) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  std::ofstream(folder / "out/ekf/estimates.csv") << "t_s,target.depth\n0,1,2\n";
  try {
    (void)ReportPage(folder / "out");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kBadData);
    EXPECT_NE(std::string(error.what()).find("estimates.csv:2"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace alidade
