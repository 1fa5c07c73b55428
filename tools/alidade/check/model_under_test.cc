// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/model_under_test.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/plugin/abi_read.h"
#include "alidade/plugin/plugin_models.h"

namespace alidade::internal {
namespace {

constexpr double kPoison = 1e302;
constexpr double kGuardWord = -7.0546875e-251;  // a value that no model computes

bool SameBits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// Fills the stack that the next call will use with kPoison, to reveal uninitialised local
/// variables.
[[gnu::noinline]] void PoisonStack() {
  volatile double cells[4096];
  for (volatile double& cell : cells) cell = kPoison;
}

Space MakeSpace(const char* name, const Geometry& geometry) {
  Space space;
  space.name = name;
  space.geometry = geometry;
  space.elements.resize(static_cast<std::size_t>(geometry.ambient));
  for (int i = 0; i < geometry.ambient && geometry.ambient > 1; ++i) {
    space.elements[static_cast<std::size_t>(i)] = std::to_string(i);
  }
  return space;
}

std::vector<int> FirstSlots(int count) {
  std::vector<int> slots;
  for (int i = 0; i < count; ++i) slots.push_back(i);
  return slots;
}

/// Copies `root`, the n x n noise factor of the config, to `l`. Returns false if the config does
/// not contain a factor.
bool CopyConfigNoise(const std::vector<double>& root, int n, double* l, std::int32_t stride) {
  for (int i = 0; i < n && !root.empty(); ++i) std::copy_n(root.data() + i * n, n, l + i * stride);
  return !root.empty();
}

void AddSensor(const AlidadeInstance& c, const std::vector<Space>& roles, const Space& z,
               ModelUnderTest& model) {
  const AlidadeSensor sensor = *c.sensor;
  const void* const self = c.self;
  const int count = static_cast<int>(roles.size()), m = z.geometry.tangent;
  const auto with_known = [&](std::vector<int> slots) {  // the known numbers are the last input
    if (model.known_slot >= 0) slots.push_back(model.known_slot);
    return slots;
  };
  const bool has_known = model.known_slot >= 0;
  Function predict{"Predict", with_known(FirstSlots(count)), {z}, {}, count, false, {}};
  for (const Space& role : roles) predict.matrices.push_back({m, role.geometry.tangent});
  predict.call = [=](const double* const* inputs, double* const* out, double* const* jacobians,
                     const std::int32_t* strides) {
    const bool requested = std::any_of(jacobians, jacobians + count, [](auto* j) { return j; });
    const AlidadeObservation observation =
        MakeObservation(nullptr, has_known ? inputs[count] : nullptr);
    return sensor.eval(self, &observation, inputs, out[0], requested ? jacobians : nullptr,
                       requested ? strides : nullptr);
  };
  model.functions.push_back(std::move(predict));
  model.functions.push_back(
      {"SqrtNoise",
       with_known(FirstSlots(count + 1)),
       {},
       {{m, m}},
       0,
       true,
       [=, &given = model.instance->noise_root()](const double* const* inputs, double* const*,
                                                  double* const* l, const std::int32_t* strides) {
         if (CopyConfigNoise(given, m, l[0], strides[0])) return std::int32_t{ALIDADE_OK};
         const AlidadeObservation observation =
             MakeObservation(inputs[count], has_known ? inputs[count + 1] : nullptr);
         return sensor.sqrt_noise(self, &observation, inputs, l[0], strides[0]);
       }});
  if (sensor.valid != nullptr) {
    model.functions.push_back(
        {"Valid",
         with_known({count}),
         {},
         {},
         0,
         false,
         [=](const double* const* inputs, double* const*, double* const*, const std::int32_t*) {
           const AlidadeObservation observation =
               MakeObservation(inputs[0], has_known ? inputs[1] : nullptr);
           return sensor.valid(self, &observation);
         }});
  }
}

/// Copies the values of several outputs to one row. The guard words after the last output follow.
std::vector<double> Gather(const std::vector<Space>& outputs, const double* const* out) {
  constexpr int kGuardWords = 8;
  std::vector<double> row;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const int guards = i + 1 == outputs.size() ? kGuardWords : 0;
    row.insert(row.end(), out[i], out[i] + outputs[i].geometry.ambient + guards);
  }
  return row;
}

/// Copies a row of Gather(), to which a call may have written, back to the outputs.
void Scatter(const std::vector<double>& row, const std::vector<Space>& outputs,
             double* const* out) {
  const double* begin = row.data();
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const double* const end = begin + outputs[i].geometry.ambient;
    std::copy(begin, i + 1 == outputs.size() ? row.data() + row.size() : end, out[i]);
    begin = end;
  }
}

