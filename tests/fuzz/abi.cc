// SPDX-License-Identifier: Apache-2.0
//
// What a plugin of the C ABI says of itself, made from bytes: a table, an instance with its
// description, and the parameters that it asks for. Pointers lead to something of their type, or
// are null; a plugin may be wrong in all else.
#include <array>
#include <cstring>
#include <deque>
#include <iterator>
#include <limits>
#include <memory>

#include "alidade/host/model_instance.h"
#include "alidade/host/param_reader.h"
#include "alidade/host/plugin_file.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

/// Takes values from the input; zeros at its end.
class Bytes {
 public:
  explicit Bytes(std::string_view input) : input_(input) {}

  template <class T>
  T Take() {
    T value{};
    const std::size_t size = std::min(sizeof(T), input_.size());
    std::memcpy(&value, input_.data(), size);
    input_.remove_prefix(size);
    return value;
  }
  /// Below n, by one byte.
  std::size_t Pick(std::size_t n) { return Take<std::uint8_t>() % n; }
  /// As most plugins have it, or by one byte in eight anything.
  template <class T>
  T Mostly(T usual) {
    return Pick(8) == 7 ? Take<T>() : usual;
  }
  std::string Text(std::size_t most) {
    const std::size_t size = std::min({Pick(256), most, input_.size()});
    std::string text(input_.substr(0, size));
    input_.remove_prefix(size);
    return text;
  }

 private:
  std::string_view input_;
};

std::int32_t Answer() { return ALIDADE_OK; }

/// Structs of one plugin, which live as long as this.
class Arena {
 public:
  explicit Arena(Bytes& bytes) : bytes_(bytes) {
    for (std::size_t i = 0; i < numbers_.size(); ++i) numbers_[i] = i % 7 == 0 ? 1.0 : 0.0;
    if (bytes.Pick(4) == 3) numbers_[bytes.Pick(8)] = bytes.Take<double>();
    choices_.fill("c");
    choices_[0] = "a";
    choices_[1] = Text();
  }

  const char* Text() {
    static constexpr const char* kTexts[] = {
        nullptr, "",        "x",   "y",        "a,b",
        "a,b,c", "w,x,y,z", "rad", "nested.e", "landmarks.representation"};
    const std::size_t at = bytes_.Pick(std::size(kTexts) + 2);
    if (at < std::size(kTexts)) return kTexts[at];
    constexpr std::size_t kLong = ALIDADE_MAX_TEXT + 1;
    texts_.push_back(at == std::size(kTexts) ? bytes_.Text(64) : std::string(kLong, 'x'));
    return texts_.back().c_str();
  }
  const double* Numbers() { return bytes_.Pick(3) == 0 ? nullptr : numbers_.data(); }
  /// Some value that a size may have, but none that is huge and allowed.
  std::int32_t Size() {
    static constexpr std::int32_t kSizes[] = {1,
                                              2,
                                              3,
                                              4,
                                              6,
                                              16,
                                              0,
                                              -1,
                                              ALIDADE_MAX_SIZE + 1,
                                              std::numeric_limits<std::int32_t>::max(),
                                              std::numeric_limits<std::int32_t>::min()};
    return kSizes[bytes_.Pick(std::size(kSizes))];
  }

  AlidadeSpace Space(int depth) {
    AlidadeSpace space{};
    space.struct_size = bytes_.Mostly<std::uint32_t>(sizeof space);
    space.geometry = bytes_.Mostly<std::uint32_t>(1 + static_cast<std::uint32_t>(bytes_.Pick(6)));
    space.ambient = Size();
    space.tangent = bytes_.Pick(2) == 0 ? space.ambient : Size();
    space.flags =
        static_cast<std::uint32_t>(bytes_.Pick(64)) << 15 | bytes_.Mostly<std::uint32_t>(0);
    space.reserved0 = bytes_.Mostly<std::uint32_t>(0);
    space.name = Text();
    space.unit = Text();
    space.elements = Text();
    space.doc = Text();
    const bool fits = space.ambient <= kRoot && space.tangent <= kRoot;
    if (fits && bytes_.Pick(3) == 0) space.owned = Owned();
    if (depth < 2 && bytes_.Pick(3) == 0) {
      space.parts = Spaces(depth + 1, space.part_count, space.part_stride);
    }
    return space;
  }
  const AlidadeSpace* OneSpace() {
    if (bytes_.Pick(4) == 0) return nullptr;
    spaces_.push_back(Space(0));
    return &spaces_.back();
  }
  /// A table with room for what a host may read of it, whatever count and stride say.
  const AlidadeSpace* Spaces(int depth, std::uint32_t& count, std::uint32_t& stride) {
    constexpr std::size_t kMost = sizeof(AlidadeSpace) + 64;
    auto& table = tables_.emplace_back((ALIDADE_MAX_ROLES + 1) * kMost / sizeof(double));
    static constexpr std::uint32_t kStrides[] = {sizeof(AlidadeSpace),
                                                 sizeof(AlidadeSpace) + 64,
                                                 64,
                                                 8,
                                                 4,
                                                 0,
                                                 sizeof(AlidadeSpace) + 4,
                                                 1u << 17};
    const std::size_t made = bytes_.Pick(4);
    count =
        bytes_.Pick(4) == 3 ? bytes_.Take<std::uint32_t>() % 70 : static_cast<std::uint32_t>(made);
    stride = kStrides[bytes_.Pick(2) == 0 ? 0 : bytes_.Pick(std::size(kStrides))];
    auto* const at = reinterpret_cast<char*>(table.data());
    for (std::size_t i = 0; i < made && stride <= kMost; ++i) {
      const AlidadeSpace space = Space(depth);
      std::memcpy(at + i * stride, &space, sizeof space);
    }
    return bytes_.Pick(8) == 7 ? nullptr : reinterpret_cast<const AlidadeSpace*>(at);
  }

