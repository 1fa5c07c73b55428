/* SPDX-License-Identifier: Apache-2.0 */
/* A plugin of a later minor version, compiled with the header that grow.sh derives. All structs are
 * larger than those of 1.0. The members that 1.0 does not have are set, and hints are set too. Each
 * model except the first uses one feature that a host must support. NEEDS_MINOR is the minor
 * version in the build tag. */
#include <stdlib.h>
#include <string.h>

#include "alidade/model/plugin_abi.h"

#ifndef NEEDS_MINOR
#define NEEDS_MINOR 0
#endif
#define EXPORTED __attribute__((visibility("default")))
#define LATER \
  { ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u }

EXPORTED extern const AlidadeBuildTag alidade_build_tag;
__attribute__((section(ALIDADE_BUILD_TAG_SECTION), used))
const AlidadeBuildTag alidade_build_tag = {.magic = "ALIDADE",
                                           .struct_size = sizeof(AlidadeBuildTag),
                                           .abi_major = ALIDADE_ABI_MAJOR,
                                           .abi_minor = ALIDADE_ABI_MINOR,
                                           .needs_minor = NEEDS_MINOR,
                                           .kind = ALIDADE_PLUGIN_C_ABI,
                                           .flags = ALIDADE_LATER_HINT,
                                           .compiler = __VERSION__,
                                           .later = LATER};

enum Use {
  USES_NOTHING,
  ROLE,
  ROLE_MEMBER,
  OWNED,
  OWNED_MEMBER,
  GEOMETRY,
  CAPABILITY,
  DESCRIPTION,
  CALLS,
  INSTANCE,
  PARAMETER,
  PARAMETER_KIND,
  PARAMETER_MEMBER,
  CODE
};

typedef struct Model {
  enum Use use;
  AlidadeDescription description;
  AlidadeSpace roles[2], output;
  AlidadeOwned owned;
  AlidadeSensor calls;
} Model;

/* z = 2 x + b */
static int32_t eval(const void* self, const AlidadeObservation* seen, const double* const* roles,
                    double* z, double* const* jacobians, const int32_t* strides) {
  const Model* model = self;
  (void)seen, (void)strides;
  if (model->use == CODE) return 5;
  z[0] = 2.0 * roles[0][0] + roles[1][0];
  if (jacobians != NULL && jacobians[0] != NULL) jacobians[0][0] = 2.0;
  if (jacobians != NULL && jacobians[1] != NULL) jacobians[1][0] = 1.0;
  return ALIDADE_OK;
}

static int32_t sqrt_noise(const void* self, const AlidadeObservation* seen,
                          const double* const* roles, double* l, int32_t stride) {
  (void)self, (void)seen, (void)roles, (void)stride;
  l[0] = 0.5;
  return ALIDADE_OK;
}

static void new_call(void) {}

static AlidadeSpace space(const char* name) {
  const AlidadeSpace made = {.struct_size = sizeof(AlidadeSpace),
                             .geometry = ALIDADE_VECTOR,
                             .ambient = 1,
                             .tangent = 1,
                             .flags = ALIDADE_LATER_HINT,
                             .name = name,
                             .later = LATER};
  return made;
}

static void read_parameter(const AlidadeHost* host, enum Use use) {
  static const double kOne = 1.0;
  AlidadeParam asked = {.struct_size = sizeof(AlidadeParam),
                        .kind = use == PARAMETER_KIND ? 7 : ALIDADE_PARAM_NUMBER,
                        .key = "gain",
                        .count = 1,
                        .flags = ALIDADE_PARAM_HAS_DEFAULT | ALIDADE_LATER_HINT,
                        .low = 0.0,
                        .high = 2.0,
                        .fallback = &kOne,
                        .later = LATER};
  double value = 1.0;
  if (use == PARAMETER) asked.flags |= ALIDADE_LATER_BIT;
  if (use == PARAMETER_MEMBER) asked.taken = &value;
  host->read(host->context, &asked, &value, 1);
}

