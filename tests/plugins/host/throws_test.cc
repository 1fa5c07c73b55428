// SPDX-License-Identifier: Apache-2.0
//
// Tests fault 58 of tests/faults/README.md: plugins written against the C header throw, which the
// header forbids.
#include "alidade/io/log.h"
#include "alidade/plugin/create.h"
#include "host_fixture.h"

namespace alidade {
namespace {

class ThrowsTest : public HostTest {
 protected:
  SharedSensor Sensor(const char* name) {
    return host_.CreateSensor(name, Parse("model: any").root());
  }
  SharedMotion Motion(const char* name) {
    return host_.CreateMotion(name, Parse("model: any").root());
  }
  /// Returns `Predict of model 'NAME' of plugin FILE threw: the dog ate it`.
  std::string Words(const char* call, const char* name, const char* what = "the dog ate it") {
    return std::string(call) + " of model '" + name + "' of plugin " +
           std::filesystem::canonical(Built("raw_throws")).string() + " threw: " + what;
  }

  PluginHost host_{{Built("raw_throws")}};
  const double x_ = 0.0;
  const double* const roles_[1] = {&x_};
  double out_ = 7.0;
};

TEST_F(ThrowsTest, InCreateIsAnErrorOfThePlugin) {
  const std::string plugin = Built("raw_throws").string();
  ExpectError(ExitCode::kPlugin,
              {"model 'throws_in_create' of plugin " + plugin,
               "could not be created: it threw: the dog ate it"},
              [&] { Sensor("throws_in_create"); });
  ExpectError(ExitCode::kPlugin, {"model 'throws_int_in_create'", "an exception of unknown type"},
              [&] { Sensor("throws_int_in_create"); });
  for (const PluginEntry& entry : host_.entries()) {
    if (!entry.is_model()) continue;
    EXPECT_NO_THROW(ModelSchema(entry)) << entry.name;
    EXPECT_NO_THROW(DescribeModel(entry)) << entry.name;
  }
}

TEST_F(ThrowsTest, InACallIsAFailureOfThatCall) {
  const SharedSensor eval = Sensor("throws_in_eval");
  EXPECT_EQ(eval->Predict(roles_, &out_), Status::kError);
  EXPECT_EQ(eval->error_text(), Words("Predict", "throws_in_eval"));
  const SharedSensor noise = Sensor("throws_in_sqrt_noise");
  EXPECT_EQ(noise->SqrtNoise(roles_, &x_, &out_), Status::kError);
  EXPECT_EQ(noise->error_text(), Words("SqrtNoise", "throws_in_sqrt_noise"));
  const SharedSensor valid = Sensor("throws_in_valid");
  EXPECT_EQ(valid->Valid({&x_}), Status::kError);
  EXPECT_EQ(valid->error_text(), Words("Valid", "throws_in_valid", "an exception of unknown type"));
  const SharedSensor inverse = Sensor("throws_in_initialise");
  EXPECT_EQ(inverse->Initialise(roles_, {&x_}, nullptr, {.y = &out_}), Status::kError);
  EXPECT_EQ(inverse->error_text(), Words("Initialise", "throws_in_initialise"));
  double* const next[] = {&out_};
  const SharedMotion step = Motion("throws_in_step");
  EXPECT_EQ(step->Step(roles_, nullptr, nullptr, 0.1, {next, nullptr, nullptr}), Status::kError);
  EXPECT_EQ(step->error_text(), Words("Step", "throws_in_step"));
  const SharedMotion q = Motion("throws_in_sqrt_q");
  EXPECT_EQ(q->SqrtQ(roles_, nullptr, 0.1, &out_), Status::kError);
  EXPECT_EQ(q->error_text(), Words("SqrtQ", "throws_in_sqrt_q"));
  EXPECT_NE(eval->error_text(), Words("SqrtQ", "throws_in_sqrt_q"))
      << "the exception came from another model";
}

TEST_F(ThrowsTest, WhatWasThrownIsOfTheLastFailureAlone) {
  const SharedSensor sensor = Sensor("throws_at_zero");
  EXPECT_EQ(sensor->Predict(roles_, &out_), Status::kError);
  EXPECT_EQ(sensor->error_text(), Words("Predict", "throws_at_zero"));
  EXPECT_EQ(sensor->error_text(), Words("Predict", "throws_at_zero"))
      << "each call returns the same text";
  const double below = -1.0;
  const double* const roles[] = {&below};
  EXPECT_EQ(sensor->Predict(roles, &out_), Status::kError);
  EXPECT_EQ(sensor->error_text(), "");
}

TEST_F(ThrowsTest, InErrorTextIsSaidInItsPlace) {
  const SharedSensor sensor = Sensor("throws_in_error_text");
  const double below = -1.0;
  const double* const roles[] = {&below};
  EXPECT_EQ(sensor->Predict(roles, &out_), Status::kError);
  EXPECT_EQ(sensor->error_text(), Words("function error_text", "throws_in_error_text"));
}

TEST_F(ThrowsTest, InDestroyIsAWarning) {
  std::vector<std::string> said;
  const LogSubscription log(LogLevel::kWarning,
                            [&](LogLevel, std::string_view text) { said.emplace_back(text); });
  { const SharedSensor sensor = Sensor("throws_in_destroy_too"); }
  EXPECT_EQ(said, std::vector<std::string>{Words("function destroy", "throws_in_destroy_too")});
}

TEST_F(ThrowsTest, InTheEntryFunctionIsARefusal) {
  ExpectRefused(Built("table_THROWS"), {"cannot be loaded: the dog ate it"});
}

}  // namespace
}  // namespace alidade
