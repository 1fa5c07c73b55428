// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "support/config_text.h"

namespace alidade {
namespace {

using testing::Message;
using testing::Read;

std::string SetError(const std::string& key, const std::string& value) {
  Config config = Read("a: {b: [1, {c: 2}], t: text}");
  return Message([&] { config.Set(key, value, "--set"); });
}

TEST(ConfigSet, ReplacesAndMakes) {
  Config config = Read("a: {b: [1, {c: 2}]}\nn:\n");
  config.Set("a.b[1].c", "[3, 4]", "--set");
  config.Set("x.y", "\"010\"", "--set");
  config.Set("n.m", "{k: 1}", "--set");
  EXPECT_EQ(config.ToYaml(),
            "a:\n  b:\n    - 1\n    - c: [3, 4]\nn:\n  m:\n    k: 1\nx:\n  y: \"010\"\n");
  EXPECT_EQ(config.root().At("a").At("b").Items()[1].At("c").path(), "a.b[1].c");
}

TEST(ConfigSet, RelativePathsAreTakenFromTheCurrentFolder) {
  Config config = Read("source: {seed: 1}\n");
  const auto path = [&] { return config.root().At("source").At("path").Text(); };
  config.Set("source.path", "a/b.csv", "--set");
  EXPECT_EQ(path(), (std::filesystem::current_path() / "a/b.csv").string());
  config.Set("source", "{path: /x.csv}", "--set");
  EXPECT_EQ(path(), "/x.csv");
  config.Set("source.path", "-", "--set");
  EXPECT_EQ(path(), "-");
  for (const char* key : {"known", "left", "right", "stereo", "boxes", "timestamps", "truth"}) {
    config.Set(std::string("source.") + key, "tables/t.csv", "--set");
    EXPECT_EQ(config.root().At("source").At(key).Text(),
              (std::filesystem::current_path() / "tables/t.csv").string());
  }
  config.Set("source.left", "3", "--set");  // `left` is a parameter of a plugin, not a file name
  EXPECT_EQ(config.root().At("source").At("left").Text(), "3");
  config.Set("source.truth", "{depth: z}", "--set");
  EXPECT_EQ(config.root().At("source").At("truth").At("depth").Text(), "z");
  config.Set("plugins", "[p.so]", "--set");
  EXPECT_EQ(config.root().At("plugins").Items()[0].Text(),
            (std::filesystem::current_path() / "p.so").string());
}

TEST(ConfigSet, ErrorsAboutTheValueNameTheOrigin) {
  Config config = Read("a: 1\nsource: {seed: 1}\n");
  config.Set("source.seed", "3.8x", "--set");
  EXPECT_EQ(Message([&] { config.root().At("source").At("seed").Number(); }),
            "--set source.seed: '3.8x' is not a finite number; expected a number");
  config.Set("source.sede", "1", "--set");
  config.root().At("source").At("seed");
  EXPECT_EQ(Message([&] { config.root().At("source").RejectUnread(); }),
            "--set source.sede: unknown key; did you mean 'seed'?");
}

// A misspelt name must not create a new estimator, sensor or state entry.
TEST(ConfigSet, ANewEntryIsAWholeMap) {
  Config config = Read("estimators: {ekf: {type: ekf}}\nsensors: {}\n");
  const auto error = [&](const char* key, const char* value) {
    return Message([&] { config.Set(key, value, "--set"); });
  };
  EXPECT_EQ(error("estimators.efk.gate", "0.9"),
            "--set estimators.efk.gate: estimator 'efk' does not exist; expected ekf, or a whole "
            "new entry, as in estimators.efk={KEY: VALUE}; did you mean 'ekf'?");
  EXPECT_EQ(error("estimators.efk.type", "iekf"),
            "--set estimators.efk.type: estimator 'efk' does not exist; expected ekf, or a whole "
            "new entry, as in estimators.efk={KEY: VALUE}; did you mean 'ekf'?");
  EXPECT_EQ(error("sensors.gps.sigma_m", "1"),
            "--set sensors.gps.sigma_m: sensor 'gps' does not exist; expected a whole new entry, "
            "as in sensors.gps={KEY: VALUE}");
  EXPECT_EQ(
      error("state.cam.noise.x", "1"),
      "--set state.cam.noise.x: state entry 'cam' does not exist; expected a whole new entry, "
      "as in state.cam={KEY: VALUE}");
  config.Set("estimators.ekf.rejection_recovery.after", "5", "--set");
  config.Set("estimators.ukf", "{type: ukf}", "--set");
  config.Set("estimators.ukf.gate", "0.9", "--set");
  config.Set("state", "{cam: {model: constant}}", "--set");
  config.Set("state.cam.size", "2", "--set");
  EXPECT_EQ(config.root().At("state").At("cam").At("size").Number(), 2.0);
}

TEST(ConfigSet, ValueIsReadStrictly) {
  EXPECT_EQ(SetError("a.x", "{k: 1, k: 2}"), "--set a.x.k: duplicate key");
  EXPECT_EQ(SetError("a.x", "[1"),
            "--set a.x: a list is used as a key, or '[' is not closed; expected text");
  EXPECT_EQ(SetError("a.x", "!foo 1"), "--set a.x: tag '!foo' is not supported");
  EXPECT_EQ(SetError("a.x", ""),
            "--set a.x: no value; expected a value, or \"\" for an empty text");
  EXPECT_EQ(SetError("a.x", "\"\""), "no error");
}

TEST(ConfigSet, KeyPathMustFitTheTree) {
  EXPECT_EQ(SetError("a.t.x", "1"),
            "--set a.t.x: 'a.t' is not a map; expected the whole map, as in a.t={x: VALUE}");
  EXPECT_EQ(SetError("a.b.x", "1"),
            "--set a.b.x: 'a.b' is not a map; expected an index of the list, as in a.b[0]");
  EXPECT_EQ(SetError("a[0]", "1"),
            "--set a[0]: 'a' is not a list; expected a list before each index");
  EXPECT_EQ(SetError("a.b[2]", "1"), "--set a.b[2]: 'a.b' has 2 items, numbered from 0");
  for (const char* key : {"", ".", "a..b", "a.", ".a", "a[", "a[]", "a[x]", "a[0", "a[0]b", "[0]",
                          "a[-1]", "a[99999999999999999999]"}) {
    EXPECT_NE(SetError(key, "1").find("not a key path"), std::string::npos) << key;
  }
}

// A file with these keys could not be read again.
TEST(ConfigSet, RefusesKeysThatAFileMayNotHave) {
  EXPECT_EQ(SetError("a.\xff", "1"), "--set: the key is not UTF-8");
  EXPECT_EQ(SetError("a.x\ny", "1").find("--set: the key contains a control character"), 0u);
  EXPECT_EQ(SetError("a." + std::string(257, 'x'), "1").find("--set: the key is longer than"), 0u);
}

TEST(ConfigSet, DepthIsLimited) {
  std::string key = "a";
  for (int i = 1; i < 63; ++i) key += ".a";
  Config config = Read("x: 1");
  EXPECT_NO_THROW(config.Set(key, "[1]", "--set"));
  EXPECT_NE(SetError(key, "[[1]]").find("nested too deep"), std::string::npos);
  EXPECT_NE(SetError(key + ".a.a", "1").find("nested too deep"), std::string::npos);
}

TEST(ConfigMerged, MapsMergeAndTheRestReplaces) {
  const Config config = Read(
      "sensors:\n  scale: {model: scale_2d, sigma_px: 1, span: [1, 2]}\n  stereo: {model: stereo}\n"
      "estimators:\n  loud:\n    overrides:\n"
      "      sensors: {scale: {sigma_px: 2x, span: [3]}, late: {model: gps}}\n");
  const Config merged = config.Merged(config.root().At("estimators").At("loud").At("overrides"));
  const Node scale = merged.root().At("sensors").At("scale");
  EXPECT_EQ(scale.At("model").Text(), "scale_2d");
  EXPECT_EQ(scale.At("span").Numbers(), std::vector<double>{3});
  EXPECT_EQ(merged.root().At("sensors").At("late").path(),
            "estimators.loud.overrides.sensors.late");
  EXPECT_EQ(Message([&] { scale.At("sigma_px").Number(); }),
            "f.yaml:7:35 estimators.loud.overrides.sensors.scale.sigma_px: '2x' is not a finite "
            "number; expected a number");
  EXPECT_EQ(config.root().At("sensors").At("scale").At("sigma_px").Number(), 1.0);
}

TEST(ConfigMerged, AnotherModelReplacesTheMap) {
  const Config config = Read(
      "a: {model: one, x: 1}\nb: {type: one, x: 1}\nc: {model: one, x: 1}\nd: {x: 1}\n"
      "over: {a: {model: two}, b: {type: two}, c: {model: one, y: 2}, d: {model: two}}\n");
  const Config merged = config.Merged(config.root().At("over"));
  EXPECT_EQ(merged.ToYaml().substr(0, merged.ToYaml().find("over")),
            "a:\n  model: two\nb:\n  type: two\nc:\n  model: one\n  x: 1\n  y: 2\n"
            "d:\n  x: 1\n  model: two\n");
}

TEST(ConfigMerged, DoesNotCopyReads) {
  const Config config = Read("a: 1\nover: {a: 2}\n");
  config.root().At("a");
  const Config merged = config.Merged(config.root().At("over"));
  EXPECT_EQ(Message([&] { merged.root().RejectUnread(); }),
            "f.yaml:2:8 over.a: unknown key\nf.yaml:2:1 over: unknown key");
  EXPECT_EQ(Message([&] { config.Merged(config.root().At("a")); }),
            "f.yaml:1:4 a: not a map; expected a map of keys to override");
}

TEST(ConfigToYaml, ReadsBackToTheSameTree) {
  const std::string yaml =
      "alidade: 1\n"
      "number: -1.50e-3\n"
      "dot: .5\n"
      "quoted: \"400\"\n"
      "word: \"yes\"\n"
      "nothing: null\n"
      "text: \"null\"\n"
      "path: data/run_1.csv\n"
      "url: \"https://a.b/c#d\"\n"
      "lines: \"a\\nb \\t\\\"q\\\" \\\\ \\x1b \xC3\xA9\"\n"
      "\"true\": \"\"\n"
      "\"a: b\": {}\n"
      "rows: [[1, 2], [3, \"x, y\"], [], {}]\n"
      "maps:\n"
      "  - a: 1\n"
      "    b:\n"
      "      c: [1]\n"
      "  - - d: 1\n"
      "    - 2\n"
      "  - \"-\"\n";
  const Config config = Read(yaml);
  EXPECT_EQ(config.ToYaml(), yaml);
  EXPECT_EQ(config.root().At("lines").Text(), "a\nb \t\"q\" \\ \x1b \xC3\xA9");
  EXPECT_EQ(config.root().At("maps").Items()[1].Items()[0].At("d").Number(), 1.0);
  EXPECT_NE(Message([&] { config.root().At("quoted").Number(); }), "no error");
}

TEST(ConfigToYaml, GivesPlainTextOneForm) {
  EXPECT_EQ(Read("b: 'text'\na: |\n  x\n").ToYaml(), "b: text\na: \"x\\n\"\n");
}

TEST(ConfigText, IncludeNeedsAFile) {
  EXPECT_EQ(Message([] { Read("a: 1\ninclude: b.yaml"); }),
            "f.yaml:2:1 include: only a config file can include another config");
}

}  // namespace
}  // namespace alidade