  AlidadeParam Param() {
    AlidadeParam param{};
    param.struct_size = bytes_.Mostly<std::uint32_t>(sizeof param);
    param.kind = bytes_.Mostly<std::uint32_t>(static_cast<std::uint32_t>(bytes_.Pick(7)));
    static constexpr const char* kKeys[] = {"number", "list",     "flag",
                                            "word",   "nested.e", "camera.fx"};
    const std::size_t key = bytes_.Pick(std::size(kKeys) + 1);
    param.key = key < std::size(kKeys) ? kKeys[key] : Text();
    param.unit = Text();
    param.doc = Text();
    param.count = bytes_.Pick(2) == 0 ? 1 : Size();
    param.flags =
        static_cast<std::uint32_t>(bytes_.Pick(32)) << 15 | bytes_.Mostly<std::uint32_t>(0);
    param.low = bytes_.Mostly(-std::numeric_limits<double>::infinity());
    param.high = bytes_.Mostly(std::numeric_limits<double>::infinity());
    if (param.count <= std::ssize(numbers_)) param.fallback = Numbers();
    if (bytes_.Pick(2) == 0) param.choices = choices_.data();
    param.choice_count = bytes_.Pick(2) == 0 ? Size() : ALIDADE_MAX_CHOICES;
    param.reserved0 = bytes_.Mostly<std::int32_t>(0);
    param.fallback_text = Text();
    return param;
  }

  const AlidadeDescription* Description() {
    if (bytes_.Pick(16) == 15) return nullptr;
    description_.struct_size = bytes_.Mostly<std::uint32_t>(sizeof description_);
    description_.capabilities =
        static_cast<std::uint32_t>(bytes_.Pick(64)) << 15 | bytes_.Mostly<std::uint32_t>(0);
    description_.roles = Spaces(0, description_.role_count, description_.role_stride);
    description_.output = OneSpace();
    if (bytes_.Pick(4) == 0) description_.known = OneSpace();
    if (bytes_.Pick(8) == 0) description_.residual = OneSpace();
    if (bytes_.Pick(2) == 0) {
      description_.inputs = Spaces(1, description_.input_count, description_.input_stride);
    }
    description_.noise_count = Size();
    description_.initialise_role = Size();
    description_.prior_count = Size();
    description_.reserved0 = bytes_.Mostly<std::int32_t>(0);
    return &description_;
  }
  const AlidadeSensor* Sensor() {
    if (bytes_.Pick(8) == 7) return nullptr;
    sensor_.struct_size = bytes_.Mostly<std::uint32_t>(sizeof sensor_);
    if (bytes_.Pick(8) != 7) {
      sensor_.eval = [](auto...) { return Answer(); };
      sensor_.sqrt_noise = [](auto...) { return Answer(); };
    }
    if (bytes_.Pick(2) == 0) sensor_.initialise = [](auto...) { return Answer(); };
    return &sensor_;
  }
  const AlidadeMotion* Motion() {
    if (bytes_.Pick(8) == 7) return nullptr;
    motion_.struct_size = bytes_.Mostly<std::uint32_t>(sizeof motion_);
    if (bytes_.Pick(8) != 7) {
      motion_.step = [](auto...) { return Answer(); };
      motion_.sqrt_q = [](auto...) { return Answer(); };
    }
    return &motion_;
  }
  const AlidadeTable* Table() {
    table_.struct_size = bytes_.Mostly<std::uint32_t>(sizeof table_);
    table_.magic = bytes_.Mostly<std::uint32_t>(ALIDADE_MAGIC);
    table_.abi_major = bytes_.Mostly<std::uint16_t>(ALIDADE_ABI_MAJOR);
    table_.entry_stride = bytes_.Pick(4) == 3 ? static_cast<std::uint32_t>(8 * bytes_.Pick(20))
                                              : static_cast<std::uint32_t>(sizeof(AlidadeEntry));
    table_.entry_count = static_cast<std::uint32_t>(bytes_.Pick(entries_.size() + 1));
    table_.flags = bytes_.Mostly<std::uint32_t>(0);
    table_.entries = bytes_.Pick(8) == 7 ? nullptr : entries_.data();
    if (table_.entry_stride > sizeof(AlidadeEntry)) table_.entry_count %= 2;
    for (AlidadeEntry& entry : entries_) {
      entry.struct_size = bytes_.Mostly<std::uint32_t>(sizeof entry);
      entry.kind = static_cast<std::uint32_t>(bytes_.Pick(4));
      entry.family = Text();
      entry.name = Text();
      entry.doc = Text();
      entry.citation = Text();
      entry.version = Text();
      entry.flags = bytes_.Mostly<std::uint32_t>(0);
      if (bytes_.Pick(8) != 7) entry.create = [](auto...) { return Answer(); };
    }
    return &table_;
  }

