// SPDX-License-Identifier: Apache-2.0
// What a plugin says of itself, checked.
#include "alidade/host/model_instance.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <string>

#include "alidade/base/error.h"

namespace alidade {
namespace {

/// A sensor written by hand against the C header, right unless a test spoils it.
struct HandWritten {
  HandWritten() {
    role.struct_size = output.struct_size = sizeof(AlidadeSpace);
    role.geometry = output.geometry = ALIDADE_VECTOR;
    role.ambient = role.tangent = output.ambient = output.tangent = 1;
    role.name = "x";
    output.name = "z";
    description.struct_size = sizeof(description);
    description.role_count = 1;
    description.role_stride = sizeof(AlidadeSpace);
    description.roles = &role;
    description.output = &output;
    sensor.struct_size = sizeof(sensor);
    sensor.eval = [](const void*, const AlidadeObservation*, const double* const*, double*,
                     double* const*, const std::int32_t*) { return std::int32_t{77}; };
    sensor.sqrt_noise = [](const void*, const AlidadeObservation*, const double* const*, double*,
                           std::int32_t) { return std::int32_t{-1}; };
    instance.struct_size = sizeof(instance);
    instance.kind = ALIDADE_KIND_SENSOR;
    instance.self = &destroyed;
    instance.destroy = [](void* self) { ++*static_cast<int*>(self); };
    instance.description = &description;
    instance.sensor = &sensor;
  }
  AlidadeSpace role{}, output{};
  AlidadeDescription description{};
  AlidadeSensor sensor{};
  AlidadeInstance instance{};
  int destroyed = 0;
};

TEST(ModelInstance, AcceptsAHandWrittenSensorAndDestroysItOnce) {
  HandWritten hand;
  {
    const SensorModel sensor(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
    EXPECT_EQ(hand.destroyed, 0);
    double z = 0.0;
    EXPECT_EQ(sensor.Predict(nullptr, &z), Status::kError) << "77 is no code of the ABI";
    EXPECT_EQ(sensor.SqrtNoise(nullptr, &z, &z), Status::kError);
  }
  EXPECT_EQ(hand.destroyed, 1);
}

TEST(ModelInstance, WalksRolesByTheirStride) {
  struct LaterSpace {
    AlidadeSpace known;
    double unknown_to_this_version[4];
  };
  LaterSpace roles[2] = {};
  HandWritten hand;
  roles[0].known = roles[1].known = hand.role;
  roles[1].known.name = "y";
  roles[0].known.struct_size = roles[1].known.struct_size = sizeof(LaterSpace);
  hand.description.roles = &roles[0].known;
  hand.description.role_count = 2;
  hand.description.role_stride = sizeof(LaterSpace);
  const ModelInstance instance(hand.instance, "m", "p.so");
  ASSERT_EQ(instance.spaces().size(), 2u);
  EXPECT_EQ(instance.spaces()[1].name, "y");
}

TEST(ModelInstance, ReadsNoFurtherThanAStructSays) {
  HandWritten hand;
  hand.role.struct_size = offsetof(AlidadeSpace, unit);
  hand.role.unit = reinterpret_cast<const char*>(8);
  hand.sensor.struct_size = offsetof(AlidadeSensor, valid);
  hand.sensor.valid = reinterpret_cast<decltype(hand.sensor.valid)>(8);
  const SensorModel sensor(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
  EXPECT_EQ(sensor.roles()[0].unit, "");
  const double z = 0.0;
  EXPECT_EQ(sensor.Valid(&z), Status::kOk);
}

TEST(ModelInstance, IgnoresHintsThatItDoesNotKnow) {
  HandWritten hand;
  hand.role.flags = 1u << 9;
  hand.description.capabilities = 1u << 12;
  const ModelInstance instance(hand.instance, "m", "p.so");
  EXPECT_EQ(instance.spaces().size(), 1u);
}

TEST(MotionModel, PassesZerosWhereNoNoiseIsGiven) {
  // A plugin of another language may not know null.
  HandWritten hand;
  AlidadeMotion motion{};
  motion.struct_size = sizeof(motion);
  motion.step = [](const void*, const double* const*, const double* const*, const double* w, double,
                   double* const*, double*, std::int32_t, double*, std::int32_t, double*,
                   std::int32_t) {
    return std::int32_t{w != nullptr && w[0] == 0.0 && w[1] == 0.0 ? ALIDADE_OK : ALIDADE_ERROR};
  };
  motion.sqrt_q = [](const void*, const double* const*, const double* const*, double, double*,
                     std::int32_t) { return std::int32_t{ALIDADE_OK}; };
  hand.instance.kind = ALIDADE_KIND_MOTION;
  hand.instance.motion = &motion;
  hand.description.output = nullptr;
  hand.description.noise_count = 2;
  const MotionModel model(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
  EXPECT_FALSE(model.has_input());
  EXPECT_EQ(model.Step(nullptr, nullptr, nullptr, 0.1, nullptr, nullptr, nullptr), Status::kOk);
}

struct Spoiled {
  const char* words;
  void (*spoil)(HandWritten&);
};

TEST(ModelInstance, RefusesByNameWhatBreaksTheRules) {
  const Spoiled cases[] = {
      {"has 0 roles", [](HandWritten& h) { h.description.role_count = 0; }},
      {"has 65 roles", [](HandWritten& h) { h.description.role_count = 65; }},
      {"has 1 roles", [](HandWritten& h) { h.description.roles = nullptr; }},
      {"role stride of 4", [](HandWritten& h) { h.description.role_stride = 4; }},
      {"has no description", [](HandWritten& h) { h.instance.description = nullptr; }},
      {"does not describe its measurement", [](HandWritten& h) { h.description.output = nullptr; }},
      {"role '' has no name", [](HandWritten& h) { h.role.name = nullptr; }},
      {"role 'x' has geometry 9", [](HandWritten& h) { h.role.geometry = 9; }},
      {"role 'x' has geometry 1 with sizes 0", [](HandWritten& h) { h.role.ambient = 0; }},
      {"sizes 1 and 2", [](HandWritten& h) { h.role.tangent = 2; }},
      {"has geometry 3 with sizes 1 and 1", [](HandWritten& h) { h.role.geometry = 3; }},
      {"the measurement has geometry 0", [](HandWritten& h) { h.output.geometry = 0; }},
      {"names its elements 'a,b', but has 1", [](HandWritten& h) { h.role.elements = "a,b"; }},
      {"is a model parameter state of the sensor",
       [](HandWritten& h) { h.role.flags = ALIDADE_ROLE_OWNED; }},
      {"is shared, but not", [](HandWritten& h) { h.role.flags = ALIDADE_ROLE_SHARED; }},
      {"role 'x' has flags that this version does not know: 0x400000",
       [](HandWritten& h) { h.role.flags = 1u << 22; }},
      {"role 'x' uses reserved members", [](HandWritten& h) { h.role.reserved[2] = &h; }},
      {"role 'x' uses reserved members", [](HandWritten& h) { h.role.reserved0 = 1; }},
      {"role 'x' is a time offset, which this version",
       [](HandWritten& h) { h.role.flags = ALIDADE_ROLE_TIME_OFFSET; }},
      {"role 'x' is of an earlier timestamp, which this version",
       [](HandWritten& h) { h.role.flags = ALIDADE_ROLE_CLONE; }},
      {"role 'x' has a prior and dynamics of its own",
       [](HandWritten& h) {
         static constexpr AlidadeOwned kOwned{};
         h.role.owned = &kOwned;
       }},
      {"role 'a b' has a name that is none", [](HandWritten& h) { h.role.name = "a b"; }},
      {"has a text 'doc' that is not UTF-8", [](HandWritten& h) { h.role.doc = "\xc0\xaf"; }},
      {"has a text 'unit' that has a control character",
       [](HandWritten& h) { h.output.unit = "m\n"; }},
      {"has a text 'elements' that is longer than 4096 bytes",
       [](HandWritten& h) {
         static const std::string long_text(4097, 'x');
         h.role.elements = long_text.c_str();
       }},
      {"has capabilities that this version does not know: 0x80000000",
       [](HandWritten& h) { h.description.capabilities = 1u << 31; }},
      {"uses reserved members", [](HandWritten& h) { h.description.reserved[5] = &h; }},
      {"uses reserved members", [](HandWritten& h) { h.instance.reserved[7] = &h; }},
      {"uses reserved members", [](HandWritten& h) { h.sensor.reserved[5] = [] {}; }},
      {"needs what comes beside a measurement",
       [](HandWritten& h) { h.description.capabilities = ALIDADE_NEEDS_PAYLOAD; }},
      {"needs known numbers", [](HandWritten& h) { h.description.known = &h.output; }},
      {"gives a residual alone",
       [](HandWritten& h) { h.description.capabilities = ALIDADE_RESIDUAL_ONLY; }},
      {"can initialise, but not what or how",
       [](HandWritten& h) { h.description.capabilities = ALIDADE_CAN_INITIALISE; }},
      {"eval, sqrt_noise", [](HandWritten& h) { h.sensor.eval = nullptr; }},
      {"eval, sqrt_noise", [](HandWritten& h) { h.sensor.struct_size = 8; }},
      {"eval, sqrt_noise",
       [](HandWritten& h) {
         h.sensor.sqrt_noise = nullptr;
         h.sensor.residual = [](const void*, const AlidadeObservation*, const double* const*,
                                double*, double* const*,
                                const std::int32_t*) { return std::int32_t{0}; };
       }},
      {"step, sqrt_q",
       [](HandWritten& h) {
         static constexpr AlidadeMotion kNoStep{sizeof(AlidadeMotion), 0, nullptr, nullptr, {}};
         h.instance.kind = ALIDADE_KIND_MOTION;
         h.instance.motion = &kNoStep;
       }},
      {"lacks the functions of its kind", [](HandWritten& h) { h.instance.sensor = nullptr; }},
      {"is of kind 3", [](HandWritten& h) { h.instance.kind = 3; }},
  };
  for (const Spoiled& test : cases) {
    HandWritten hand;
    test.spoil(hand);
    try {
      const ModelInstance instance(hand.instance, "bad_model", "/p/bad.so");
      ADD_FAILURE() << "accepted: " << test.words;
    } catch (const Error& e) {
      const std::string text = e.what();
      EXPECT_EQ(e.code(), ExitCode::kPlugin);
      EXPECT_NE(text.find(test.words), std::string::npos) << text;
      EXPECT_NE(text.find("/p/bad.so"), std::string::npos) << text;
      EXPECT_NE(text.find("bad_model"), std::string::npos) << text;
    }
    EXPECT_EQ(hand.destroyed, 1) << "what is refused is destroyed: " << test.words;
  }
}

}  // namespace
}  // namespace alidade