/// Adds the function Initialise: y = g(other roles, z, prior). y is one role, or all roles of a
/// landmark.
void AddInitialise(const AlidadeInstance& c, const std::vector<Space>& roles, const Space& z,
                   ModelUnderTest& model) {
  const AlidadeSensor sensor = *c.sensor;
  const void* const self = c.self;
  const auto count = roles.size();
  const std::vector<int> y = model.InitialisedRoles();
  const auto is_y = [y](std::size_t i) { return std::ranges::count(y, static_cast<int>(i)) > 0; };
  const int prior = c.description->prior_count;
  Function f{"Initialise", {}, {}, {}, 0, false, {}};
  int n = 0;
  for (const int i : y) {
    f.outputs.push_back(roles[static_cast<std::size_t>(i)]);
    n += f.outputs.back().geometry.tangent;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (is_y(i)) continue;
    f.slots.push_back(static_cast<int>(i));
    f.matrices.push_back({n, roles[i].geometry.tangent});
  }
  f.slots.push_back(model.measurement_slot());
  f.matrices.push_back({n, z.geometry.tangent});
  if (prior > 0) {
    f.slots.push_back(model.measurement_slot() + 1);
    f.matrices.push_back({n, prior});
  }
  f.differentiated = static_cast<int>(f.slots.size());
  const bool has_known = model.known_slot >= 0;
  if (has_known) f.slots.push_back(model.known_slot);
  f.call = [=, outputs = f.outputs](const double* const* inputs, double* const* out,
                                    double* const* j, const std::int32_t* strides) {
    std::vector<const double*> role_values(count, nullptr);
    std::vector<double*> jx(count, nullptr);
    std::vector<std::int32_t> jx_strides(count, 0);
    std::size_t k = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (is_y(i)) continue;
      role_values[i] = inputs[k];
      jx[i] = j[k];
      jx_strides[i] = strides[k++];
    }
    const bool has_prior = prior > 0, has_several = outputs.size() > 1;
    std::vector<double> row = has_several ? Gather(outputs, out) : std::vector<double>();
    const AlidadeObservation observation =
        MakeObservation(inputs[k], has_known ? inputs[k + (has_prior ? 2 : 1)] : nullptr);
    const std::int32_t code = sensor.initialise(
        self, &observation, role_values.data(), has_prior ? inputs[k + 1] : nullptr,
        has_several ? row.data() : out[0], jx.data(), jx_strides.data(), j[k], strides[k],
        has_prior ? j[k + 1] : nullptr, has_prior ? strides[k + 1] : 0);
    if (has_several) Scatter(row, outputs, out);
    return code;
  };
  model.functions.push_back(std::move(f));
}

void AddMotion(const AlidadeInstance& c, const std::vector<Space>& blocks, bool has_input,
               ModelUnderTest& model) {
  const AlidadeMotion motion = *c.motion;
  const void* const self = c.self;
  const int count = static_cast<int>(blocks.size()), n_w = c.description->noise_count;
  const int dt = static_cast<int>(model.slots.size()) - 1;
  int n = 0;
  for (const Space& block : blocks) n += block.geometry.tangent;
  model.functions.push_back(
      {"Step",
       FirstSlots(dt + 1),
       blocks,
       {{n, n}, {n, n_w}},
       count + 1,
       false,
       [=](const double* const* inputs, double* const* out, double* const* j,
           const std::int32_t* strides) {
         return motion.step(self, inputs, has_input ? inputs + count + 1 : nullptr, inputs[count],
                            inputs[dt][0], out, j[0], strides[0], j[1], strides[1], nullptr, 0);
       }});
  if (n_w == 0) return;
  std::vector<int> slots = FirstSlots(count);
  slots.push_back(dt);
  if (has_input) slots.push_back(count + 1);
  model.functions.push_back(
      {"SqrtQ",
       std::move(slots),
       {},
       {{n_w, n_w}},
       0,
       true,
       [=, &given = model.instance->noise_root()](const double* const* inputs, double* const*,
                                                  double* const* l, const std::int32_t* strides) {
         if (CopyConfigNoise(given, n_w, l[0], strides[0])) return std::int32_t{ALIDADE_OK};
         return motion.sqrt_q(self, inputs, has_input ? inputs + count + 1 : nullptr,
                              inputs[count][0], l[0], strides[0]);
       }});
}

std::string ValueText(const std::vector<double>& value) {
  if (value.empty()) return "none";
  std::string text;
  for (std::size_t i = 0; i < value.size() && i < 16; ++i) {
    text += (i > 0 ? ", " : "") + RoundedText(value[i], 6);
  }
  if (value.size() > 16) text += ", ...";
  return value.size() == 1 ? text : '(' + text + ')';
}

}  // namespace

