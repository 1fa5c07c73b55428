// SPDX-License-Identifier: Apache-2.0
//
// Tests that the text of the program fits the terminal.
#include <algorithm>
#include <sstream>

#include "alidade/io/utf8.h"
#include "support/program.h"
#include "support/terminal.h"

namespace alidade {
namespace {

using testing::Arguments;
using testing::Contains;
using testing::Outcome;

class LayoutCli : public testing::ProgramTest {
 protected:
  std::string TextAt(int width, const Arguments& arguments) {
    before_ = "export COLUMNS=" + std::to_string(width);
    return Call(arguments).out;
  }
};

std::vector<std::string> LinesOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::size_t WidestLine(const std::string& text) {
  std::size_t widest = 0;
  for (const std::string& line : LinesOf(text)) {
    widest = std::max(widest, internal::TextWidth(line));
  }
  return widest;
}

std::vector<std::string> WordsOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

TEST_F(LayoutCli, ARunHasAtMost25Lines) {
  for (const char* config :
       {"02_depth_scale_only/config.yaml", "03_depth_scale_known/config.yaml",
        "05_depth_principled/compare.yaml", "08_depth_all_estimators/config.yaml",
        "17_depth_update_order/config.yaml", "18_depth_noise_lag/config.yaml",
        "19_outliers_from_models/config.yaml", "21_poses/config.yaml",
        "22_range_bearing/config.yaml", "24_time_offset/config.yaml"}) {
    for (const int width : {80, 120}) {
      const std::string path = std::string(ALIDADE_SOURCE_DIR "/examples/") + config;
      const std::string text = TextAt(width, {"run", path, "-o", "out", "--force"});
      if (Contains(Read("stderr"), "estimator type 'ceres_batch' is neither")) continue;
      const std::vector<std::string> lines = LinesOf(text);
      ASSERT_FALSE(lines.empty()) << config;
      EXPECT_LE(lines.size(), 25u) << config << " at " << width << '\n' << text;
      EXPECT_LE(WidestLine(text), static_cast<std::size_t>(width)) << config << '\n' << text;
      EXPECT_TRUE(Contains(lines.front(), " of data, seed ")) << lines.front();
      EXPECT_EQ(lines.back(), "report   out/report.html") << text;
    }
  }
}

TEST_F(LayoutCli, TextFitsTheWidthAndKeepsItsWords) {
  for (const Arguments& command :
       {Arguments{"run", "--help"}, Arguments{"eval", "--help"}, Arguments{"--help"},
        Arguments{"plugins", "list"}, Arguments{"plugins", "info", "stereo_disparity"},
        Arguments{"check", "stereo_disparity", "--config", "config.yaml"},
        Arguments{"explain", "config.yaml"}}) {
    const std::vector<std::string> words = WordsOf(TextAt(200, command));
    ASSERT_FALSE(words.empty()) << command.front();
    for (const int width : {60, 80, 120}) {
      const std::string text = TextAt(width, command);
      EXPECT_EQ(WordsOf(text), words) << command.front() << " at " << width;
      for (const std::string& line : LinesOf(text)) {
        // A word that is longer than the line, such as a path, is never divided.
        const bool is_one_word = WordsOf(line).size() == 1;
        EXPECT_TRUE(is_one_word || internal::TextWidth(line) <= static_cast<std::size_t>(width))
            << line;
      }
    }
  }
}

TEST_F(LayoutCli, TablesFitTheWidth) {
  const std::string compare = ALIDADE_SOURCE_DIR "/examples/05_depth_principled/compare.yaml";
  for (const int width : {60, 80, 120, 200}) {
    for (const Arguments& command :
         {Arguments{"run", compare, "--all", "-o", "out", "--force"},
          Arguments{"sweep", "config.yaml", "--runs", "5", "-o", "sweep", "--force"},
          Arguments{"sweep", "config.yaml", "--runs", "2", "--vary", "sensors.stereo.sigma_px=1,2",
                    "-o", "vary", "--force"},
          Arguments{"compare", "config.yaml", "--runs", "3", "-o", "compared", "--force"}}) {
      const std::string text = TextAt(width, command);
      EXPECT_LE(WidestLine(text), static_cast<std::size_t>(width)) << text;
      EXPECT_FALSE(text.empty()) << command.front();
    }
  }
}

// The pseudo-terminal has no size, so the width is that of COLUMNS.
TEST_F(LayoutCli, VerdictsAreColouredOnATerminalOnly) {
  const testing::Terminal terminal;
  const Arguments run = {"run", "config.yaml", "-o", "out", "--force"};
  before_ = "export TERM=xterm COLUMNS=80; exec >" + terminal.name();
  EXPECT_EQ(Call(run).code, 0);
  EXPECT_TRUE(Contains(terminal.Text(), "\033[1;32mconsistent\033[0m  ekf"));
  EXPECT_EQ(Call(Diverging(run)).code, 0);
  EXPECT_TRUE(Contains(terminal.Text(), "\033[1;31mdiverged\033[0m  ekf: "));
  before_ = "export TERM=xterm NO_COLOR=1; exec >" + terminal.name();
  EXPECT_EQ(Call(run).code, 0);
  EXPECT_FALSE(Contains(terminal.Text(), "\033["));
}

}  // namespace
}  // namespace alidade
