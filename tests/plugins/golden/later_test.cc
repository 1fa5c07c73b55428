// SPDX-License-Identifier: Apache-2.0
//
// Loads a plugin of a later minor version, later.c, in this host. The host ignores the features
// that it need not support. It refuses and names all other features.
#include "alidade/check/check.h"
#include "alidade/plugin/plugin_sections.h"
#include "plugins/host/host_fixture.h"

namespace alidade {
namespace {

using LaterPlugin = HostTest;

TEST_F(LaterPlugin, ThatNeedsALaterHostIsRefused) {
  ExpectRefused(Built("later_needs"),
                {"needs plugin ABI 1.3", "this program has 1.1", "use a later version of alidade"});
}

TEST_F(LaterPlugin, WithLargerStructsAndUnknownHintsWorks) {
  const PluginHost host({Built("later")});
  const AlidadeBuildTag tag = ReadBuildTag(Built("later"));
  EXPECT_GT(tag.struct_size, sizeof(AlidadeBuildTag));
  EXPECT_EQ(tag.abi_minor, 4);
  const SharedSensor sensor = host.CreateSensor("later_sensor", Parse("gain: 1.5").root());
  const double x = 3.0, b = 0.5;
  const double* roles[] = {&x, &b};
  double z = 0.0;
  ASSERT_EQ(sensor->Predict(roles, &z), Status::kOk);
  EXPECT_EQ(z, 6.5);
  EXPECT_EQ(sensor->roles()[1].name, "b");
  const auto entries = FindModels(host, Built("later"), "later_sensor");
  const auto findings = CheckModel(entries.front(), Parse("{}").root(), {});
  EXPECT_FALSE(AnyFailure(findings)) << CheckText(entries.front(), findings);
}

TEST_F(LaterPlugin, AnEntryOfAnUnknownKindIsLeftOutBesideTheOthers) {
  const PluginHost host({Built("later")});
  EXPECT_EQ(std::ranges::count(host.entries(), "later_thing", &PluginEntry::name), 0);
  const auto told = [](const Refusal& refusal) {
    return refusal.reason.starts_with("its entry 'later_thing' is of kind 3");
  };
  EXPECT_EQ(std::ranges::count_if(host.refusals(), told), 1);
}

TEST_F(LaterPlugin, WhatHasToBeUnderstoodIsRefusedByName) {
  const PluginHost host({Built("later")});
  const std::pair<const char*, const char*> models[] = {
      {"later_role", "role 'x' has flags that this version does not know: 0x10000000"},
      {"later_role_member", "role 'x' uses reserved members"},
      {"later_dynamics", "dynamics of role 'b' are of kind 7"},
      {"later_owned_member", "uses reserved members"},
      {"later_geometry", "the measurement has geometry 6"},
      {"later_capability", "has capabilities that this version does not know: 0x10000000"},
      {"later_description_member", "uses reserved members"},
      {"later_call", "uses reserved members"},
      {"later_instance_member", "uses reserved members"},
      {"later_parameter",
       "parameter 'gain' in a way that this version does not support: it has "
       "the flags 0x10000000"},
      {"later_parameter_kind", "its kind is 7"},
      {"later_parameter_member", "it uses reserved members"}};
  for (const auto& [name, words] : models) {
    ExpectError(ExitCode::kPlugin, {std::string("model '") + name + "'", words},
                [&] { host.CreateSensor(name, Parse("{}").root()); });
  }
  // A status code that this version does not define is a failure of the call.
  const SharedSensor sensor = host.CreateSensor("later_code", Parse("{}").root());
  const double x = 3.0, b = 0.5;
  const double* roles[] = {&x, &b};
  double z = 0.0;
  EXPECT_EQ(sensor->Predict(roles, &z), Status::kError);
}

}  // namespace
}  // namespace alidade
