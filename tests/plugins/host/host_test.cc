// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <algorithm>
#include <fstream>

#include "alidade/plugin/cpp_plugin.h"
#include "alidade/plugin/create.h"
#include "host_fixture.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

double Predicted(const SharedSensor& sensor, double x) {
  const double* roles[] = {&x};
  double z = 0.0;
  EXPECT_EQ(sensor->Predict(roles, &z), Status::kOk);
  return z;
}

TEST_F(HostTest, LoadsAPluginAndCreatesItsModel) {
  const PluginHost host({Built("good")});
  const auto has_name = [](const PluginEntry& entry) { return entry.name == "probe"; };
  const auto found = std::find_if(host.entries().begin(), host.entries().end(), has_name);
  ASSERT_NE(found, host.entries().end());
  EXPECT_EQ(found->kind, kSensorKind);
  EXPECT_EQ(found->doc, "gain times x");
  EXPECT_EQ(found->plugin, fs::canonical(Built("good")));
  const Config config = Parse("model: probe");
  EXPECT_EQ(Predicted(host.CreateSensor("probe", config.root()), 3.0), 6.0);
}

TEST_F(HostTest, FindsTheShippedModelsBesideTheProgram) {
  const PluginHost host;
  for (const char* name : {"stereo_disparity", "scale_2d", "constant", "constant_velocity"}) {
    const auto has_name = [&](const PluginEntry& entry) { return entry.name == name; };
    EXPECT_EQ(std::count_if(host.entries().begin(), host.entries().end(), has_name), 1) << name;
  }
}

TEST_F(HostTest, RunsASensorOfOneFileBuiltByABareCommandLine) {
  const PluginHost host({Built("range_rate")});
  const Config config = Parse("sensors:\n  radar: {model: range_rate, sigma_m_s: 0.5}");
  const Node entry = config.root().At("sensors").At("radar");
  const SharedSensor radar = host.CreateSensor("range_rate", entry);
  const double p[2] = {3.0, 4.0}, v[2] = {10.0, 0.0};
  const double* roles[] = {p, v};
  double z = 0.0, l = 0.0, by_p[2], by_v[2];
  double* jacobians[] = {by_p, by_v};
  const int strides[] = {2, 2};
  ASSERT_EQ(radar->Linearise(roles, &z, jacobians, strides), Status::kOk);
  ASSERT_EQ(radar->SqrtNoise(roles, &z, &l), Status::kOk);
  EXPECT_DOUBLE_EQ(z, 6.0);  // 3 * 10 / 5
  EXPECT_DOUBLE_EQ(by_v[0], 0.6);
  EXPECT_DOUBLE_EQ(by_v[1], 0.8);
  EXPECT_DOUBLE_EQ(by_p[0], 10.0 / 5.0 - 6.0 * 3.0 / 25.0);
  EXPECT_EQ(l, 0.5);
}

TEST_F(HostTest, StructsOfOneNameInTwoPluginsStayApart) {
  // Both plugins define `struct Probe` with default visibility, and both plugins are open at the
  // same time.
  const PluginHost two({Built("twin_two")}), three({Built("twin_three")});
  const Config config = Parse("model: probe");
  EXPECT_EQ(Predicted(two.CreateSensor("probe", config.root()), 1.0), 2.0);
  EXPECT_EQ(Predicted(three.CreateSensor("probe", config.root()), 1.0), 3.0);
}

TEST_F(HostTest, FindsPluginsOfTheEnvironmentAndTheUser) {
  Copy("good", "path/good.so");
  Copy("range_rate", "user/alidade/plugins/range_rate.so");
  setenv("ALIDADE_PLUGIN_PATH", ("/nowhere:" + (folder_ / "path").string()).c_str(), 1);
  setenv("XDG_DATA_HOME", (folder_ / "user").c_str(), 1);
  const PluginHost host;
  const Config config = Parse("{model: any, sigma_m_s: 1}");
  EXPECT_NO_THROW(host.CreateSensor("probe", config.root()));
  EXPECT_NO_THROW(host.CreateSensor("range_rate", config.root()));
  ASSERT_GE(host.searched().size(), 4u);
  EXPECT_EQ(host.searched()[0], "/nowhere (ALIDADE_PLUGIN_PATH): does not exist");
  EXPECT_EQ(host.searched()[1],
            (folder_ / "path").string() + " (ALIDADE_PLUGIN_PATH): 1 entry found");
}

