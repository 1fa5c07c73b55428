/* SPDX-License-Identifier: Apache-2.0 */
#pragma once

/* The plugin ABI between alidade and a C-ABI plugin: plain C data, nothing else.
 * A plugin exports one function, `alidade_plugin`, that returns its table, and one build tag in
 * the ELF section `.alidade`, which the host reads before it opens the file. Rules:
 *
 *   - every struct begins with its own size; the host reads only what the size covers and takes
 *     what lies beyond as zero. Reserved tails are zero;
 *   - tables are walked by the stride that they state;
 *   - matrices are row-major with an explicit row stride, in doubles; buffers are the caller's;
 *   - a call that returns ALIDADE_OK writes every element of its outputs, zeros included: both
 *     triangles of L, all of F, G and each Jacobian. What it leaves out counts as not a number;
 *   - a call that returns another code leaves its outputs untouched. None throws;
 *   - Jacobians are in the tangent of each block; angles rad, lengths m unless a unit says else.
 * Authors do not write against this header: model.h does it for them. It compiles as C. */

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ALIDADE_ABI_MAJOR 0
#define ALIDADE_ABI_MINOR 1
#define ALIDADE_MAGIC 0x4144494cu /* "LIDA" */
#define ALIDADE_ENTRY_SYMBOL "alidade_plugin"
#define ALIDADE_BUILD_TAG_SECTION ".alidade"

/* What an evaluation returns. */
enum {
  ALIDADE_OK = 0,
  ALIDADE_OUT_OF_DOMAIN = 1, /* the function is not defined there: behind the camera, Z <= 0 */
  ALIDADE_INVALID = 2,       /* the measurement itself is of no use: beyond the sensor's limits */
  ALIDADE_ERROR = 3          /* the plugin failed (an exception was caught); see error_text */
};

enum { ALIDADE_PLUGIN_C_ABI = 1, ALIDADE_PLUGIN_CPP = 2 };

/* Bits of AlidadeBuildTag.flags. */
enum { ALIDADE_BUILT_FAST_MATH = 1, ALIDADE_BUILT_DEBUG_STL = 2, ALIDADE_BUILT_UNOPTIMISED = 4 };

/* Bits of AlidadeBuildTag.isa: what the code needs of the processor. */
enum { ALIDADE_ISA_AVX = 1, ALIDADE_ISA_AVX2 = 2, ALIDADE_ISA_FMA = 4, ALIDADE_ISA_AVX512F = 8 };

/* Lies alone in the section `.alidade`. */
typedef struct AlidadeBuildTag {
  char magic[8]; /* "ALIDADE" and a zero */
  uint32_t struct_size;
  uint16_t abi_major, abi_minor;
  uint32_t kind, flags, isa;
  uint32_t cplusplus; /* __cplusplus */
  char compiler[64];  /* __VERSION__ */
  char build[160];    /* C++ plugin: all that must equal the host's, else empty */
  uint32_t reserved[8];
} AlidadeBuildTag;

enum {
  ALIDADE_VECTOR = 1,          /* ambient n, tangent n */
  ALIDADE_ANGLE = 2,           /* ambient 1, tangent 1, wraps to (-pi, pi] */
  ALIDADE_UNIT_QUATERNION = 3, /* w x y z, Hamilton; ambient 4, tangent 3; x (+) d = x Exp(d) */
  ALIDADE_UNIT_VECTOR = 4      /* ambient 3, tangent 2 */
};

/* Bits of AlidadeSpace.flags. */
enum {
  ALIDADE_ROLE_OPTIONAL = 1,  /* may stay unbound: its pointer is then null */
  ALIDADE_ROLE_PARAMETER = 2, /* the block arrives with its motion model: a bias, an extrinsic */
  ALIDADE_ROLE_LANDMARK = 4,  /* filled anew for each measurement, by its landmark id */
  ALIDADE_ROLE_SHARED =
      8 /* with LANDMARK: one block for all that are first seen at one timestamp */
};

/* A role, a measurement or a control input: a named quantity with its geometry. */
typedef struct AlidadeSpace {
  uint32_t struct_size, geometry;
  int32_t ambient, tangent;
  uint32_t flags, reserved0;
  const char* name;
  const char* unit;     /* of every element; "" where it has none */
  const char* elements; /* names of the ambient elements, comma separated; "" for a single one */
  const char* doc;
  void* reserved[4];
} AlidadeSpace;