 private:
  static constexpr std::int32_t kRoot = 16;  // its square is how many numbers there are

  const AlidadeOwned* Owned() {
    AlidadeOwned owned{};
    owned.struct_size = bytes_.Mostly<std::uint32_t>(sizeof owned);
    owned.dynamics = static_cast<std::uint32_t>(bytes_.Pick(4));
    owned.mean = Numbers();
    owned.sqrt_prior = Numbers();
    owned.sqrt_density = Numbers();
    owned.time_constant_s = bytes_.Mostly(1.0);
    owned_.push_back(owned);
    return &owned_.back();
  }

  Bytes& bytes_;
  std::array<double, kRoot * kRoot> numbers_{};
  std::array<const char*, ALIDADE_MAX_CHOICES> choices_{};
  std::array<AlidadeEntry, 3> entries_{};
  std::deque<std::string> texts_;
  std::deque<AlidadeSpace> spaces_;
  std::deque<AlidadeOwned> owned_;
  std::deque<std::vector<double>> tables_;
  AlidadeDescription description_{};
  AlidadeSensor sensor_{};
  AlidadeMotion motion_{};
  AlidadeTable table_{};
};

void MakeInstance(Bytes& bytes, Arena& arena) {
  int destroyed = 0;
  AlidadeInstance c{};
  c.struct_size = sizeof c;
  c.kind = bytes.Mostly<std::uint32_t>(1 + static_cast<std::uint32_t>(bytes.Pick(2)));
  c.self = &destroyed;
  c.destroy = [](void* self) { ++*static_cast<int*>(self); };
  c.description = arena.Description();
  c.sensor = arena.Sensor();
  c.motion = arena.Motion();
  static_cast<void>(Accepts([&] {
    const auto instance = std::make_shared<const ModelInstance>(c, "model", "plugin.so");
    std::vector<std::size_t> sizes;
    for (std::size_t i = 0; i < instance->spaces().size(); ++i) {
      const Space& space = instance->spaces()[i];
      Require(std::ssize(space.elements) == space.geometry.ambient, "elements without a name");
      Require(std::ssize(instance->owned(i).mean) == space.geometry.ambient,
              "a mean of another size");
    }
    Require(instance->spaces().size() == instance->tangents().size(), "a space without a tangent");
    if (c.kind == ALIDADE_KIND_SENSOR) {
      const SensorModel sensor(instance);
      Require(sensor.inverse().role < std::ssize(sensor.roles()), "initialises no role");
      static_cast<void>(sensor.has_landmark());
    } else {
      const MotionModel motion(instance);
      Require(motion.tangent_size() >= std::ssize(motion.blocks()), "blocks without a size");
    }
  }));
  Require(destroyed == 1, "not destroyed, or twice");
}

void AskForParameters(Bytes& bytes, Arena& arena) {
  const Config config = Config::FromText(
      "{model: {number: 1.5, list: [1, 2, 3], flag: true, word: a, nested: {e: 2}}, camera: {fx: "
      "3}}",
      "entry");
  internal::ParamReader reader(config.root().At("model"), "model", "a");
  internal::ParamRecorder recorder;
  for (const AlidadeHost* host : {&reader.host(), &recorder.host()}) {
    for (std::size_t left = 1 + bytes.Pick(4); left > 0; --left) {
      const AlidadeParam param = arena.Param();
      double values[64];
      std::array<char, ALIDADE_MAX_TEXT + 1> text;
      const auto capacity = static_cast<std::int32_t>(bytes.Pick(std::size(values) + 1));
      Require(host->read(host->context, &param, values, capacity) <= capacity,
              "more than there is room for");
      Require(host->read_text(host->context, &param, text.data(),
                              static_cast<std::int32_t>(text.size())) <= ALIDADE_MAX_TEXT,
              "a text that is too long");
      if (bytes.Pick(4) == 3) host->fail(host->context, arena.Text(), arena.Text());
    }
  }
  static_cast<void>(Accepts([&] { reader.Check(); }));
  static_cast<void>(recorder.Result());
}

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  Bytes bytes(TextOf(data, size));
  Arena arena(bytes);
  switch (bytes.Pick(3)) {
    case 0:
      MakeInstance(bytes, arena);
      break;
    case 1:
      AskForParameters(bytes, arena);
      break;
    default:
      static_cast<void>(alidade::internal::Defect(arena.Table()));
  }
  return 0;
}