TEST_F(HostTest, LeavesPluginsClosedOfWhichNoNameIsAskedFor) {
  for (const char* const name : {"good", "range_rate", "later"}) {
    Copy(name, "path/" + std::string(name) + ".so");
  }
  setenv("ALIDADE_PLUGIN_PATH", (folder_ / "path").c_str(), 1);
  const std::set<std::string> only = {"probe", "prob", "rate"};
  const auto offers = [](const PluginHost& host, const std::string& name) {
    return std::ranges::count(host.entries(), name, &PluginEntry::name) == 1;
  };
  const PluginHost host({}, OnRefusal::kThrow, only);
  EXPECT_TRUE(offers(host, "probe"));
  EXPECT_TRUE(offers(host, "later_sensor"));  // this plugin does not list its names
  EXPECT_FALSE(offers(host, "range_rate"));
  EXPECT_FALSE(offers(host, "constant"));
  EXPECT_TRUE(offers(host.WithAllPlugins(), "range_rate"));
  EXPECT_TRUE(offers(host.WithAllPlugins(), "constant"));
  // Explicitly given plugins are opened even if no name in them is requested. An error message
  // considers the models of all plugins.
  EXPECT_TRUE(offers(PluginHost({folder_ / "path"}, OnRefusal::kThrow, only), "range_rate"));
  const Config config = Parse("model: rate");
  ExpectError(ExitCode::kPlugin, {"no plugin offers the sensor 'range_rat'", "'range_rate'?"},
              [&] { host.CreateSensor("range_rat", config.root()); });
  ExpectError(
      ExitCode::kPlugin,
      {"the sensor 'range_rate' of " + fs::canonical(folder_ / "path/range_rate.so").string(),
       "was requested, but the config does not contain its name"},
      [&] { host.CreateSensor("range_rate", config.root()); });
  Copy("good", "path/good_too.so");
  const PluginHost twice({}, OnRefusal::kThrow, only);
  ExpectError(ExitCode::kPlugin, {"two plugins offer the sensor 'probe'"},
              [&] { twice.CreateSensor("probe", config.root()); });
}

TEST_F(HostTest, EveryShippedPluginListsItsNames) {
  EXPECT_GT(PluginHost().entries().size(), 10u);
  const PluginHost none({}, OnRefusal::kThrow, std::set<std::string>{"of no plugin"});
  for (const PluginEntry& entry : none.entries()) {
    ADD_FAILURE() << entry.plugin << " was opened";
  }
}

// ---- fault 50 of tests/faults/README.md: missing ------------------------------------------------

TEST_F(HostTest, AMissingModelNamesPlaceAndSuggestion) {
  const PluginHost host({Built("good")});
  const Config config = Parse("sensors:\n  s: {model: prob}");
  const Node entry = config.root().At("sensors").At("s");
  try {
    host.CreateSensor("prob", entry);
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kPlugin);
    EXPECT_STREQ(e.what(),
                 "test.yaml:2:14 sensors.s.model: no plugin offers the sensor 'prob'; did you mean "
                 "'probe'?");
  }
  ExpectError(ExitCode::kPlugin, {"no plugin offers the motion model 'probe'", "there is a sensor"},
              [&] { host.CreateMotion("probe", entry); });
}

TEST_F(HostTest, AMissingModelNamesWhatIsOfferedAndWhere) {
  const PluginHost host({Built("good")});
  const Config config = Parse("model: barometer");
  ExpectError(ExitCode::kPlugin,
              {"no plugin offers the sensor 'barometer'; expected one of ", "pose, ", "probe, ",
               "searched " + Built("good").string() + " (config or command line): 1 entry found",
               "no_user_data/alidade/plugins (user data folder): does not exist"},
              [&] { host.CreateSensor("barometer", config.root()); });
}

TEST_F(HostTest, AMissingModelNamesWhatWasRefusedAndWhy) {
  Copy("other_abi", "path/other_abi.so");
  setenv("ALIDADE_PLUGIN_PATH", (folder_ / "path").c_str(), 1);
  const PluginHost host;
  ASSERT_EQ(host.refusals().size(), 1u);
  EXPECT_EQ(host.refusals()[0].code, ExitCode::kPlugin);
  const Config config = Parse("model: probe");
  ExpectError(ExitCode::kPlugin,
              {"refused " + (folder_ / "path/other_abi.so").string(), "built for plugin ABI 99.1"},
              [&] { host.CreateSensor("probe", config.root()); });
}

