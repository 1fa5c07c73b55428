// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <ctime>
#include <fstream>
#include <string>

#include "alidade/config/config.h"
#include "alidade/config/tree.h"
#include "support/temporary_folder.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;  // NOLINT(google-build-using-namespace)

/// Returns the error that `call` throws, in the form `CODE message`.
template <class Call>
std::string Failure(const Call& call) {
  try {
    call();
  } catch (const Error& e) {
    return std::to_string(static_cast<int>(e.code())) + ' ' + e.what();
  }
  return "no error";
}

std::string TextError(std::string_view text) {
  return Failure([&] { Config::FromText(text, "f"); });
}

std::string Repeated(std::string_view part, std::size_t size) {
  std::string text;
  while (text.size() < size) text += part;
  return text;
}

class ConfigFolder : public ::testing::Test {
 protected:
  fs::path Write(const std::string& name, const std::string& text) const {
    const fs::path file = folder_ / name;
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

  /// Returns the error that is thrown when the file `name` is read. In the message, `D/` replaces
  /// the path of the folder.
  std::string Fault(const std::string& name) const {
    std::string message = Failure([&] { Config::FromFile(folder_ / name); });
    const std::string folder = folder_.path().string();
    for (std::size_t at; (at = message.find(folder)) != std::string::npos;) {
      message.replace(at, folder.size(), "D");
    }
    return message;
  }

  testing::TemporaryFolder folder_;
};

TEST(ConfigFile, RefusesWhatIsNotStrict) {
  EXPECT_EQ(TextError("sensors:\n  stereo: {model: a}\n  scale: {model: b}\n  stereo: {}\n"),
            "78 f:4:3 sensors.stereo: duplicate key; the first one is at line 2");
  EXPECT_EQ(TextError("alidade: 1\na: &x [*x]\n"), "78 f:2:8 a: the alias refers to itself");
  EXPECT_EQ(TextError("sensors:\n\tstereo: {}\n"),
            "78 f:2:1: the indentation contains a tab; expected spaces");
  EXPECT_EQ(TextError("alidade: 1\nname: caf\xE9\n"),
            "78 f:2:10: invalid UTF-8; expected UTF-8 text");
  EXPECT_EQ(TextError("alidade: 1\nname: a\0b\n"sv), "78 f:2:8: the text contains a NUL byte");
  EXPECT_EQ(TextError("base: &base {sigma_px: 1}\nstereo:\n  <<: *base\n"),
            "78 f:3:3 stereo: merge key '<<' is not supported; expected the keys themselves");
  EXPECT_EQ(TextError("alidade: 1\n---\nalidade: 1\n"),
            "78 f:2:1: a second document begins here; expected one document in a file");
  EXPECT_EQ(TextError("# nothing but a comment\n"),
            "78 f: the file is empty; expected a map of keys");
}

TEST(ConfigFile, AcceptsByteOrderMarkAndCrlf) {
  const Config config = Config::FromText(
      "\xEF\xBB\xBF"
      "alidade: 1\r\nname: stereo\r\n",
      "f");
  EXPECT_EQ(config.root().At("alidade").Integer(1, 1), 1);
  EXPECT_EQ(config.root().At("name").Text(), "stereo");
  EXPECT_EQ(config.root().At("name").place().line, 2);
}

TEST(ConfigFile, NeverExpandsShellText) {
  const Config config =
      Config::FromText("home: $HOME\nlist: \"`ls` $(ls) ${HOME}\"\ntilde: ~/data\n", "f");
  EXPECT_EQ(config.root().At("home").Text(), "$HOME");
  EXPECT_EQ(config.root().At("list").Text(), "`ls` $(ls) ${HOME}");
  EXPECT_EQ(config.root().At("tilde").Text(), "~/data");
}

TEST(ConfigFile, AliasBombStaysSmall) {
  static_assert(internal::Budget::kMaxNodes * sizeof(ConfigTree) < 32u << 20);
  std::string bomb = "a: &a [x, x, x, x, x, x, x, x, x]\n";
  for (char key = 'b'; key <= 'i'; ++key) {
    const std::string alias = "*" + std::string(1, static_cast<char>(key - 1));
    bomb += std::string(1, key) + ": &" + key + " [" + Repeated(alias + ", ", 9 * 4) + "]\n";
  }
  EXPECT_EQ(TextError(bomb),
            "78 f:6:8 f: the config is too large after its aliases are expanded; expected at most "
            "100000 values");
  const std::string lines = "a: &a \"" + std::string(500'000, 'x') + "\"\nb: [";
  EXPECT_EQ(
      TextError(lines + Repeated("*a, ", 40'000) + "]"),
      "78 f:2:65 b: the config is too large after its aliases are expanded; expected at most 8 "
      "MiB of text");
}

TEST(ConfigFile, AliasIsACopy) {
  const Config config = Config::FromText("a: &x {b: [1, 2]}\nc: *x\n", "f");
  const Node copy = config.root().At("c").At("b").Items()[1];
  EXPECT_EQ(copy.Number(), 2.0);
  EXPECT_EQ(copy.path(), "c.b[1]");
  EXPECT_EQ(copy.place().line, 1);
}

TEST(ConfigFile, DeepNestingFailsEarly) {
  constexpr std::size_t kSize = 1'000'000;
  const std::clock_t start = std::clock();
  for (const char* part : {"[", "{a: ", "- ", "[\n", "[{"}) {
    const std::string message = TextError(Repeated(part, kSize));
    EXPECT_NE(message.find("nested too deep; expected at most 64 levels"), std::string::npos)
        << part << message;
  }
  std::string chain = "a0: &a0 [1]\n";
  for (int i = 1; i < 20'000; ++i) {
    const std::string last = std::to_string(i - 1), next = std::to_string(i);
    chain += "a" + next + ": &a" + next + " [*a" + last + "]\n";
  }
  EXPECT_NE(TextError(Repeated("? ", kSize)), "no error");
  EXPECT_EQ(TextError(chain), "78 f:64:12: nested too deep; expected at most 64 levels");
  // Parsing takes about 10 ms. A scanner that read the text to its end would need seconds in a
  // debug build.
  EXPECT_LT(std::clock() - start, 2 * CLOCKS_PER_SEC);
}

TEST(ConfigFile, SixtyFourLevelsAreRead) {
  const std::string open = "a: " + Repeated("[", 63), close = Repeated("]", 63);
  EXPECT_EQ(TextError(open + close), "no error");
  EXPECT_EQ(TextError(open + "[" + "]" + close),
            "78 f:1:67: nested too deep; expected at most 64 levels");
}

TEST(ConfigFile, OneMebibyteIsTheLimit) {
  const std::string text = "a: 1\n#";
  constexpr std::size_t kLimit = 1 << 20;
  EXPECT_EQ(TextError(text + std::string(kLimit - text.size(), 'x')), "no error");
  EXPECT_EQ(TextError(text + std::string(kLimit + 1 - text.size(), 'x')),
            "78 f: the config is larger than 1 MiB; expected at most 1 MiB");
}

TEST(ConfigFile, RefusesOddEncodings) {
  EXPECT_EQ(TextError("a: \xC0\x80"), "78 f:1:4: invalid UTF-8; expected UTF-8 text");
  EXPECT_EQ(TextError("a: \xED\xA0\x80"), "78 f:1:4: invalid UTF-8; expected UTF-8 text");
  EXPECT_EQ(TextError("a: \xF4\x90\x80\x80"), "78 f:1:4: invalid UTF-8; expected UTF-8 text");
  EXPECT_EQ(TextError("a: \xE2\x82"), "78 f:1:4: invalid UTF-8; expected UTF-8 text");
  EXPECT_EQ(TextError("\xFF\xFE"
                      "a"),
            "78 f:1:1: invalid UTF-8; expected UTF-8 text");
  EXPECT_EQ(TextError("a: 1\n\xEF\xBB\xBF"
                      "b: 1"),
            "78 f:2:1: a byte order mark is allowed only at the start of the text");
  EXPECT_EQ(TextError("a: 1\rb: 1"), "78 f:1:5: a carriage return is not followed by a line feed");
  EXPECT_EQ(TextError("a: 1\n%anything"),
            "78 f:2:1: the line begins with '%'; expected quotes around a text that begins with "
            "'%'");
  EXPECT_EQ(TextError("# first\n%YAML 1.2\n---\na: 1"), "no error");
  EXPECT_EQ(TextError("a: \x07"), "78 f:1:4: control character 0x07 is not allowed");
  EXPECT_EQ(TextError("a: \"\\0\""), "78 f:1:4 a: the text contains a NUL character");
  EXPECT_EQ(TextError("a: \"\\_\""), "78 f:1:4 a: the escape sequence is not a valid character");
  EXPECT_EQ(TextError("a: \xF0\x9F\xA7\xAD \xC3\xA9 \xE2\x82\xAC"), "no error");
}

TEST(ConfigFile, RefusesOddKeysAndTags) {
  EXPECT_EQ(TextError("? [a]\n: 1"),
            "78 f:1:3: a list is used as a key, or '[' is not closed; expected text");
  EXPECT_EQ(TextError("{{a: 1}: 1}"),
            "78 f:1:2: a map is used as a key, or '{' is not closed; expected text");
  EXPECT_EQ(TextError("a: {'': 1}"), "78 f:1:5 a: empty key; expected text");
  EXPECT_EQ(TextError("~: 1"), "78 f:1:1: empty key; expected text");
  EXPECT_EQ(TextError("a: &x b\n*x : 1"), "78 f:2:1: an alias is used as a key; expected text");
  EXPECT_EQ(TextError("a: !env HOME"), "78 f:1:4 a: tag '!env' is not supported");
  EXPECT_EQ(TextError("a: !!int 1"), "78 f:1:4 a: tag '!!int' is not supported");
}

TEST(ConfigFile, SyntaxErrorsHavePlaceAndKey) {
  EXPECT_EQ(TextError("a:\n  b: [1, 2\n"),
            "78 f:2:6 a.b: not valid YAML: '[' is not closed, or a comma is missing");
  EXPECT_EQ(
      TextError("a:\n    b: 1\n  c: 2\n"),
      "78 f:3:3: not valid YAML: wrong indentation, or text after a value; expected a key of the "
      "file in column 1");
  EXPECT_EQ(TextError("a:\n  b:\n    c: 1\n   d: 2\n"),
            "78 f:4:4 a: not valid YAML: wrong indentation, or text after a value; expected 2 "
            "spaces before each key of 'a'");
  EXPECT_EQ(TextError("a: *nothing"),
            "78 f:1:4 a: not valid YAML: the referenced anchor is not defined");
  EXPECT_EQ(TextError("a:1"), "78 f:1:1: 'a:1'; expected a map of keys, as in 'key: value'");
  EXPECT_EQ(TextError("a: 1\n...\nb: 1"),
            "78 f:3:1: text after the end of the document; expected one document in a file");
}

TEST_F(ConfigFolder, MissingFileAndFolderAreInputMissing) {
  EXPECT_EQ(Fault("no.yaml"), "66 D/no.yaml: cannot be read: No such file or directory");
  EXPECT_EQ(Fault(""), "66 D/: cannot be read: it is a directory");
}

TEST_F(ConfigFolder, UnreadableFileIsInputMissing) {
  const fs::path file = Write("f.yaml", "a: 1");
  fs::permissions(folder_.path(), fs::perms(0755));
  fs::permissions(file, fs::perms::none);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {  // the user root can read every file
    const bool dropped = geteuid() != 0 || seteuid(65534) == 0;
    _exit(!dropped                                                              ? 2
          : Fault("f.yaml") == "66 D/f.yaml: cannot be read: Permission denied" ? 0
                                                                                : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "this process cannot drop the privileges of root";
  EXPECT_EQ(status, 0);
}

TEST_F(ConfigFolder, IncludeLiesBelowTheFile) {
  Write("parts/base.yaml", "include: deeper.yaml\nb: {x: 1, y: 2}\nc: 3\n");
  Write("parts/deeper.yaml", "c: 4\nd: 5\n");
  Write("second.yaml", "b: {y: 6}\n");
  const Config config = Config::FromFile(
      Write("f.yaml", "include: [parts/base.yaml, second.yaml]\nb: {x: 7}\na: [1]\n"));
  EXPECT_EQ(config.ToYaml(), "c: 3\nd: 5\nb:\n  x: 7\n  y: 6\na: [1]\n");
  const Node inherited = config.root().At("d");
  EXPECT_EQ(ToString(inherited.place()), (folder_ / "parts/deeper.yaml:2:4").string());
  EXPECT_EQ(config.folder(), folder_.path());
}

TEST_F(ConfigFolder, RelativePathsAreTakenFromTheFileThatHasThem) {
  Write("parts/base.yaml", "source: {path: a.csv}\nplugins: [../x.so, /y.so]\n");
  const fs::path file = Write("f.yaml", "include: parts/base.yaml\nsource: {type: tables}\n");
  const Config config = Config::FromFile(file);
  EXPECT_EQ(config.root().At("source").At("path").Text(), (folder_ / "parts/a.csv").string());
  const std::vector<Node> plugins = config.root().At("plugins").Items();
  EXPECT_EQ(plugins[0].Text(), (folder_ / "parts/../x.so").string());
  EXPECT_EQ(plugins[1].Text(), "/y.so");
  // The written config has the same meaning if it is stored in another folder.
  const Config again = Config::FromFile(Write("elsewhere/g.yaml", config.ToYaml()));
  EXPECT_EQ(again.ToYaml(), config.ToYaml());
}

TEST_F(ConfigFolder, CyclicIncludeIsRefused) {
  Write("a.yaml", "include: b.yaml");
  Write("b.yaml", "x: 1\ninclude: ./a.yaml");
  EXPECT_EQ(Fault("a.yaml"), "78 D/b.yaml:2:10 include: 'D/./a.yaml' includes itself");
}

TEST_F(ConfigFolder, IncludesThatMultiplyAreRefused) {
  for (int i = 0; i < 30; ++i) {
    const std::string next = std::to_string(i + 1) + ".yaml";
    Write(std::to_string(i) + ".yaml", "include: [" + next + ", " + next + "]");
  }
  Write("30.yaml", "a: 1");
  EXPECT_NE(Fault("0.yaml").find("too many includes; expected at most 64 files"),
            std::string::npos);
}

TEST_F(ConfigFolder, IncludeErrorsNameTheInclude) {
  Write("f.yaml", "a: 1\ninclude: no.yaml");
  EXPECT_EQ(Fault("f.yaml"),
            "66 D/f.yaml:2:10 include: 'D/no.yaml' cannot be read: No such file or directory");
  Write("f.yaml", "include: [{a: 1}]");
  EXPECT_EQ(
      Fault("f.yaml"),
      "78 D/f.yaml:1:11 include[0]: not a file name; expected a file name or a list of file names");
}

TEST_F(ConfigFolder, IncludeOutsideIsNotTrusted) {
  Write("secret.yaml", "a: 1");
  const fs::path outside = folder_ / "secret.yaml";
  fs::create_directory(folder_ / "run");
  fs::create_symlink(outside, folder_ / "run/link.yaml");
  fs::create_symlink(folder_ / "nothing", folder_ / "run/dangling.yaml");
  fs::create_symlink("loop.yaml", folder_ / "run/loop.yaml");
  for (const std::string& name :
       {std::string("../secret.yaml"), outside.string(), std::string("link.yaml"),
        std::string("dangling.yaml"), std::string("loop.yaml"), std::string("x/../../run2/a")}) {
    Write("run/f.yaml", "include: " + name);
    const std::string message = Fault("run/f.yaml");
    EXPECT_EQ(message.substr(0, 31), "77 D/run/f.yaml:1:10 include: '") << name;
  }
  Write("run/f.yaml", "include: ../secret.yaml");
  EXPECT_EQ(Config::FromFile(folder_ / "run/f.yaml", true).ToYaml(), "a: 1\n");
}

TEST_F(ConfigFolder, ResolveInsideKeepsWhatStaysInside) {
  Write("sub/f", "");
  fs::create_symlink("sub", folder_ / "link");
  const auto resolve = [&](const std::string& path) {
    return ResolveInside(folder_.path(), path, false, Place{"f"}, "source.path");
  };
  EXPECT_EQ(resolve("link/f"), folder_ / "link/f");
  EXPECT_EQ(resolve("sub/../sub/f"), folder_ / "sub/../sub/f");
  EXPECT_EQ(resolve("new/file"), folder_ / "new/file");
  EXPECT_EQ(resolve((folder_ / "sub/f").string()), folder_ / "sub/f");
  EXPECT_EQ(
      Failure([&] { resolve("../" + folder_.path().filename().string() + "2/f"); }).substr(0, 20),
      "77 f source.path: '.");
}

}  // namespace
}  // namespace alidade