Buffer::Buffer(int rows, int columns)
    : rows_(rows),
      columns_(columns),
      cells_(2 * std::size_t{kGuard} +
                 static_cast<std::size_t>(rows) * (static_cast<std::size_t>(columns) + kGap),
             kGuardWord) {
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) cells_[Index(r, c)] = kPoison;
  }
}

bool Buffer::Untouched() const { return *this == Buffer(rows_, columns_); }

bool Buffer::GuardsIntact() const {
  const Buffer fresh(rows_, columns_);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (SameBits(fresh.cells_[i], kGuardWord) && !SameBits(cells_[i], kGuardWord)) return false;
  }
  return true;
}

bool operator==(const Buffer& a, const Buffer& b) {
  return a.rows_ == b.rows_ && a.columns_ == b.columns_ &&
         std::equal(a.cells_.begin(), a.cells_.end(), b.cells_.begin(), SameBits);
}

bool Unwritten(double cell) { return SameBits(cell, kPoison); }

ModelUnderTest::ModelUnderTest(std::shared_ptr<const ModelInstance> model_instance)
    : instance(std::move(model_instance)) {
  const AlidadeInstance& c = instance->c();
  slots = instance->spaces();
  if (is_sensor()) {
    slots.push_back(instance->space());
    const int prior = c.description->prior_count;
    if (prior > 0) slots.push_back(MakeSpace("prior", Geometry::Vector(prior)));
    if (!instance->known().name.empty()) {
      known_slot = static_cast<int>(slots.size());
      slots.push_back(instance->known());
    }
    AddSensor(c, instance->spaces(), instance->space(), *this);
    if ((instance->capabilities() & ALIDADE_CAN_INITIALISE) != 0) {
      AddInitialise(c, instance->spaces(), instance->space(), *this);
    }
    return;
  }
  const bool has_input = instance->has_input();
  slots.push_back(MakeSpace("w", Geometry::Vector(c.description->noise_count)));
  if (has_input) slots.push_back(instance->space());
  slots.push_back(MakeSpace("dt", Geometry::Vector(1)));
  AddMotion(c, instance->spaces(), has_input, *this);
}

std::vector<int> ModelUnderTest::InitialisedRoles() const {
  const PluginSensor sensor(instance);
  std::vector<int> roles(static_cast<std::size_t>(sensor.inverse().count));
  std::iota(roles.begin(), roles.end(), sensor.inverse().role);
  return roles;
}

const Function* ModelUnderTest::Find(const std::string& name) const {
  const auto found = std::find_if(functions.begin(), functions.end(),
                                  [&](const Function& f) { return f.name == name; });
  return found == functions.end() ? nullptr : &*found;
}

Answer CallFunction(const Function& function, const Values& inputs, int matrices) {
  Answer answer;
  std::vector<const double*> arguments;
  std::vector<double*> out, requested;
  std::vector<std::int32_t> strides;
  const Values passed(inputs.begin(), inputs.end());  // copy that a faulty model may overwrite
  for (const auto& input : passed) arguments.push_back(input.empty() ? nullptr : input.data());
  for (const Space& space : function.outputs)
    answer.outputs.emplace_back(1, space.geometry.ambient);
  for (const Shape& shape : function.matrices) {
    answer.matrices.emplace_back(shape.rows, shape.columns);
  }
  for (Buffer& buffer : answer.outputs) out.push_back(buffer.data());
  for (std::size_t i = 0; i < function.matrices.size(); ++i) {
    Buffer& buffer = answer.matrices[i];
    // An unbound role has no Jacobian.
    const bool exists =
        buffer.columns() > 0 && (!function.jacobian_per_input() || arguments[i] != nullptr);
    const bool selected = matrices == kAllMatrices || matrices == static_cast<int>(i);
    requested.push_back(exists && (selected || function.is_noise) ? buffer.data() : nullptr);
    strides.push_back(buffer.stride());
  }
  PoisonStack();
  answer.code = function.call(arguments.data(), out.data(), requested.data(), strides.data());
  for (std::size_t i = 0; i < passed.size() && answer.written_input < 0; ++i) {
    if (!std::ranges::equal(passed[i], inputs[i], SameBits))
      answer.written_input = static_cast<int>(i);
  }
  return answer;
}

std::string StateText(const std::vector<Space>& spaces, const Values& values) {
  std::string text;
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    if (spaces[i].geometry.ambient == 0) continue;
    text += (text.empty() ? "" : ", ") + spaces[i].name + " = " + ValueText(values[i]);
  }
  return text;
}

}  // namespace alidade::internal