TEST_F(HostTest, AGivenPlaceThatIsNotThereIsAnError) {
  ExpectRefused("/nowhere/x.so", {"no such file or folder"});
}

// ---- fault 51 of tests/faults/README.md: not a plugin -------------------------------------------

TEST_F(HostTest, AFileThatIsNotAPluginIsRefused) {
  const fs::path text = folder_ / "text.so", empty = folder_ / "empty.so", pipe = folder_ / "p.so";
  std::ofstream(text) << "#!/bin/sh\necho a script is not a plugin, however long it may be\n";
  std::ofstream(empty).flush();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const fs::path& file : {text, empty, pipe}) {
    ExpectRefused(file, {"has no alidade build tag: it is not an alidade plugin"});
  }
  const fs::path folder = folder_ / "folder.so";
  fs::create_directory(folder);
  EXPECT_NO_THROW(PluginHost({folder})) << "a folder with any name is searched";
}

TEST_F(HostTest, ATruncatedPluginIsRefused) {
  const auto size = fs::file_size(Built("good"));
  for (const double part : {0.0005, 0.004, 0.1, 0.5, 0.9, 0.999}) {
    const fs::path file = Copy("good", "part" + std::to_string(part) + ".so");
    fs::resize_file(file, static_cast<std::uintmax_t>(part * static_cast<double>(size)));
    ExpectRefused(file, {"has no alidade build tag", "is damaged"});
  }
}

TEST_F(HostTest, APluginForAnotherKindOfProcessorIsRefused) {
  const fs::path file = Copy("good", "good.so");
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(18);  // the field e_machine of the ELF header
  stream.put(2);     // the value for SPARC
  stream.close();
  ExpectRefused(file, {"has no alidade build tag", "is for another kind of processor"});
}

// ---- faults 52 to 55 of tests/faults/README.md: build tag and loading ---------------------------

TEST_F(HostTest, AFileWithoutBuildTagIsRefused) {
  ExpectRefused(Built("no_build_tag"), {"has no alidade build tag"});
}

// Tests fault 53 of tests/faults/README.md.
TEST_F(HostTest, AnotherAbiIsRefused) {
  ExpectRefused(Built("other_abi"),
                {"built for plugin ABI 99.1", "this program has 1.1", "rebuild the plugin"});
}

TEST_F(HostTest, InstructionsThatTheProcessorLacksAreRefused) {
  ExpectRefused(Built("other_processor"), {"needs an instruction set that this processor lacks"});
}

TEST_F(HostTest, ABuildTagThatAsksForMoreThanThisHostIsRefused) {
  ExpectRefused(Built("needs_minor"), {"needs plugin ABI 1.3", "this program has 1.1"});
  ExpectRefused(Built("later_flag"), {"flags that this version does not know: 0x8000000"});
  ExpectRefused(Built("reserved_tag"), {"its build tag uses reserved members"});
  const PluginHost host({Built("later_hint")});
  EXPECT_EQ(std::ranges::count(host.entries(), "probe", &PluginEntry::name), 1);
}

TEST_F(HostTest, ACppPluginOfAnotherAbiNumberIsRefusedWithBothNumbers) {
  ExpectRefused(
      Built("other_cpp_abi"),
      {"a C++ plugin for ABI number 'other', but this program has '" ALIDADE_CPP_ABI "'"});
}

// Tests fault 55 of tests/faults/README.md.
TEST_F(HostTest, AMissingSymbolIsNamedAtLoad) {
  ExpectRefused(Built("undefined_symbol"), {"cannot be loaded", "a_function_nobody_defines"});
}

TEST_F(HostTest, ABadTableIsRefused) {
  const std::pair<const char*, const char*> faults[] = {
      {"MAGIC", "wrong magic number"},
      {"STRUCT_SIZE", "table states a size of 8 bytes"},
      {"STRIDE", "entry stride of 3 bytes"},
      {"NULL_NAME", "entry 1 of its table has no valid name"},
      {"NULL_TABLE", "its table is null"},
      {"NO_CREATE", "entry 1 of its table has no create function"},
      {"NAME_TWICE", "names 'probe' twice"},
      {"NO_ENTRY_SYMBOL", "undefined symbol: alidade_plugin"},
      {"UNKNOWN_FLAGS", "entry 1 of its table has flags that this version does not know: 0x100000"},
      {"UNKNOWN_THREAD_FLAGS", "entry 1 of its table has flags that this version does not know"},
      {"RESERVED", "its table uses reserved members"},
      {"CONTROL_CHARACTER", "entry 1 of its table has a doc that has a control character"},
      {"EMPTY", "table has 0 entries"}};
  for (const auto& [fault, words] : faults) {
    ExpectRefused(Built(std::string("table_") + fault), {words});
  }
}

