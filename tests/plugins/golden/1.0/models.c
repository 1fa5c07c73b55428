/* SPDX-License-Identifier: Apache-2.0 */
/* The models of models.cc in C99, written with plugin_abi.h alone. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "alidade/model/plugin_abi.h"

#define EXPORTED __attribute__((visibility("default")))

EXPORTED extern const AlidadeBuildTag alidade_build_tag;
__attribute__((section(ALIDADE_BUILD_TAG_SECTION), used))
const AlidadeBuildTag alidade_build_tag = {.magic = "ALIDADE",
                                           .struct_size = sizeof(AlidadeBuildTag),
                                           .abi_major = ALIDADE_ABI_MAJOR,
                                           .abi_minor = ALIDADE_ABI_MINOR,
                                           .kind = ALIDADE_PLUGIN_C_ABI,
                                           .compiler = __VERSION__};

static AlidadeSpace space(uint32_t geometry, int32_t ambient, int32_t tangent, const char* name,
                          const char* unit, const char* elements) {
  const AlidadeSpace made = {.struct_size = sizeof(AlidadeSpace),
                             .geometry = geometry,
                             .ambient = ambient,
                             .tangent = tangent,
                             .name = name,
                             .unit = unit,
                             .elements = elements,
                             .doc = "in C"};
  return made;
}

/* ---- parameters ------------------------------------------------------------------------------ */

static AlidadeParam param(uint32_t kind, const char* key, const char* unit,
                          const double* fallback) {
  const AlidadeParam made = {.struct_size = sizeof(AlidadeParam),
                             .kind = kind,
                             .key = key,
                             .unit = unit,
                             .doc = "in C",
                             .count = 1,
                             .flags = fallback != NULL ? ALIDADE_PARAM_HAS_DEFAULT : 0u,
                             .low = -INFINITY,
                             .high = INFINITY,
                             .fallback = fallback};
  return made;
}

/* Returns one value, or 1 after an error, which the host has recorded. */
static double read_one(const AlidadeHost* host, const AlidadeParam* asked) {
  double value = 1.0;
  return host->read(host->context, asked, &value, 1) == 1 ? value : 1.0;
}

static double positive(const AlidadeHost* host, const char* key, const char* unit) {
  AlidadeParam asked = param(ALIDADE_PARAM_NUMBER, key, unit, NULL);
  asked.low = 0.0;
  asked.flags |= ALIDADE_PARAM_LOW_OPEN;
  return read_one(host, &asked);
}

static double not_negative(const AlidadeHost* host, const char* key, const char* unit,
                           const double* fallback) {
  AlidadeParam asked = param(ALIDADE_PARAM_NUMBER, key, unit, fallback);
  asked.low = 0.0;
  return read_one(host, &asked);
}

/* ---- golden_line ----------------------------------------------------------------------------- */

typedef struct Line {
  AlidadeDescription description;
  AlidadeSpace roles[2], length, anchor;
  AlidadeOwned owned;
  double gain, height_m, sigma_m, max_m, side;
  int relative;
} Line;

static const double kMean = 0.5, kRoot = 0.25, kDensity = 0.125;

static int32_t line_eval(const void* self, const AlidadeObservation* seen,
                         const double* const* roles, double* z, double* const* jacobians,
                         const int32_t* strides) {
  const Line* line = self;
  const double d = roles[0][0] - seen->known[0];
  (void)strides;
  if (!(line->side * d > 0.0)) return ALIDADE_OUT_OF_DOMAIN;
  const double r = sqrt(d * d + line->height_m * line->height_m);
  z[0] = line->gain * r + roles[1][0];
  if (jacobians != NULL && jacobians[0] != NULL) jacobians[0][0] = line->gain * d / r;
  if (jacobians != NULL && jacobians[1] != NULL) jacobians[1][0] = 1.0;
  return ALIDADE_OK;
}

static int32_t line_noise(const void* self, const AlidadeObservation* seen,
                          const double* const* roles, double* l, int32_t stride) {
  const Line* line = self;
  (void)roles;
  (void)stride;
  l[0] = line->relative ? line->sigma_m * seen->z[0] : line->sigma_m;
  return ALIDADE_OK;
}

