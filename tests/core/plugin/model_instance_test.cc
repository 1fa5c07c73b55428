// SPDX-License-Identifier: Apache-2.0
// Tests how the host checks the descriptions that a plugin supplies.
#include "alidade/plugin/model_instance.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <memory>
#include <string>

#include "alidade/base/error.h"
#include "alidade/plugin/plugin_models.h"

namespace alidade {
namespace {

/// A sensor written directly against the C header. The sensor is valid unless a test changes it.
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
  /// Turns `space` into a product of two scalars, `a` and `b`.
  void Divide(AlidadeSpace& space) {
    parts[0] = parts[1] = output;
    parts[0].name = "a";
    parts[1].name = "b";
    space.geometry = ALIDADE_PRODUCT;
    space.ambient = space.tangent = 2;
    space.parts = parts;
    space.part_count = 2;
    space.part_stride = sizeof(AlidadeSpace);
  }
  /// Turns the role into a model parameter state of the sensor.
  AlidadeOwned& Own() {
    owned.struct_size = sizeof(owned);
    role.flags = ALIDADE_ROLE_OWNED;
    role.owned = &owned;
    return owned;
  }

  AlidadeSpace role{}, output{}, parts[2] = {};
  AlidadeOwned owned{};
  AlidadeDescription description{};
  AlidadeSensor sensor{};
  AlidadeInstance instance{};
  int destroyed = 0;
};

TEST(ModelInstance, AcceptsAHandWrittenSensorAndDestroysItOnce) {
  HandWritten hand;
  {
    const PluginSensor sensor(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
    EXPECT_EQ(hand.destroyed, 0);
    double z = 0.0;
    EXPECT_EQ(sensor.Predict(nullptr, &z), Status::kError) << "77 is not a status code of the ABI";
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
  const PluginSensor sensor(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
  EXPECT_EQ(sensor.roles()[0].unit, "");
  const double z = 0.0;
  EXPECT_EQ(sensor.Valid({&z}), Status::kOk);
}

TEST(ModelInstance, ReadsTheMeasurementsPartsWhatComesWithItAndWhatItsSensorOwns) {
  HandWritten hand;
  hand.Divide(hand.output);
  hand.parts[1].geometry = ALIDADE_UNIT_VECTOR;
  hand.parts[1].ambient = 3;
  hand.parts[1].tangent = 2;
  hand.output.ambient = 4;
  hand.output.tangent = 3;
  hand.description.known = &hand.parts[0];
  const double mean = 2.0, root = 3.0, density = 0.5;
  AlidadeOwned& owned = hand.Own();
  owned.dynamics = ALIDADE_GAUSS_MARKOV;
  owned.mean = &mean;
  owned.sqrt_prior = &root;
  owned.sqrt_density = &density;
  owned.time_constant_s = 10.0;
  const auto instance = std::make_shared<const ModelInstance>(hand.instance, "m", "p.so");
  const PluginSensor sensor(instance);
  EXPECT_EQ(sensor.measurement().geometry,
            Geometry::Product({Geometry::Vector(1), Geometry::UnitVector()}));
  EXPECT_EQ(sensor.measurement().elements, (std::vector<std::string>{"a", "b.x", "b.y", "b.z"}));
  EXPECT_EQ(sensor.known_size(), 1);
  const OwnedRole own = instance->owned().at(0);
  EXPECT_EQ(own.mean, std::vector<double>{2.0});
  EXPECT_EQ(own.sqrt_prior, std::vector<double>{3.0});
  EXPECT_EQ(own.sqrt_density, std::vector<double>{0.5});
  EXPECT_EQ(own.dynamics, OwnedDynamics::kGaussMarkov);
  EXPECT_EQ(own.time_constant_s, 10.0);
}

TEST(ModelInstance, WhatASensorOwnsIsConstantAtTheNeutralElementUnlessItSaysElse) {
  HandWritten hand;
  hand.role.flags = ALIDADE_ROLE_OWNED;
  const PluginSensor sensor(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
  const OwnedRole own = sensor.owned(0);
  EXPECT_EQ(own.mean, std::vector<double>{0.0});
  EXPECT_TRUE(own.sqrt_prior.empty());
  EXPECT_EQ(own.dynamics, OwnedDynamics::kConstant);
}

TEST(ModelInstance, IgnoresHintsThatItDoesNotKnow) {
  HandWritten hand;
  hand.role.flags = 1u << 9;
  hand.description.capabilities = 1u << 12;
  const ModelInstance instance(hand.instance, "m", "p.so");
  EXPECT_EQ(instance.spaces().size(), 1u);
}

TEST(MotionModel, PassesZerosWhereNoNoiseIsGiven) {
  // A plugin written in another language may not support null.
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
  const PluginMotion model(std::make_shared<const ModelInstance>(hand.instance, "m", "p.so"));
  EXPECT_FALSE(model.has_input());
  EXPECT_EQ(model.Step(nullptr, nullptr, nullptr, 0.1, {nullptr, nullptr, nullptr}), Status::kOk);
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
      {"role 'x' is a product; expected a role for each part",
       [](HandWritten& h) {
         h.role.geometry = ALIDADE_PRODUCT;
         h.Divide(h.role);
       }},
      {"the measurement does not describe the parts of its product",
       [](HandWritten& h) { h.output.geometry = ALIDADE_PRODUCT; }},
      {"the measurement has parts, but is not a product",
       [](HandWritten& h) {
         h.Divide(h.output);
         h.output.geometry = ALIDADE_VECTOR;
       }},
      {"does not describe the parts",
       [](HandWritten& h) {
         h.Divide(h.output);
         h.output.part_stride = 4;
       }},
      {"has geometry 5 with sizes 2 and 3",
       [](HandWritten& h) {
         h.Divide(h.output);
         h.output.tangent = 3;
       }},
      {"has a part 'b' that is a product",
       [](HandWritten& h) {
         h.Divide(h.output);
         h.parts[1].geometry = ALIDADE_PRODUCT;
       }},
      {"has a part 'b' that has flags",
       [](HandWritten& h) {
         h.Divide(h.output);
         h.parts[1].flags = ALIDADE_ROLE_OPTIONAL;
       }},
      {"has a part 'b' that has geometry 3 with sizes 1 and 1",
       [](HandWritten& h) {
         h.Divide(h.output);
         h.parts[1].geometry = ALIDADE_UNIT_QUATERNION;
       }},
      {"has two parts of the same name",
       [](HandWritten& h) {
         h.Divide(h.output);
         h.parts[1].name = "a";
       }},
      {"names its elements, although its parts name them",
       [](HandWritten& h) {
         h.Divide(h.output);
         h.output.elements = "a,b";
       }},
      {"role 'x' belong to a landmark",
       [](HandWritten& h) {
         h.Own();
         h.role.flags |= ALIDADE_ROLE_LANDMARK;
       }},
      {"role 'x' are of kind 3", [](HandWritten& h) { h.Own().dynamics = 3; }},
      {"role 'x' are not finite",
       [](HandWritten& h) {
         static constexpr double kInfinite = std::numeric_limits<double>::infinity();
         h.Own().sqrt_prior = &kInfinite;
       }},
      {"role 'x' have a time constant of 0 s",
       [](HandWritten& h) { h.Own().dynamics = ALIDADE_GAUSS_MARKOV; }},
      {"uses reserved members", [](HandWritten& h) { h.Own().reserved[3] = &h; }},
      {"role 'x' belong to a motion model",
       [](HandWritten& h) {
         static constexpr AlidadeMotion kMotion{
             sizeof(AlidadeMotion),
             0,
             [](const void*, const double* const*, const double* const*, const double*, double,
                double* const*, double*, std::int32_t, double*, std::int32_t, double*,
                std::int32_t) { return std::int32_t{0}; },
             [](const void*, const double* const*, const double* const*, double, double*,
                std::int32_t) { return std::int32_t{0}; },
             {}};
         h.Own();
         h.instance.kind = ALIDADE_KIND_MOTION;
         h.instance.motion = &kMotion;
       }},
      {"is shared, but is not", [](HandWritten& h) { h.role.flags = ALIDADE_ROLE_SHARED; }},
      {"role 'x' has flags that this version does not know: 0x200000",
       [](HandWritten& h) { h.role.flags = 1u << 21; }},
      {"role 'x' uses reserved members", [](HandWritten& h) { h.role.reserved[0] = &h; }},
      {"role 'x' uses reserved members", [](HandWritten& h) { h.role.reserved0 = 1; }},
      {"role 'x' is the value at an earlier timestamp, which this version",
       [](HandWritten& h) { h.role.flags = ALIDADE_ROLE_CLONE; }},
      {"role 'x' has a prior and dynamics, but is not a model parameter state",
       [](HandWritten& h) {
         h.Own();
         h.role.flags = 0;
       }},
      {"role 'a?error: b' has an invalid name",
       [](HandWritten& h) { h.role.name = "a\nerror: b"; }},
      {"role 'a b' has an invalid name", [](HandWritten& h) { h.role.name = "a b"; }},
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
      {"needs the payload of a measurement",
       [](HandWritten& h) { h.description.capabilities = ALIDADE_NEEDS_PAYLOAD; }},
      {"the known quantity is not a vector",
       [](HandWritten& h) {
         static constexpr AlidadeSpace kAngle = [] {
           AlidadeSpace space{};
           space.struct_size = sizeof(space);
           space.geometry = ALIDADE_ANGLE;
           space.ambient = space.tangent = 1;
           space.name = "k";
           return space;
         }();
         h.description.known = &kAngle;
       }},
      {"only provides a residual",
       [](HandWritten& h) { h.description.capabilities = ALIDADE_RESIDUAL_ONLY; }},
      {"claims to initialise a role, but does not define",
       [](HandWritten& h) { h.description.capabilities = ALIDADE_CAN_INITIALISE; }},
      {"eval or sqrt_noise", [](HandWritten& h) { h.sensor.eval = nullptr; }},
      {"eval or sqrt_noise", [](HandWritten& h) { h.sensor.struct_size = 8; }},
      {"eval or sqrt_noise",
       [](HandWritten& h) {
         h.sensor.sqrt_noise = nullptr;
         h.sensor.residual = [](const void*, const AlidadeObservation*, const double* const*,
                                double*, double* const*,
                                const std::int32_t*) { return std::int32_t{0}; };
       }},
      {"step or sqrt_q",
       [](HandWritten& h) {
         static constexpr AlidadeMotion kNoStep{sizeof(AlidadeMotion), 0, nullptr, nullptr, {}};
         h.instance.kind = ALIDADE_KIND_MOTION;
         h.instance.motion = &kNoStep;
       }},
      {"lacks the functions of this kind", [](HandWritten& h) { h.instance.sensor = nullptr; }},
      {"is of kind 3", [](HandWritten& h) { h.instance.kind = 3; }},
  };
  for (const Spoiled& test : cases) {
    HandWritten hand;
    test.spoil(hand);
    try {
      const ModelInstance instance(hand.instance, "bad_model", "/p/bad.so");
      ADD_FAILURE() << "the model was accepted; expected an error with: " << test.words;
    } catch (const Error& e) {
      const std::string text = e.what();
      EXPECT_EQ(e.code(), ExitCode::kPlugin);
      EXPECT_NE(text.find(test.words), std::string::npos) << text;
      EXPECT_NE(text.find("/p/bad.so"), std::string::npos) << text;
      EXPECT_NE(text.find("bad_model"), std::string::npos) << text;
    }
    EXPECT_EQ(hand.destroyed, 1) << "a refused model must be destroyed: " << test.words;
  }
}

}  // namespace
}  // namespace alidade