TEST_F(HostTest, AnEntryOfUnknownKindIsLeftOutAndListed) {
  const PluginHost host({Built("table_UNKNOWN_KIND")});
  const auto named = [](const char* name) {
    return [name](const PluginEntry& entry) { return entry.name == name; };
  };
  EXPECT_EQ(std::ranges::count_if(host.entries(), named("probe")), 1);
  EXPECT_EQ(std::ranges::count_if(host.entries(), named("other_probe")), 0);
  const auto told = [](const Refusal& refusal) {
    return refusal.reason.find("its entry 'other_probe' is of kind 9") == 0;
  };
  EXPECT_EQ(std::ranges::count_if(host.refusals(), told), 1);
}

TEST_F(HostTest, AFlagThatNeedNotBeUnderstoodIsIgnored) {
  const PluginHost host({Built("table_LATER_HINT")});
  EXPECT_EQ(std::ranges::count(host.entries(), "other_probe", &PluginEntry::name), 1);
}

// ---- faults 56, 57 of tests/faults/README.md: two files, one name; one file, two names ----------

TEST_F(HostTest, TwoPluginsWithOneNameAreAnErrorOnceItIsAskedFor) {
  const fs::path a = Copy("good", "a.so"), b = Copy("good", "b.so");
  const PluginHost host({folder_.path()});
  const Config config = Parse("model: probe");
  ExpectError(ExitCode::kPlugin, {"two plugins offer the sensor 'probe'", a.string(), b.string()},
              [&] { host.CreateSensor("probe", config.root()); });
}

TEST_F(HostTest, OneFileUnderManyNamesIsLoadedOnce) {
  const fs::path file = Copy("good", "good.so");
  fs::create_symlink(file, folder_ / "link.so");
  fs::create_hard_link(file, folder_ / "hard.so");
  const PluginHost host({file, folder_ / "link.so", folder_ / "." / "good.so", folder_.path()});
  const auto has_name = [](const PluginEntry& entry) { return entry.name == "probe"; };
  EXPECT_EQ(std::count_if(host.entries().begin(), host.entries().end(), has_name), 1);
}

// ---- fault 58 of tests/faults/README.md: failures while creating --------------------------------

TEST_F(HostTest, AnExceptionInCreateNamesModelAndPlugin) {
  const PluginHost host({Built("bad_create")});
  const Config config = Parse("sensors:\n  s: {model: throws}");
  const Node entry = config.root().At("sensors").At("s");
  ExpectError(ExitCode::kPlugin,
              {"test.yaml:2", "sensors.s", "model 'throws'", Built("bad_create").string(),
               "the dog ate it"},
              [&] { host.CreateSensor("throws", entry); });
  ExpectError(ExitCode::kPlugin, {"model 'throws_int'", "an exception of unknown type"},
              [&] { host.CreateSensor("throws_int", entry); });
  ExpectError(ExitCode::kPlugin,
              {"model 'wrong_kind'", "its kind differs from the kind in the plugin's table"},
              [&] { host.CreateSensor("wrong_kind", entry); });
}

TEST_F(HostTest, ParametersThatDoNotFitTogetherAreABadConfig) {
  const PluginHost host({Built("bad_create")});
  const Config far = Parse("model: misfit\nnear_m: 2\nfar_m: 1");
  ExpectError(ExitCode::kBadConfig, {"test.yaml:3:8 far_m: is not beyond near_m"},
              [&] { host.CreateSensor("misfit", far.root()); });
  const Config unlucky = Parse("{model: misfit, near_m: 13, far_m: 14}");
  ExpectError(ExitCode::kBadConfig, {"near and far are unlucky together"},
              [&] { host.CreateSensor("misfit", unlucky.root()); });
}