static int32_t line_valid(const void* self, const AlidadeObservation* seen) {
  const Line* line = self;
  return seen->z[0] <= line->max_m ? ALIDADE_OK : ALIDADE_INVALID;
}

static int32_t line_initialise(const void* self, const AlidadeObservation* seen,
                               const double* const* roles, const double* prior, double* y,
                               double* const* jx, const int32_t* jx_strides, double* jz,
                               int32_t jz_stride, double* jp, int32_t jp_stride) {
  const Line* line = self;
  const double r = (seen->z[0] - roles[1][0]) / line->gain;
  (void)prior, (void)jx_strides, (void)jz_stride, (void)jp, (void)jp_stride;
  if (!(r > line->height_m)) return ALIDADE_OUT_OF_DOMAIN;
  const double along = sqrt(r * r - line->height_m * line->height_m);
  const double slope = line->side * r / (along * line->gain);
  y[0] = seen->known[0] + line->side * along;
  if (jx != NULL && jx[1] != NULL) jx[1][0] = -slope;
  if (jz != NULL) jz[0] = slope;
  return ALIDADE_OK;
}

static const AlidadeSensor kLine = {.struct_size = sizeof(AlidadeSensor),
                                    .eval = line_eval,
                                    .sqrt_noise = line_noise,
                                    .valid = line_valid,
                                    .initialise = line_initialise};

static double side_of(const AlidadeHost* host) {
  AlidadeParam asked = param(ALIDADE_PARAM_TEXT, "side", "", NULL);
  char text[ALIDADE_MAX_TEXT + 1] = "";
  asked.flags = ALIDADE_PARAM_HAS_DEFAULT;
  asked.fallback_text = "right";
  if (host->read_text(host->context, &asked, text, (int32_t)sizeof(text)) < 0) return 1.0;
  if (strcmp(text, "left") == 0) return -1.0;
  if (strcmp(text, "right") != 0) host->fail(host->context, "side", "is neither right nor left");
  return 1.0;
}

static int32_t make_line(const AlidadeHost* host, AlidadeInstance* instance) {
  static const char* const choices[] = {"constant", "relative"};
  static const double kTwo = 2.0, kNone = INFINITY, kFirst = 0.0;
  AlidadeParam longest = param(ALIDADE_PARAM_NUMBER, "max_m", "m", &kNone);
  AlidadeParam noise = param(ALIDADE_PARAM_CHOICE, "noise_model", "", &kFirst);
  Line* line = calloc(1, sizeof(Line));
  if (line == NULL) return ALIDADE_ERROR;
  line->gain = positive(host, "gain", "");
  line->height_m = not_negative(host, "height_m", "m", &kTwo);
  line->sigma_m = positive(host, "sigma_m", "m");
  longest.low = 0.0;
  longest.flags |= ALIDADE_PARAM_LOW_OPEN | ALIDADE_PARAM_OR_NONE;
  line->max_m = read_one(host, &longest);
  noise.choices = choices;
  noise.choice_count = 2;
  line->relative = read_one(host, &noise) == 1.0;
  line->side = side_of(host);

  line->owned.struct_size = sizeof(AlidadeOwned);
  line->owned.dynamics = ALIDADE_RANDOM_WALK;
  line->owned.mean = &kMean;
  line->owned.sqrt_prior = &kRoot;
  line->owned.sqrt_density = &kDensity;
  line->roles[0] = space(ALIDADE_VECTOR, 1, 1, "position", "m", "");
  line->roles[1] = space(ALIDADE_VECTOR, 1, 1, "offset", "m", "");
  line->roles[1].flags = ALIDADE_ROLE_OWNED;
  line->roles[1].owned = &line->owned;
  line->length = space(ALIDADE_VECTOR, 1, 1, "length", "m", "");
  line->anchor = space(ALIDADE_VECTOR, 1, 1, "anchor", "m", "");
  line->description.struct_size = sizeof(AlidadeDescription);
  line->description.capabilities =
      ALIDADE_ANALYTIC_JACOBIAN | ALIDADE_CAN_INITIALISE | ALIDADE_HAS_VALIDITY;
  line->description.role_count = 2;
  line->description.role_stride = sizeof(AlidadeSpace);
  line->description.roles = line->roles;
  line->description.output = &line->length;
  line->description.known = &line->anchor;
  line->description.initialise_role = 0;
  instance->kind = ALIDADE_KIND_SENSOR;
  instance->self = line;
  instance->destroy = free;
  instance->description = &line->description;
  instance->sensor = &kLine;
  return ALIDADE_OK;
}