/* ---- parameters ------------------------------------------------------------------------------ */

enum {
  ALIDADE_PARAM_NUMBER = 1,
  ALIDADE_PARAM_INTEGER = 2,
  ALIDADE_PARAM_FLAG = 3,
  ALIDADE_PARAM_CHOICE = 4 /* read as the index into `choices`; one at a time */
};
enum {
  ALIDADE_PARAM_HAS_DEFAULT = 1,
  ALIDADE_PARAM_LOW_OPEN = 2, /* the bound itself is excluded */
  ALIDADE_PARAM_HIGH_OPEN = 4,
  ALIDADE_PARAM_OR_NONE = 8 /* a number, or the word `none`: read as infinity */
};

/* A parameter is declared by being read. */
typedef struct AlidadeParam {
  uint32_t struct_size, kind;
  const char* key; /* may be dotted: `noise.acceleration` */
  const char* unit;
  const char* doc;
  int32_t count; /* values asked for; -1: a list of any length */
  uint32_t flags;
  double low, high;
  const double*
      fallback; /* `count` defaults, where ALIDADE_PARAM_HAS_DEFAULT; a choice's: an index */
  const char* const* choices;
  int32_t choice_count, reserved0;
  void* reserved[4];
} AlidadeParam;

/* What the host lends while a model is created. */
typedef struct AlidadeHost {
  uint32_t struct_size;
  uint16_t abi_major, abi_minor;
  void* context;
  /* Writes at most `capacity` values, returns how many there are, or -1 where the host has noted
   * an error. After -1 the model goes on with any valid value: the host refuses it afterwards. */
  int32_t (*read)(void* context, const AlidadeParam* param, double* values, int32_t capacity);
  /* Notes that parameters do not fit together; `key` may be "". */
  void (*fail)(void* context, const char* key, const char* text);
  void* reserved[4];
} AlidadeHost;

/* ---- models ---------------------------------------------------------------------------------- */

enum { ALIDADE_KIND_SENSOR = 1, ALIDADE_KIND_MOTION = 2, ALIDADE_KIND_LANDMARK_REPRESENTATION = 3 };

/* Bits of AlidadeDescription.capabilities. */
enum {
  ALIDADE_CAN_INITIALISE = 1,
  ALIDADE_HAS_VALIDITY = 2,
  ALIDADE_RESIDUAL_ONLY = 4,     /* recursive estimators refuse it */
  ALIDADE_ANALYTIC_JACOBIAN = 8, /* analytic Jacobians, else by automatic differentiation */
  ALIDADE_STATIONARY = 16,       /* motion: x' = x without noise; step need not be called */
  /* motion: w is held from one change of the state by a measurement to the next, however many steps
   * lead there (discrete white noise); else w of every step is independent of that of all others,
   * and adds up (continuous white noise) */
  ALIDADE_DISCRETE_NOISE = 32
};

typedef struct AlidadeDescription {
  uint32_t struct_size, capabilities, role_count;
  uint32_t role_stride; /* bytes from one role to the next */
  const AlidadeSpace* roles;
  const AlidadeSpace* output;   /* sensor: its measurement; else null */
  const AlidadeSpace* input;    /* motion: its control input, or null */
  int32_t noise_count;          /* motion: n_w */
  int32_t initialise_role;      /* the role that `initialise` computes, where it can */
  const uint8_t* step_sparsity; /* motion: n x n, 1 where F may be non-zero; null: dense */
  int32_t prior_count;          /* numbers that `initialise` needs besides the measurement */
  int32_t reserved0;
  void* reserved[3];
} AlidadeDescription;

/* z = h(roles). `roles[i]` is the ambient value of role i, null where an optional role is unbound.
 * `jacobians` may be null; `jacobians[i]` (tangent of z  x  tangent of role i) may be null. */