TEST_F(HostTest, MoreParametersThanThereMayBeAreRefused) {
  const PluginHost host({Built("bad_create")});
  const Config one = Parse("{model: asks_much, distinct: false}");
  EXPECT_NO_THROW(host.CreateSensor("asks_much", one.root()));
  const Config much = Parse("{model: asks_much, distinct: true}");
  ExpectError(ExitCode::kPlugin, {"model 'asks_much' requests more than 4096 parameters"},
              [&] { host.CreateSensor("asks_much", much.root()); });
}

TEST_F(HostTest, WhatAModelSaysIsOneLineOfUtf8) {
  const PluginHost host({Built("bad_create")});
  const Config config = Parse("model: forges");
  ExpectError(ExitCode::kBadConfig, {"forged?error: key: one?error: two ?[31m? \u03bb"},
              [&] { host.CreateSensor("forges", config.root()); });
}

TEST_F(HostTest, AModelReadsTexts) {
  const PluginHost host({Built("bad_create")});
  const Config given = Parse("{model: titled, title: \"a 'b' \u03bb\", needed: x y}");
  ExpectError(ExitCode::kBadConfig, {"a 'b' \u03bb|x y"},
              [&] { host.CreateSensor("titled", given.root()); });
  const Config by_default = Parse("{model: titled, needed: 1}");
  ExpectError(ExitCode::kBadConfig, {"nameless|1"},
              [&] { host.CreateSensor("titled", by_default.root()); });
  const Config missing = Parse("{model: titled}");
  ExpectError(ExitCode::kBadConfig, {"needed: missing", "what it cannot do without"},
              [&] { host.CreateSensor("titled", missing.root()); });
  const Config control = Parse("{model: titled, needed: \"a\\tb\"}");
  ExpectError(ExitCode::kBadConfig, {"needed", "has a control character"},
              [&] { host.CreateSensor("titled", control.root()); });
  const auto titled = std::ranges::find(host.entries(), "titled", &PluginEntry::name);
  ASSERT_NE(titled, host.entries().end());
  const std::vector<ParamInfo> schema = ModelSchema(*titled);
  const auto title = std::ranges::find(schema, "title", &ParamInfo::key);
  ASSERT_NE(title, schema.end());
  EXPECT_EQ(title->type, "text");
  EXPECT_EQ(title->fallback, "nameless");
}

TEST_F(HostTest, AParameterDeclaredAgainstTheRulesIsRefused) {
  const PluginHost host({Built("bad_create")});
  for (const char* name : {"no_key", "gap_in_key"}) {
    const Config config = Parse("{}");
    ExpectError(
        ExitCode::kPlugin,
        {std::string("model '") + name + "' requests parameter '", "its key is not a valid name"},
        [&] { host.CreateSensor(name, config.root()); });
  }
  for (const char* name : {"no_default", "no_number", "two_choices", "any_choices",
                           "default_beyond", "later_flag", "reserved_member", "empty_range",
                           "many_choices", "half", "huge", "outside", "text_as_number"}) {
    const Config config = Parse(std::string("{model: ") + name + '}');
    // The declaration is also invalid if the config contains the parameter.
    const Config given = Parse(std::string("{model: ") + name + ", noise: [fixed, free]}");
    for (const Config* one : {&config, &given}) {
      ExpectError(ExitCode::kPlugin,
                  {"test.yaml:1", std::string("model '") + name + "' requests parameter 'noise'"},
                  [&] { host.CreateSensor(name, one->root()); });
    }
    const auto has_name = [&](const PluginEntry& entry) { return entry.name == name; };
    const auto entry = std::find_if(host.entries().begin(), host.entries().end(), has_name);
    ASSERT_NE(entry, host.entries().end());
    EXPECT_TRUE(ModelSchema(*entry).empty()) << name;
  }
}

// ---- parameters ---------------------------------------------------------------------------------

TEST_F(HostTest, AllBadParametersAreToldAtOnce) {
  const PluginHost host;
  const Config config =
      Parse("sensors:\n  s: {model: stereo_disparity, focal_px: -1, min_range_m: [1]}");
  const Node entry = config.root().At("sensors").At("s");
  ExpectError(
      ExitCode::kBadConfig,
      {"sensors.s.baseline_m: missing; model 'stereo_disparity' needs it (m, > 0: stereo "
       "baseline)",
       "sensors.s.sigma_px: missing", "sensors.s.focal_px", "'-1'", "sensors.s.min_range_m"},
      [&] { host.CreateSensor("stereo_disparity", entry); });
}