/* ---- golden_fix ------------------------------------------------------------------------------ */

typedef struct Fix {
  AlidadeDescription description;
  AlidadeSpace roles[2], fix, parts[2];
  double antenna_m[2], sigma_m[2], declination_rad, sigma_rad, scale;
  int coupled;
} Fix;

static double wrap(double angle) {
  const double pi = 3.14159265358979323846;
  return angle - 2.0 * pi * ceil((angle - pi) / (2.0 * pi));
}

static int32_t fix_eval(const void* self, const AlidadeObservation* seen,
                        const double* const* roles, double* z, double* const* jacobians,
                        const int32_t* strides) {
  const Fix* fix = self;
  const double* p = roles[0];
  const double c = cos(roles[1][0]), s = sin(roles[1][0]);
  const double x = c * fix->antenna_m[0] - s * fix->antenna_m[1];
  const double y = s * fix->antenna_m[0] + c * fix->antenna_m[1];
  (void)seen;
  z[0] = p[0] + x;
  z[1] = p[1] + y;
  z[2] = wrap(roles[1][0] - fix->declination_rad);
  if (jacobians != NULL && jacobians[0] != NULL) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 2; ++column) {
        jacobians[0][row * strides[0] + column] = row == column ? 1.0 : 0.0;
      }
    }
  }
  if (jacobians != NULL && jacobians[1] != NULL) {
    jacobians[1][0] = -y;
    jacobians[1][strides[1]] = x;
    jacobians[1][2 * strides[1]] = 1.0;
  }
  return ALIDADE_OK;
}

static int32_t fix_noise(const void* self, const AlidadeObservation* seen,
                         const double* const* roles, double* l, int32_t stride) {
  const Fix* fix = self;
  (void)seen, (void)roles;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) l[row * stride + column] = 0.0;
  }
  l[0] = fix->scale * fix->sigma_m[0];
  l[stride] = fix->coupled ? 0.5 * fix->scale * fix->sigma_m[1] : 0.0;
  l[stride + 1] = fix->scale * fix->sigma_m[1];
  l[2 * stride + 2] = fix->scale * fix->sigma_rad;
  return ALIDADE_OK;
}

static const AlidadeSensor kFix = {
    .struct_size = sizeof(AlidadeSensor), .eval = fix_eval, .sqrt_noise = fix_noise};

