// SPDX-License-Identifier: Apache-2.0
//
// A host of a later minor version: core/alidade/plugin compiled with the header that grow.sh
// derives. Members that a plugin of 1.0 does not supply are zero, and such a plugin ignores the new
// members of this host. golden_models_test.cc is also a part of this program.
#include <dlfcn.h>

#include <cmath>

#include "alidade/plugin/abi_read.h"
#include "alidade/plugin/plugin_models.h"
#include "alidade/plugin/plugin_sections.h"
#include "plugins/golden/golden_fixture.h"

namespace alidade {
namespace {

// The structs are larger than those of 1.0.
static_assert(ALIDADE_ABI_MINOR == 4);
static_assert(sizeof(AlidadeTable) > 80 && sizeof(AlidadeEntry) > 104 && sizeof(AlidadeSpace) > 88);
static_assert(offsetof(AlidadeHost, taken) == 40 && offsetof(AlidadeObservation, taken) == 56);

template <class T>
bool SaysNothing(const T& from) {
  return internal::AllZero(from.later) && from.taken == decltype(from.taken){};
}

using GrownHost = GoldenTest;

TEST_P(GrownHost, TakesWhatAPluginOf10DoesNotSayAsZero) {
  const AlidadeBuildTag tag = ReadBuildTag(Lent());
  EXPECT_TRUE(SaysNothing(tag));
  EXPECT_EQ(tag.abi_minor, 0);
  const SharedSensor line = Sensor("golden_line", "{gain: 1, sigma_m: 1}");
  const SharedMotion cart = Cart();
  EXPECT_TRUE(SaysNothing(*dynamic_cast<const PluginSensor&>(*line).instance().c().description));
  EXPECT_TRUE(SaysNothing(*dynamic_cast<const PluginSensor&>(*line).instance().c().sensor));
  EXPECT_TRUE(SaysNothing(*dynamic_cast<const PluginMotion&>(*cart).instance().c().description));
  EXPECT_TRUE(SaysNothing(*dynamic_cast<const PluginMotion&>(*cart).instance().c().motion));
  EXPECT_EQ(dynamic_cast<const PluginSensor&>(*line).instance().c().taken, nullptr);
}

TEST_P(GrownHost, MayLendWhatAPluginOf10DoesNotKnow) {
  static const int kSomething = 0;
  const SharedSensor line = Sensor("golden_line", "{gain: 2, sigma_m: 1, height_m: 4}");
  const double x = 4.0, b = 0.25, k = 1.0;
  const double* roles[] = {&x, &b};
  AlidadeObservation seen = internal::MakeObservation(nullptr, &k);
  seen.taken = const_cast<int*>(&kSomething);
  double z = 0.0;
  const AlidadeInstance& c = dynamic_cast<const PluginSensor&>(*line).instance().c();
  ASSERT_EQ(c.sensor->eval(c.self, &seen, roles, &z, nullptr, nullptr), ALIDADE_OK);
  EXPECT_NEAR(z, 2.0 * 5.0 + 0.25, 1e-12);

  // Calls the plugin with a host that has one additional function.
  void* const library = dlopen(Lent().c_str(), RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(library, nullptr) << dlerror();
  void* const function = dlsym(library, ALIDADE_ENTRY_SYMBOL);
  const AlidadeTable table =
      internal::ReadPrefix(reinterpret_cast<AlidadePluginFunction>(function)());
  EXPECT_TRUE(SaysNothing(table));
  const AlidadeEntry entry = internal::ReadEntry(table.entries, table.entry_stride, 0);
  EXPECT_TRUE(SaysNothing(entry));
  AlidadeHost lent{};
  lent.struct_size = sizeof(lent);
  lent.abi_major = ALIDADE_ABI_MAJOR;
  lent.abi_minor = ALIDADE_ABI_MINOR;
  lent.read = [](void*, const AlidadeParam* param, double* values, std::int32_t) {
    values[0] = param->fallback != nullptr ? param->fallback[0] : 3.0;
    return std::int32_t{1};
  };
  lent.read_text = [](void*, const AlidadeParam*, char* text, std::int32_t) {
    text[0] = '\0';
    return std::int32_t{-1};
  };
  lent.fail = [](void*, const char*, const char* text) { ADD_FAILURE() << text; };
  lent.taken = [] { ADD_FAILURE() << "a plugin of 1.0 must not call this function"; };
  AlidadeInstance instance{};
  instance.struct_size = sizeof(instance);
  ASSERT_EQ(entry.create(&lent, &instance), ALIDADE_OK);
  EXPECT_EQ(instance.taken, nullptr);
  ASSERT_EQ(instance.sensor->eval(instance.self, &seen, roles, &z, nullptr, nullptr), ALIDADE_OK);
  EXPECT_NEAR(z, 3.0 * std::sqrt(9.0 + 4.0) + 0.25, 1e-12);
  instance.destroy(instance.self);
  dlclose(library);
}

TEST_F(HostTest, TheGrownHostLoadsThePluginOfItsVersion) {
  for (const char* name : {"later", "later_needs"}) {
    const PluginHost host({Built(name)});
    EXPECT_NO_THROW(host.CreateSensor("later_sensor", Parse("{}").root())) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Abi10, GrownHost, ::testing::ValuesIn(kGolden),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace alidade
