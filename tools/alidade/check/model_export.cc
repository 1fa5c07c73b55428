// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/model_export.h"

#include <algorithm>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/text.h"

namespace alidade::internal {
namespace {

/// Model of the program and its description with the types of plugin_abi.h, which refer to the
/// texts of the model.
struct ExportedModel {
  SharedSensor sensor;
  SharedMotion motion;
  std::deque<std::string> texts;
  std::vector<AlidadeSpace> spaces, parts;
  AlidadeSpace output{}, known{}, input{};
  AlidadeDescription description{};
};

std::int32_t CodeOf(Status status) { return static_cast<std::int32_t>(status); }

/// Copies a dense matrix with `columns` columns to rows with a distance of `stride`.
void CopyRows(const std::vector<double>& dense, int columns, double* rows, int stride) {
  if (rows == nullptr || columns == 0) return;
  for (std::size_t i = 0; i < dense.size() / static_cast<std::size_t>(columns); ++i) {
    std::copy_n(dense.data() + i * static_cast<std::size_t>(columns), columns,
                rows + i * static_cast<std::size_t>(stride));
  }
}

std::vector<double> Matrix(int rows, int columns) {
  return std::vector<double>(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
}
/// Returns a pointer for an output that is computed only if `requested` is not null.
double* Requested(const double* requested, std::vector<double>& matrix) {
  return requested == nullptr ? nullptr : matrix.data();
}

std::int32_t Evaluate(const void* self, const AlidadeObservation* seen, const double* const* roles,
                      double* z, double* const* jacobians, const std::int32_t* strides) {
  const SensorModel& sensor = *static_cast<const ExportedModel*>(self)->sensor;
  return CodeOf(sensor.Evaluate({seen->z, seen->known}, roles, {z, jacobians, strides, nullptr}));
}

std::int32_t SqrtNoise(const void* self, const AlidadeObservation* seen, const double* const* roles,
                       double* l, std::int32_t stride) {
  const SensorModel& sensor = *static_cast<const ExportedModel*>(self)->sensor;
  const int m = sensor.measurement().geometry.tangent;
  std::vector<double> dense = Matrix(m, m);
  const Status status = sensor.SqrtNoise(roles, seen->z, dense.data(), seen->known);
  if (status == Status::kOk) CopyRows(dense, m, l, stride);
  return CodeOf(status);
}

std::int32_t Valid(const void* self, const AlidadeObservation* seen) {
  return CodeOf(static_cast<const ExportedModel*>(self)->sensor->Valid({seen->z, seen->known}));
}

std::int32_t Initialise(const void* self, const AlidadeObservation* seen,
                        const double* const* roles, const double* prior, double* y,
                        double* const* jx, const std::int32_t* jx_strides, double* jz,
                        std::int32_t jz_stride, double* jp, std::int32_t jp_stride) {
  const SensorModel& sensor = *static_cast<const ExportedModel*>(self)->sensor;
  const InverseModel& inverse = sensor.inverse();
  int n = 0;
  for (int i = 0; i < inverse.count; ++i)
    n += sensor.roles()[static_cast<std::size_t>(inverse.role) + static_cast<std::size_t>(i)]
             .geometry.tangent;
  const int m = sensor.measurement().geometry.tangent;
  std::vector<double> dense_z = Matrix(n, m), dense_p = Matrix(n, inverse.prior_size);
  const Status status =
      sensor.Initialise(roles, {seen->z, seen->known}, prior,
                        {y, jx, jx_strides, Requested(jz, dense_z), Requested(jp, dense_p)});
  if (status == Status::kOk) {
    CopyRows(dense_z, m, jz, jz_stride);
    CopyRows(dense_p, inverse.prior_size, jp, jp_stride);
  }
  return CodeOf(status);
}

std::int32_t Step(const void* self, const double* const* blocks, const double* const* inputs,
                  const double* w, double dt_s, double* const* next, double* f,
                  std::int32_t f_stride, double* g, std::int32_t g_stride, double* /*b*/,
                  std::int32_t /*b_stride*/) {
  const MotionModel& motion = *static_cast<const ExportedModel*>(self)->motion;
  const int n = motion.tangent_size(), n_w = motion.noise_size();
  std::vector<double> dense_f = Matrix(n, n), dense_g = Matrix(n, n_w);
  const double* const input = motion.has_input() ? inputs[0] : nullptr;
  const Status status = motion.Step(blocks, input, w, dt_s,
                                    {next, Requested(f, dense_f), Requested(g, dense_g), nullptr});
  if (status == Status::kOk) {
    CopyRows(dense_f, n, f, f_stride);
    CopyRows(dense_g, n_w, g, g_stride);
  }
  return CodeOf(status);
}

std::int32_t SqrtQ(const void* self, const double* const* blocks, const double* const* inputs,
                   double dt_s, double* l, std::int32_t stride) {
  const MotionModel& motion = *static_cast<const ExportedModel*>(self)->motion;
  std::vector<double> dense = Matrix(motion.noise_size(), motion.noise_size());
  const Status status =
      motion.SqrtQ(blocks, motion.has_input() ? inputs[0] : nullptr, dt_s, dense.data());
  if (status == Status::kOk) CopyRows(dense, motion.noise_size(), l, stride);
  return CodeOf(status);
}

AlidadeSpace SpaceOf(const std::string& name, const std::string& unit, const Geometry& geometry,
                     const std::string& elements, unsigned flags) {
  AlidadeSpace c{};
  c.struct_size = sizeof c;
  c.geometry = geometry.row().number;
  c.ambient = geometry.ambient;
  c.tangent = geometry.tangent;
  c.flags = flags;
  c.name = name.c_str();
  c.unit = unit.c_str();
  c.elements = elements.c_str();
  c.doc = "";
  return c;
}

/// Converts a space that is not a product.
AlidadeSpace ToAbi(const Space& space, ExportedModel& model) {
  model.texts.push_back(Join(space.elements, ","));
  return SpaceOf(space.name, space.unit, space.geometry, model.texts.back(), space.flags);
}

AlidadeSpace MeasurementOf(const Space& space, ExportedModel& model) {
  if (!space.geometry.is_product()) return ToAbi(space, model);
  model.texts.emplace_back();
  const std::string& no_text = model.texts.back();
  for (std::size_t i = 0; i < space.parts.size(); ++i) {
    model.parts.push_back(
        SpaceOf(space.parts[i], space.part_units[i], space.geometry.parts[i], no_text, 0));
  }
  AlidadeSpace product = SpaceOf(space.name, no_text, space.geometry, no_text, 0);
  product.parts = model.parts.data();
  product.part_count = static_cast<std::uint32_t>(model.parts.size());
  product.part_stride = sizeof(AlidadeSpace);
  return product;
}

/// Describes the roles or blocks, and returns the instance of the model.
AlidadeInstance InstanceOf(std::unique_ptr<ExportedModel> model, const std::vector<Space>& spaces,
                           std::uint32_t kind) {
  for (const Space& space : spaces) model->spaces.push_back(ToAbi(space, *model));
  AlidadeDescription& description = model->description;
  description.struct_size = sizeof description;
  description.role_count = static_cast<std::uint32_t>(model->spaces.size());
  description.role_stride = sizeof(AlidadeSpace);
  description.roles = model->spaces.data();
  AlidadeInstance instance{};
  instance.struct_size = sizeof instance;
  instance.kind = kind;
  instance.destroy = [](void* self) {
    const std::unique_ptr<ExportedModel> owner(static_cast<ExportedModel*>(self));
  };
  instance.description = &description;
  instance.self = model.release();
  return instance;
}

}  // namespace

std::shared_ptr<const ModelInstance> ExportModel(const SharedSensor& sensor) {
  auto model = std::make_unique<ExportedModel>();
  model->sensor = sensor;
  model->output = MeasurementOf(sensor->measurement(), *model);
  AlidadeDescription& description = model->description;
  description.output = &model->output;
  if (sensor->known_size() > 0) {
    model->known = ToAbi(sensor->known(), *model);
    description.known = &model->known;
  }
  description.initialise_role = sensor->inverse().role;
  description.prior_count = sensor->inverse().prior_size;
  AlidadeSensor calls{};
  calls.struct_size = sizeof calls;
  calls.eval = Evaluate;
  calls.sqrt_noise = SqrtNoise;
  if (sensor->description().has_validity) {
    description.capabilities |= ALIDADE_HAS_VALIDITY;
    calls.valid = Valid;
  }
  if (sensor->inverse().role >= 0) {
    description.capabilities |= ALIDADE_CAN_INITIALISE;
    calls.initialise = Initialise;
  }
  AlidadeInstance instance = InstanceOf(std::move(model), sensor->roles(), ALIDADE_KIND_SENSOR);
  instance.sensor = &calls;
  return std::make_shared<ModelInstance>(instance, sensor->name(), "the config");
}

std::shared_ptr<const ModelInstance> ExportModel(const SharedMotion& motion, unsigned step_order) {
  auto model = std::make_unique<ExportedModel>();
  model->motion = motion;
  AlidadeDescription& description = model->description;
  if (motion->has_input()) {
    model->input = ToAbi(motion->input(), *model);
    description.inputs = &model->input;
    description.input_count = 1;
    description.input_stride = sizeof(AlidadeSpace);
  }
  description.noise_count = motion->noise_size();
  description.initialise_role = -1;
  description.capabilities = step_order << ALIDADE_STEP_ORDER_SHIFT;
  if (motion->discrete_noise()) description.capabilities |= ALIDADE_DISCRETE_NOISE;
  AlidadeMotion calls{};
  calls.struct_size = sizeof calls;
  calls.step = Step;
  calls.sqrt_q = SqrtQ;
  AlidadeInstance instance = InstanceOf(std::move(model), motion->blocks(), ALIDADE_KIND_MOTION);
  instance.motion = &calls;
  return std::make_shared<ModelInstance>(instance, motion->name(), "the config");
}

}  // namespace alidade::internal