static int32_t make_fix(const AlidadeHost* host, AlidadeInstance* instance) {
  static const double kZeros[2] = {0.0, 0.0}, kOne = 1.0;
  AlidadeParam antenna = param(ALIDADE_PARAM_NUMBER, "antenna_m", "m", kZeros);
  AlidadeParam sigma = param(ALIDADE_PARAM_NUMBER, "sigma_m", "m", NULL);
  AlidadeParam declination = param(ALIDADE_PARAM_NUMBER, "declination_rad", "rad", kZeros);
  AlidadeParam averaged = param(ALIDADE_PARAM_INTEGER, "averaged", "", &kOne);
  AlidadeParam coupled = param(ALIDADE_PARAM_FLAG, "coupled", "", kZeros);
  double sigmas[3] = {1.0, 1.0, 1.0};
  Fix* fix = calloc(1, sizeof(Fix));
  if (fix == NULL) return ALIDADE_ERROR;
  antenna.count = 2;
  host->read(host->context, &antenna, fix->antenna_m, 2);
  sigma.count = -1;
  sigma.low = 0.0;
  sigma.flags |= ALIDADE_PARAM_LOW_OPEN;
  const int32_t count = host->read(host->context, &sigma, sigmas, 3);
  if (count > 2) host->fail(host->context, "sigma_m", "needs one number, or one for each axis");
  fix->sigma_m[0] = sigmas[0];
  fix->sigma_m[1] = count == 2 ? sigmas[1] : sigmas[0];
  declination.low = -3.0;
  declination.high = 3.0;
  fix->declination_rad = read_one(host, &declination);
  fix->sigma_rad = positive(host, "sigma_rad", "rad");
  averaged.low = 1.0;
  averaged.high = 100.0;
  fix->scale = 1.0 / sqrt(read_one(host, &averaged));
  coupled.low = 0.0;
  coupled.high = 1.0;
  fix->coupled = read_one(host, &coupled) == 1.0;

  fix->roles[0] = space(ALIDADE_VECTOR, 2, 2, "position", "m", "x,y");
  fix->roles[1] = space(ALIDADE_ANGLE, 1, 1, "heading", "rad", "");
  fix->parts[0] = space(ALIDADE_VECTOR, 2, 2, "antenna", "m", "x,y");
  fix->parts[1] = space(ALIDADE_ANGLE, 1, 1, "compass", "rad", "");
  fix->fix = space(ALIDADE_PRODUCT, 3, 3, "fix", "", "");
  fix->fix.parts = fix->parts;
  fix->fix.part_count = 2;
  fix->fix.part_stride = sizeof(AlidadeSpace);
  fix->description.struct_size = sizeof(AlidadeDescription);
  fix->description.capabilities = ALIDADE_ANALYTIC_JACOBIAN;
  fix->description.role_count = 2;
  fix->description.role_stride = sizeof(AlidadeSpace);
  fix->description.roles = fix->roles;
  fix->description.output = &fix->fix;
  fix->description.initialise_role = -1;
  instance->kind = ALIDADE_KIND_SENSOR;
  instance->self = fix;
  instance->destroy = free;
  instance->description = &fix->description;
  instance->sensor = &kFix;
  return ALIDADE_OK;
}

/* ---- golden_direction ------------------------------------------------------------------------ */

typedef struct Direction {
  AlidadeDescription description;
  AlidadeSpace orientation, direction;
  double field[3], sigma_rad;
} Direction;

/* Computes B(x), row-major 3 x 2, as defined in plugin_abi.h. */
static void basis(const double* x, double* b) {
  const double s = x[2] < 0.0 ? -1.0 : 1.0, a = -1.0 / (s + x[2]);
  b[0] = 1.0 + s * x[0] * x[0] * a;
  b[1] = x[0] * x[1] * a;
  b[2] = s * x[0] * x[1] * a;
  b[3] = s + x[1] * x[1] * a;
  b[4] = -s * x[0];
  b[5] = -x[1];
}

static int32_t direction_eval(const void* self, const AlidadeObservation* seen,
                              const double* const* roles, double* z, double* const* jacobians,
                              const int32_t* strides) {
  const Direction* it = self;
  const double *q = roles[0], *m = it->field;
  const double w = q[0], x = -q[1], y = -q[2], u = -q[3]; /* of the inverse rotation */
  (void)seen;
  const double t[3] = {2.0 * (y * m[2] - u * m[1]), 2.0 * (u * m[0] - x * m[2]),
                       2.0 * (x * m[1] - y * m[0])};
  z[0] = m[0] + w * t[0] + y * t[2] - u * t[1];
  z[1] = m[1] + w * t[1] + u * t[0] - x * t[2];
  z[2] = m[2] + w * t[2] + x * t[1] - y * t[0];
  if (jacobians == NULL || jacobians[0] == NULL) return ALIDADE_OK;
  /* q (+) d rotates z by -d: dz = z x d, in the tangent space at z. */
  const double cross[9] = {0.0, -z[2], z[1], z[2], 0.0, -z[0], -z[1], z[0], 0.0};
  double b[6];
  basis(z, b);
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 3; ++column) {
      double sum = 0.0;
      for (int i = 0; i < 3; ++i) sum += b[2 * i + row] * cross[3 * i + column];
      jacobians[0][row * strides[0] + column] = sum;
    }
  }
  return ALIDADE_OK;
}

