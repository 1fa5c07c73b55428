// SPDX-License-Identifier: Apache-2.0
// Models that fail while they are created.
#include <stdexcept>
#include <string>

#include "alidade/model/plugin.h"
#include "probe.h"

struct Throws : Probe {
  explicit Throws(alidade::Params& p) : Probe(p) { throw std::runtime_error("the dog ate it"); }
};
struct ThrowsInt : Probe {
  explicit ThrowsInt(alidade::Params& p) : Probe(p) { throw 42; }
};
struct Misfit : Probe {
  explicit Misfit(alidade::Params& p) : Probe(p) {
    const double near_m = p.Positive("near_m", "m", ""), far_m = p.Positive("far_m", "m", "");
    if (!(near_m < far_m)) p.Fail("far_m", "is not beyond near_m");
    if (near_m == 13.0) p.Fail("", "near and far are unlucky together");
  }
};

/// A model with text parameters.
struct Titled : Probe {
  explicit Titled(alidade::Params& p) : Probe(p) {
    const std::string title = p.Text("title", "what it is called", "nameless");
    const std::string needed = p.Text("needed", "what it cannot do without");
    p.Fail("", (title + '|' + needed).c_str());  // makes the parameters visible to the test
  }
};
/// A model that tries to insert a line of its own into the messages of the program.
struct Forges : Probe {
  explicit Forges(alidade::Params& p) : Probe(p) {
    p.Fail("forged\nerror: key", "one\nerror: two \033[31m\xff \u03bb");
  }
};
/// A model that reads one parameter more than the maximum number. If `distinct` is false, the model
/// reads the same parameter each time.
struct AsksMuch : Probe {
  explicit AsksMuch(alidade::Params& p) : Probe(p) {
    const bool distinct = p.Flag("distinct", "");
    for (int i = 0; i < ALIDADE_MAX_PARAMS; ++i) {
      const std::string key = "k" + std::to_string(distinct ? i : 0);
      p.Number(key.c_str(), "", "", {}, 0.0);
    }
  }
};
namespace {

void MakeWrongKind(alidade::Params& p, AlidadeInstance* instance) {
  alidade::EmplaceSensor<Probe>(p, instance);
  instance->kind = ALIDADE_KIND_MOTION;
}

constexpr const char* kNames[] = {"fixed", "free"};
constexpr double kBeyond = 7.0, kHalfValue = 0.5, kHugeValue = 1e300;

constexpr AlidadeParam Declared(std::uint32_t kind, std::int32_t count, const double* fallback,
                                std::uint32_t flags) {
  AlidadeParam param{};
  param.struct_size = sizeof(param);
  param.kind = kind;
  param.key = "noise";
  param.count = count;
  param.flags = flags;
  param.fallback = fallback;
  if (kind == ALIDADE_PARAM_CHOICE) {
    param.choices = kNames;
    param.choice_count = 2;
  }
  return param;
}
constexpr AlidadeParam Spoiled(void (*spoil)(AlidadeParam&)) {
  AlidadeParam param = Declared(ALIDADE_PARAM_NUMBER, 1, nullptr, 0);
  spoil(param);
  return param;
}
constexpr AlidadeParam kLaterFlag = Spoiled([](AlidadeParam& p) { p.flags = 1u << 25; });
constexpr AlidadeParam kReservedMember = Spoiled([](AlidadeParam& p) { p.reserved0 = 1; });
constexpr AlidadeParam kNoKey = Spoiled([](AlidadeParam& p) { p.key = "no key"; });
constexpr AlidadeParam kGap = Spoiled([](AlidadeParam& p) { p.key = "no..gap"; });
constexpr AlidadeParam kHuge = Spoiled([](AlidadeParam& p) {
  p.kind = ALIDADE_PARAM_INTEGER;
  p.flags = ALIDADE_PARAM_HAS_DEFAULT;
  p.low = -1e301;
  p.high = 1e301;
  p.fallback = &kHugeValue;
});
constexpr AlidadeParam kEmptyRange = Spoiled([](AlidadeParam& p) { p.low = 1.0; });
constexpr AlidadeParam kManyChoices = Spoiled([](AlidadeParam& p) {
  p.kind = ALIDADE_PARAM_CHOICE;
  p.choices = kNames;
  p.choice_count = 0x7fffffff;
});
constexpr AlidadeParam kHalf = Spoiled([](AlidadeParam& p) {
  p.kind = ALIDADE_PARAM_INTEGER;
  p.flags = ALIDADE_PARAM_HAS_DEFAULT;
  p.high = 1.0;
  p.fallback = &kHalfValue;
});
constexpr AlidadeParam kOutside = Spoiled([](AlidadeParam& p) {
  p.flags = ALIDADE_PARAM_HAS_DEFAULT;
  p.fallback = &kBeyond;
});
constexpr AlidadeParam kTextAsNumber =
    Spoiled([](AlidadeParam& p) { p.kind = ALIDADE_PARAM_TEXT; });
constexpr AlidadeParam kNoDefault =
    Declared(ALIDADE_PARAM_CHOICE, 1, nullptr, ALIDADE_PARAM_HAS_DEFAULT);
constexpr AlidadeParam kNoNumber =
    Declared(ALIDADE_PARAM_NUMBER, 2, nullptr, ALIDADE_PARAM_HAS_DEFAULT);
constexpr AlidadeParam kTwoChoices = Declared(ALIDADE_PARAM_CHOICE, 2, nullptr, 0);
constexpr AlidadeParam kAnyChoices = Declared(ALIDADE_PARAM_CHOICE, -1, nullptr, 0);
constexpr AlidadeParam kDefaultBeyond =
    Declared(ALIDADE_PARAM_CHOICE, 1, &kBeyond, ALIDADE_PARAM_HAS_DEFAULT);

/// Entry of a model that reads `kParam` directly from the host. alidade::Params cannot be used,
/// because it always passes a complete parameter.
template <const AlidadeParam& kParam>
constexpr AlidadeEntry Reading(const char* name) {
  AlidadeEntry entry = ALIDADE_SENSOR(Probe, name, "", "");
  entry.create = [](const AlidadeHost* host, AlidadeInstance* instance) -> std::int32_t {
    double values[2] = {};
    host->read(host->context, &kParam, values, 2);
    alidade::Params params(host);
    alidade::EmplaceSensor<Probe>(params, instance);
    return ALIDADE_OK;
  };
  return entry;
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR(Throws, "throws", "", ""),
               ALIDADE_SENSOR(ThrowsInt, "throws_int", "", ""),
               ALIDADE_SENSOR(Misfit, "misfit", "", ""),
               ALIDADE_SENSOR_BY(MakeWrongKind, "wrong_kind", "", ""),
               Reading<kNoDefault>("no_default"), Reading<kNoNumber>("no_number"),
               Reading<kTwoChoices>("two_choices"), Reading<kAnyChoices>("any_choices"),
               Reading<kDefaultBeyond>("default_beyond"), Reading<kLaterFlag>("later_flag"),
               Reading<kReservedMember>("reserved_member"), Reading<kNoKey>("no_key"),
               Reading<kGap>("gap_in_key"), Reading<kHuge>("huge"),
               ALIDADE_SENSOR(Forges, "forges", "", ""),
               ALIDADE_SENSOR(AsksMuch, "asks_much", "", ""), Reading<kEmptyRange>("empty_range"),
               Reading<kManyChoices>("many_choices"), Reading<kHalf>("half"),
               Reading<kOutside>("outside"), Reading<kTextAsNumber>("text_as_number"),
               ALIDADE_SENSOR(Titled, "titled", "", ""))
