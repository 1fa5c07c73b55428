// SPDX-License-Identifier: Apache-2.0
//
// Tests that lists and suggestions contain the models that are part of the program.
#include "alidade/plugin/built_in_models.h"

#include <gtest/gtest.h>

#include <string>

#include "alidade/check/plugin_listing.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {
namespace {

TEST(BuiltInModels, AreSuggested) {
  const PluginHost host;
  const Config config = Config::FromText("model: formul\n", "f.yaml");
  for (const bool is_sensor : {true, false}) {
    try {
      if (is_sensor) {
        host.CreateSensor("formul", config.root());
      } else {
        host.CreateMotion("formul", config.root());
      }
      FAIL() << "no error";
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("did you mean 'formula'?"), std::string::npos)
          << e.what();
    }
  }
}

TEST(BuiltInModels, AreListedAndDescribed) {
  const PluginHost host;
  for (const internal::BuiltInModel& model : internal::kBuiltInModels) {
    const std::string list = PluginList(host), row = std::string("\n  ") + model.name + ' ';
    EXPECT_NE(list.find(row), list.rfind(row)) << model.name;  // a sensor and a motion model
    EXPECT_EQ(PluginInfo(host, model.name),
              std::string(model.name) + ": sensor\n  " + model.doc + "\n  plugin: built in\n\n" +
                  model.name + ": motion model\n  " + model.doc + "\n  plugin: built in\n");
  }
}

TEST(BuiltInModels, EstimatorsAreListedOnce) {
  const PluginHost host;
  const std::string list = PluginList(host, true);
  EXPECT_EQ(list.find("\n  ekf "), list.rfind("\n  ekf "));
  EXPECT_EQ(PluginInfo(host, "ekf").substr(0, 15), "ekf: estimator\n");
  EXPECT_NE(PluginInfo(host, "ekf").find("\n  gate "), std::string::npos);
}

}  // namespace
}  // namespace alidade