TEST_F(HostTest, ADottedKeyWalksNestedMaps) {
  const PluginHost host;
  const Config good =
      Parse("{model: constant_velocity, noise: {acceleration: 2, kind: continuous}}");
  EXPECT_EQ(host.CreateMotion("constant_velocity", good.root())->noise_size(), 2);
  EXPECT_NO_THROW(good.root().At("noise").RejectUnread());
  const Config none = Parse("state: {cam: {model: constant_velocity}}");
  ExpectError(ExitCode::kBadConfig, {"state.cam.noise.acceleration: missing", "(m/s^1.5, >= 0"},
              [&] { host.CreateMotion("constant_velocity", none.root().At("state").At("cam")); });
  const Config scalar = Parse("{model: constant_velocity, noise: 3}");
  ExpectError(ExitCode::kBadConfig, {"noise: ", "map"},
              [&] { host.CreateMotion("constant_velocity", scalar.root()); });
}

TEST_F(HostTest, KeysThatTheModelDoesNotReadAreLeftToTheConfig) {
  const PluginHost host({Built("good")});
  const Config config = Parse("{model: probe, gian: 2}");
  static_cast<void>(config.root().At("model"));
  EXPECT_NO_THROW(host.CreateSensor("probe", config.root()));
  EXPECT_THROW(config.root().RejectUnread(), Error);
}

TEST_F(HostTest, TheSchemaTellsWhatEachChoiceReads) {
  const PluginHost host;
  const auto schema = [&](const std::string& name) {
    const auto has_name = [&](const PluginEntry& entry) { return entry.name == name; };
    return ModelSchema(*std::find_if(host.entries().begin(), host.entries().end(), has_name));
  };
  const std::vector<ParamInfo> scale = schema("scale_2d");
  EXPECT_EQ(Param(scale, "noise_model").type, "choice");
  EXPECT_EQ(Param(scale, "noise_model").choices,
            (std::vector<std::string>{"propagated", "constant"}));
  EXPECT_EQ(Param(scale, "noise_model").fallback, "propagated");
  EXPECT_EQ(Param(scale, "noise_model").condition, "");
  EXPECT_EQ(Param(scale, "sigma_inverse_scale").condition, "noise_model = constant");
  EXPECT_EQ(Param(scale, "sigma_px").condition, "noise_model = propagated");
  EXPECT_EQ(Param(scale, "sigma_px").range, "> 0");
  EXPECT_EQ(Param(scale, "sigma_px").unit, "px");
  const std::vector<ParamInfo> motion = schema("constant_velocity");
  EXPECT_EQ(Param(motion, "dimensions").range, "[1, 3]");
  EXPECT_EQ(Param(motion, "dimensions").fallback, "1");
  EXPECT_EQ(Param(motion, "noise.acceleration").condition, "");
  EXPECT_EQ(Param(motion, "noise.acceleration").unit, "m/s^1.5 or m/s^2");
}

TEST_F(HostTest, DescribesRolesAndMeasurement) {
  const PluginHost host({Built("range_rate")});
  const std::vector<std::string> lines = DescribeModel(host.entries().front());
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0], "role position: vector(2), m; of the point");
  EXPECT_EQ(lines[2], "measurement range_rate: vector(1), m/s; closing is negative");
  EXPECT_EQ(lines[3], "Jacobians: automatic differentiation");
}

TEST_F(HostTest, DescribesWhatAModelCanDo) {
  const PluginHost host;
  const auto behind_the_blocks = [&](const std::string& name, std::size_t blocks) {
    const auto has_name = [&](const PluginEntry& entry) { return entry.name == name; };
    const std::vector<std::string> lines =
        DescribeModel(*std::find_if(host.entries().begin(), host.entries().end(), has_name));
    return std::vector<std::string>(lines.begin() + std::ptrdiff_t(blocks), lines.end());
  };
  using Lines = std::vector<std::string>;
  EXPECT_EQ(behind_the_blocks("stereo_disparity", 2),
            (Lines{"Jacobians: analytic", "rejects invalid measurements", "can initialise depth"}));
  EXPECT_EQ(behind_the_blocks("constant", 1), Lines{"Jacobians: analytic"});
}

}  // namespace
}  // namespace alidade