typedef struct AlidadeSensor {
  uint32_t struct_size, reserved0;
  int32_t (*eval)(const void* self, const double* const* roles, double* z, double* const* jacobians,
                  const int32_t* row_strides);
  /* L with R = L L', tangent of z squared. */
  int32_t (*sqrt_noise)(const void* self, const double* const* roles, const double* z, double* l,
                        int32_t row_stride);
  /* ALIDADE_OK or ALIDADE_INVALID; null: every measurement is valid. */
  int32_t (*valid)(const void* self, const double* z);
  /* Inverse measurement model: y, the value of role `initialise_role`, from the other roles, z and
   * a prior of the part that z does not determine (null if it determines all). Where that role is a
   * landmark's, y are the values of it and of the landmark roles that follow it, one after the
   * other. Jacobians jx[i] of y by the other roles, jz by z, jp by the prior; each may be null. */
  int32_t (*initialise)(const void* self, const double* const* roles, const double* z,
                        const double* prior, double* y, double* const* jx,
                        const int32_t* jx_strides, double* jz, int32_t jz_stride, double* jp,
                        int32_t jp_stride);
  /* Only with ALIDADE_RESIDUAL_ONLY: r(roles, z) and its Jacobians. */
  int32_t (*residual)(const void* self, const double* const* roles, const double* z, double* r,
                      double* const* jacobians, const int32_t* row_strides);
  void* reserved[4];
} AlidadeSensor;

/* x' = f(x, u, w, dt), w ~ N(0, Qw). All blocks of the model together have tangent size n. */
typedef struct AlidadeMotion {
  uint32_t struct_size, reserved0;
  /* `w` may be null (zero); `f` (n x n, d x'/d x) and `g` (n x n_w, d x'/d w) may be null. */
  int32_t (*step)(const void* self, const double* const* blocks, const double* input,
                  const double* w, double dt_s, double* const* next, double* f, int32_t f_stride,
                  double* g, int32_t g_stride);
  /* L with Qw = L L', n_w x n_w. */
  int32_t (*sqrt_q)(const void* self, const double* const* blocks, double dt_s, double* l,
                    int32_t row_stride);
  void* reserved[4];
} AlidadeMotion;

/* A landmark representation: how a point of the world is written in the state. */
typedef struct AlidadeLandmarkRepresentation {
  uint32_t struct_size, reserved0;
  /* Blocks of a landmark from camera position, orientation, bearing and prior. */
  int32_t (*initialise)(const void* self, const double* const* roles, const double* z,
                        const double* prior, double* const* blocks, double* const* jx,
                        const int32_t* jx_strides, double* jz, int32_t jz_stride, double* jp,
                        int32_t jp_stride);
  /* The point in another representation, with its Jacobian. */
  int32_t (*convert)(const void* self, const double* const* blocks, const char* to,
                     double* const* target, double* j, int32_t j_stride);
  /* Index of linearity of the depth [Civera2008]; small is linear. */
  int32_t (*linearity)(const void* self, const double* const* blocks, const double* camera,
                       double sigma, double* index);
  void* reserved[4];
} AlidadeLandmarkRepresentation;

/* One created model. The host zeroes it and sets struct_size; `create` fills it. */
typedef struct AlidadeInstance {
  uint32_t struct_size, kind;
  void* self;
  void (*destroy)(void* self);
  const char* (*error_text)(const void* self); /* of the last ALIDADE_ERROR in this thread */
  const AlidadeDescription* description;       /* lives as long as self */
  const AlidadeSensor* sensor;                 /* the one that fits `kind`, others null */
  const AlidadeMotion* motion;
  const AlidadeLandmarkRepresentation* representation;
  void* reserved[4];
} AlidadeInstance;

/* Bits of AlidadeEntry.thread_flags. */
enum {
  ALIDADE_THREAD_INSTANCES = 1, /* several instances may work at once */
  ALIDADE_THREAD_CALLS = 2      /* one instance may be called from several threads at once */
};

typedef struct AlidadeEntry {
  uint32_t struct_size, kind;
  const char* family; /* sensors that understand each other's landmarks; may be "" */
  const char* name;
  const char* doc;
  const char* citation;
  uint32_t thread_flags, reserved0;
  /* Reads the parameters and fills `instance`; ALIDADE_OK or ALIDADE_ERROR. */
  int32_t (*create)(const AlidadeHost* host, AlidadeInstance* instance);
  void* reserved[4];
} AlidadeEntry;

typedef struct AlidadeTable {
  uint32_t struct_size, magic;
  uint16_t abi_major, abi_minor;
  uint32_t entry_stride, entry_count, reserved0;
  const AlidadeEntry* entries;
  const AlidadeBuildTag* build_tag;
  void* reserved[4];
} AlidadeTable;

typedef const AlidadeTable* (*AlidadePluginFunction)(void);

#ifdef __cplusplus
}
#endif