static int32_t direction_noise(const void* self, const AlidadeObservation* seen,
                               const double* const* roles, double* l, int32_t stride) {
  const Direction* it = self;
  (void)seen, (void)roles;
  l[0] = l[stride + 1] = it->sigma_rad;
  l[1] = l[stride] = 0.0;
  return ALIDADE_OK;
}

static const AlidadeSensor kDirection = {
    .struct_size = sizeof(AlidadeSensor), .eval = direction_eval, .sqrt_noise = direction_noise};

static int32_t make_direction(const AlidadeHost* host, AlidadeInstance* instance) {
  AlidadeParam field = param(ALIDADE_PARAM_NUMBER, "field", "", NULL);
  Direction* it = calloc(1, sizeof(Direction));
  if (it == NULL) return ALIDADE_ERROR;
  field.count = 3;
  const int32_t count = host->read(host->context, &field, it->field, 3);
  const double length =
      sqrt(it->field[0] * it->field[0] + it->field[1] * it->field[1] + it->field[2] * it->field[2]);
  if (count == 3 && !(length > 0.0)) host->fail(host->context, "field", "has no direction");
  for (int i = 0; i < 3; ++i) it->field[i] = length > 0.0 ? it->field[i] / length : (i == 2);
  it->sigma_rad = positive(host, "sigma_rad", "rad");
  it->orientation = space(ALIDADE_UNIT_QUATERNION, 4, 3, "orientation", "", "");
  it->direction = space(ALIDADE_UNIT_VECTOR, 3, 2, "direction", "", "x,y,z");
  it->description.struct_size = sizeof(AlidadeDescription);
  it->description.capabilities = ALIDADE_ANALYTIC_JACOBIAN;
  it->description.role_count = 1;
  it->description.role_stride = sizeof(AlidadeSpace);
  it->description.roles = &it->orientation;
  it->description.output = &it->direction;
  it->description.initialise_role = -1;
  instance->kind = ALIDADE_KIND_SENSOR;
  instance->self = it;
  instance->destroy = free;
  instance->description = &it->description;
  instance->sensor = &kDirection;
  return ALIDADE_OK;
}

/* ---- golden_cart ----------------------------------------------------------------------------- */

typedef struct Cart {
  AlidadeDescription description;
  AlidadeSpace blocks[2], odometry;
  double speed, turn_rate;
} Cart;

/* Computes sin(a) / a and its derivative. */
static void sinc(double a, double* value, double* slope) {
  if (a * a > 1e-4) {
    *value = sin(a) / a;
    *slope = (cos(a) - *value) / a;
  } else {
    *value = 1.0 - a * a / 6.0 + a * a * a * a / 120.0;
    *slope = -a / 3.0 + a * a * a / 30.0;
  }
}

/* Writes the derivative of x' with respect to (v, o), 3 x 2. */
static void write_by_rates(const double* by, double* m, int32_t stride) {
  if (m == NULL) return;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 2; ++column) m[row * stride + column] = by[2 * row + column];
  }
}

static int32_t cart_step(const void* self, const double* const* blocks, const double* const* inputs,
                         const double* w, double dt, double* const* next, double* f,
                         int32_t f_stride, double* g, int32_t g_stride, double* b,
                         int32_t b_stride) {
  const double v = inputs[0][0] + (w != NULL ? w[0] : 0.0);
  const double o = inputs[0][1] + (w != NULL ? w[1] : 0.0);
  const double h = blocks[1][0], a = 0.5 * o * dt, c = cos(h + a), s = sin(h + a);
  double along, slope;
  (void)self;
  sinc(a, &along, &slope);
  const double x = v * dt * along * c, y = v * dt * along * s;
  next[0][0] = blocks[0][0] + x;
  next[0][1] = blocks[0][1] + y;
  next[1][0] = wrap(h + o * dt);
  const double k = 0.5 * v * dt * dt;
  const double by_rates[6] = {dt * along * c,
                              k * (slope * c - along * s),
                              dt * along * s,
                              k * (slope * s + along * c),
                              0.0,
                              dt};
  const double by_state[9] = {1.0, 0.0, -y, 0.0, 1.0, x, 0.0, 0.0, 1.0};
  for (int i = 0; f != NULL && i < 9; ++i) f[i / 3 * f_stride + i % 3] = by_state[i];
  write_by_rates(by_rates, g, g_stride);
  write_by_rates(by_rates, b, b_stride);
  return ALIDADE_OK;
}