static void describe(Model* model) {
  const uint32_t later[8] = LATER;
  model->roles[0] = space("x");
  model->roles[1] = space("b");
  model->roles[1].flags |= ALIDADE_ROLE_OWNED;
  model->roles[1].owned = &model->owned;
  model->output = space("z");
  model->owned.struct_size = sizeof(AlidadeOwned);
  model->calls.struct_size = sizeof(AlidadeSensor);
  model->calls.eval = eval;
  model->calls.sqrt_noise = sqrt_noise;
  model->description.struct_size = sizeof(AlidadeDescription);
  model->description.capabilities = ALIDADE_ANALYTIC_JACOBIAN | ALIDADE_LATER_HINT;
  model->description.role_count = 2;
  model->description.role_stride = sizeof(AlidadeSpace);
  model->description.roles = model->roles;
  model->description.output = &model->output;
  model->description.initialise_role = -1;
  memcpy(model->owned.later, later, sizeof(later));
  memcpy(model->calls.later, later, sizeof(later));
  memcpy(model->description.later, later, sizeof(later));
}

static int32_t make(const AlidadeHost* host, AlidadeInstance* instance, enum Use use) {
  Model* model = calloc(1, sizeof(Model));
  if (model == NULL) return ALIDADE_ERROR;
  model->use = use;
  read_parameter(host, use);
  describe(model);
  if (use == ROLE) model->roles[0].flags |= ALIDADE_LATER_BIT;
  if (use == ROLE_MEMBER) model->roles[0].reserved[0] = model;
  if (use == OWNED) model->owned.dynamics = 7;
  if (use == OWNED_MEMBER) model->owned.taken = model;
  if (use == GEOMETRY) model->output.geometry = 6;
  if (use == CAPABILITY) model->description.capabilities |= ALIDADE_LATER_BIT;
  if (use == DESCRIPTION) model->description.taken = model;
  if (use == CALLS) model->calls.taken = new_call;
  if (use == INSTANCE) instance->taken = model;
  instance->kind = ALIDADE_KIND_SENSOR;
  instance->self = model;
  instance->destroy = free;
  instance->description = &model->description;
  instance->sensor = &model->calls;
  return ALIDADE_OK;
}

#define MAKE(use)                                                          \
  static int32_t make_##use(const AlidadeHost* host, AlidadeInstance* i) { \
    return make(host, i, use);                                             \
  }
#define ENTRY(of, called, with)                                                                  \
  {                                                                                              \
    .struct_size = sizeof(AlidadeEntry), .kind = of, .name = called,                             \
    .thread_flags = 3u | ALIDADE_LATER_HINT, .flags = ALIDADE_LATER_HINT, .create = make_##with, \
    .later = LATER                                                                               \
  }
#define USES(called, with) ENTRY(ALIDADE_KIND_SENSOR, called, with)

MAKE(USES_NOTHING)
MAKE(ROLE)
MAKE(ROLE_MEMBER)
MAKE(OWNED)
MAKE(OWNED_MEMBER)
MAKE(GEOMETRY)
MAKE(CAPABILITY)
MAKE(DESCRIPTION)
MAKE(CALLS)
MAKE(INSTANCE)
MAKE(PARAMETER)
MAKE(PARAMETER_KIND)
MAKE(PARAMETER_MEMBER)
MAKE(CODE)

EXPORTED const AlidadeTable* alidade_plugin(void) {
  static const AlidadeEntry entries[] = {ENTRY(ALIDADE_KIND_LATER, "later_thing", USES_NOTHING),
                                         USES("later_sensor", USES_NOTHING),
                                         USES("later_role", ROLE),
                                         USES("later_role_member", ROLE_MEMBER),
                                         USES("later_dynamics", OWNED),
                                         USES("later_owned_member", OWNED_MEMBER),
                                         USES("later_geometry", GEOMETRY),
                                         USES("later_capability", CAPABILITY),
                                         USES("later_description_member", DESCRIPTION),
                                         USES("later_call", CALLS),
                                         USES("later_instance_member", INSTANCE),
                                         USES("later_parameter", PARAMETER),
                                         USES("later_parameter_kind", PARAMETER_KIND),
                                         USES("later_parameter_member", PARAMETER_MEMBER),
                                         USES("later_code", CODE)};
  static const AlidadeTable table = {.struct_size = sizeof(AlidadeTable),
                                     .magic = ALIDADE_MAGIC,
                                     .abi_major = ALIDADE_ABI_MAJOR,
                                     .abi_minor = ALIDADE_ABI_MINOR,
                                     .entry_stride = sizeof(AlidadeEntry),
                                     .entry_count = sizeof(entries) / sizeof(*entries),
                                     .flags = ALIDADE_LATER_HINT,
                                     .entries = entries,
                                     .build_tag = &alidade_build_tag,
                                     .later = LATER};
  return &table;
}