static int32_t cart_noise(const void* self, const double* const* blocks,
                          const double* const* inputs, double dt, double* l, int32_t stride) {
  const Cart* cart = self;
  (void)blocks, (void)inputs, (void)dt;
  l[0] = cart->speed;
  l[stride + 1] = cart->turn_rate;
  l[1] = l[stride] = 0.0;
  return ALIDADE_OK;
}

static const AlidadeMotion kCart = {
    .struct_size = sizeof(AlidadeMotion), .step = cart_step, .sqrt_q = cart_noise};

static int32_t make_cart(const AlidadeHost* host, AlidadeInstance* instance) {
  Cart* cart = calloc(1, sizeof(Cart));
  if (cart == NULL) return ALIDADE_ERROR;
  cart->speed = not_negative(host, "noise.speed", "m/s", NULL);
  cart->turn_rate = not_negative(host, "noise.turn_rate", "rad/s", NULL);
  cart->blocks[0] = space(ALIDADE_VECTOR, 2, 2, "position", "m", "x,y");
  cart->blocks[1] = space(ALIDADE_ANGLE, 1, 1, "heading", "rad", "");
  cart->odometry = space(ALIDADE_VECTOR, 2, 2, "odometry", "", "speed,turn_rate");
  cart->description.struct_size = sizeof(AlidadeDescription);
  cart->description.capabilities = ALIDADE_ANALYTIC_JACOBIAN | ALIDADE_DISCRETE_NOISE;
  cart->description.role_count = 2;
  cart->description.role_stride = sizeof(AlidadeSpace);
  cart->description.roles = cart->blocks;
  cart->description.inputs = &cart->odometry;
  cart->description.input_count = 1;
  cart->description.input_stride = sizeof(AlidadeSpace);
  cart->description.noise_count = 2;
  cart->description.initialise_role = -1;
  instance->kind = ALIDADE_KIND_MOTION;
  instance->self = cart;
  instance->destroy = free;
  instance->description = &cart->description;
  instance->motion = &kCart;
  return ALIDADE_OK;
}

/* ---- table ----------------------------------------------------------------------------------- */

#define ENTRY(of, called, make)                                                     \
  {                                                                                 \
    .struct_size = sizeof(AlidadeEntry), .kind = of, .name = called, .doc = "in C", \
    .thread_flags = ALIDADE_THREAD_INSTANCES | ALIDADE_THREAD_CALLS, .create = make \
  }

EXPORTED const AlidadeTable* alidade_plugin(void) {
  static const AlidadeEntry entries[] = {
      ENTRY(ALIDADE_KIND_SENSOR, "golden_line", make_line),
      ENTRY(ALIDADE_KIND_SENSOR, "golden_fix", make_fix),
      ENTRY(ALIDADE_KIND_SENSOR, "golden_direction", make_direction),
      ENTRY(ALIDADE_KIND_MOTION, "golden_cart", make_cart)};
  static const AlidadeTable table = {.struct_size = sizeof(AlidadeTable),
                                     .magic = ALIDADE_MAGIC,
                                     .abi_major = ALIDADE_ABI_MAJOR,
                                     .abi_minor = ALIDADE_ABI_MINOR,
                                     .entry_stride = sizeof(AlidadeEntry),
                                     .entry_count = 4,
                                     .entries = entries,
                                     .build_tag = &alidade_build_tag};
  return &table;
}
