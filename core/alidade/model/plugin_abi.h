/* SPDX-License-Identifier: Apache-2.0 */
#pragma once

/* The plugin ABI between alidade and a C-ABI plugin: plain C data, nothing else. Authors do not
 * write against this header: model.h does it for them. It compiles as C99 and as C++17. What
 * follows is normative; docs/plugin_abi.md has the same with its reasons.
 *
 * A plugin exports one function, `alidade_plugin`, that returns its table, and one build tag in the
 * ELF section `.alidade`, which the host reads before it opens the file; and its names in the
 * section `.alidade_names`, if it likes, by which the host may leave it closed.
 *
 * Structs. Every struct begins with its own size. Who reads one that the other side made reads no
 * further than that size, and takes what lies beyond as zero. Tables are walked by the stride that
 * they state. Within a major version, structs that plugins make may grow at their end and take
 * reserved members; structs that hosts make (AlidadeHost, AlidadeInstance, AlidadeObservation,
 * AlidadePayload) take reserved members only. Reserved members are zero, and who finds one that is
 * not refuses. Of every word of flags the same holds for its upper half: who does not know a bit of
 * ALIDADE_MUST_UNDERSTAND refuses what carries it; an unknown bit of the lower half is ignored. An
 * entry of unknown kind is left out, not its plugin.
 *
 * Texts are UTF-8 without control characters, of at most ALIDADE_MAX_TEXT bytes; names are 1 to
 * ALIDADE_MAX_NAME printable ASCII characters without blanks. Those of the table live as long as
 * the library, those of a description as long as the instance, error_text until the next call in
 * that thread. A null text is "".
 *
 * Numbers. Matrices are row-major with an explicit row stride, in doubles. Jacobians are in the
 * tangent of each block. Angles are in rad, lengths in m, times in s, unless a unit says else.
 * Quaternions and directions are of unit length to 1e-9, of either sign.
 *
 * Calls. Buffers are the caller's: outputs never overlap inputs or one another, pointers are
 * aligned to 8 bytes, payloads to 64. On entry outputs hold anything. A call that returns
 * ALIDADE_OK has written every element of its outputs, zeros included: both triangles of L, all of
 * F, G, B and each Jacobian; `alidade check` finds what it leaves out. A call that returns another
 * code has written none. Codes 4 to 15 are reserved; a host takes a code that it does not know as
 * ALIDADE_ERROR. Inputs are not written. No call throws. Calls are made with rounding to nearest,
 * without traps, subnormal numbers kept, and leave that as it is. All calls on an instance end
 * before `destroy`. `dt_s` is 0 or more, but may be negative in `step` without noise: a host looks
 * back by it. */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ALIDADE_ABI_MAJOR 1
#define ALIDADE_ABI_MINOR 0
#define ALIDADE_MAGIC 0x4144494cu /* "LIDA" */
#define ALIDADE_ENTRY_SYMBOL "alidade_plugin"
#define ALIDADE_BUILD_TAG_SECTION ".alidade"
/* The section, if there is one, that holds the names of all entries, each with the zero that ends
 * it, and nothing else. A host need not open a plugin for names that are not among them. */
#define ALIDADE_NAMES_SECTION ".alidade_names"

/* Upper half of every word of flags. */
#define ALIDADE_MUST_UNDERSTAND 0xffff0000u
/* Whether a struct that the other side made is large enough to have `member`. */
#define ALIDADE_HAS(p, type, member) \
  ((p)->struct_size >= offsetof(type, member) + sizeof((p)->member))

/* Limits that both sides rely on. */
enum {
  ALIDADE_MAX_ENTRIES = 1024,
  ALIDADE_MAX_ROLES = 64, /* and blocks of a motion model */
  ALIDADE_MAX_NAME = 128,
  ALIDADE_MAX_TEXT = 4096,
  ALIDADE_MAX_PARAMS = 4096,
  ALIDADE_MAX_CHOICES = 256,
  ALIDADE_MAX_SIZE = 1 << 20 /* ambient, tangent, n_w, prior, known */
};

/* What an evaluation returns. */
enum {
  ALIDADE_OK = 0,
  ALIDADE_OUT_OF_DOMAIN = 1, /* the function is not defined there: behind the camera, Z <= 0 */
  ALIDADE_INVALID = 2,       /* the measurement itself is of no use: beyond the sensor's limits */
  ALIDADE_ERROR = 3          /* the plugin failed (an exception was caught); see error_text */
};

/* A slot that is null in this version. */
typedef void (*AlidadeReservedCall)(void);

enum { ALIDADE_PLUGIN_C_ABI = 1, ALIDADE_PLUGIN_CPP = 2 };

/* Bits of AlidadeBuildTag.flags, which some compilers of plugins set. A host ignores these. */
enum {
  ALIDADE_BUILT_UNOPTIMISED = 1,
  ALIDADE_BUILT_FAST_MATH = 1 << 16,
  ALIDADE_BUILT_DEBUG_STL = 1 << 17
};

/* Bits of AlidadeBuildTag.isa: what the code needs of the processor beyond the baseline, each
 * feature by itself. A host refuses a bit that it does not know. */
enum {
  ALIDADE_ISA_SSE3 = 1 << 0,
  ALIDADE_ISA_SSSE3 = 1 << 1,
  ALIDADE_ISA_SSE4_1 = 1 << 2,
  ALIDADE_ISA_SSE4_2 = 1 << 3,
  ALIDADE_ISA_POPCNT = 1 << 4,
  ALIDADE_ISA_AVX = 1 << 5,
  ALIDADE_ISA_F16C = 1 << 6,
  ALIDADE_ISA_FMA = 1 << 7,
  ALIDADE_ISA_AVX2 = 1 << 8,
  ALIDADE_ISA_BMI = 1 << 9,
  ALIDADE_ISA_BMI2 = 1 << 10,
  ALIDADE_ISA_LZCNT = 1 << 11,
  ALIDADE_ISA_MOVBE = 1 << 12,
  ALIDADE_ISA_AVX512F = 1 << 13,
  ALIDADE_ISA_AVX512BW = 1 << 14,
  ALIDADE_ISA_AVX512CD = 1 << 15,
  ALIDADE_ISA_AVX512DQ = 1 << 16,
  ALIDADE_ISA_AVX512VL = 1 << 17,
  ALIDADE_ISA_AVX512IFMA = 1 << 18,
  ALIDADE_ISA_AVX512VBMI = 1 << 19,
  ALIDADE_ISA_AVX512VBMI2 = 1 << 20,
  ALIDADE_ISA_AVX512VNNI = 1 << 21,
  ALIDADE_ISA_AVX512BITALG = 1 << 22,
  ALIDADE_ISA_AVX512VPOPCNTDQ = 1 << 23,
  ALIDADE_ISA_AVX512BF16 = 1 << 24,
  ALIDADE_ISA_AVX512FP16 = 1 << 25,
  ALIDADE_ISA_AVXVNNI = 1 << 26,
  ALIDADE_ISA_GFNI = 1 << 27,
  ALIDADE_ISA_OTHER = 1 << 30 /* another that compilers use by themselves: no host runs it */
};

/* Lies alone in the section `.alidade`. */
typedef struct AlidadeBuildTag {
  char magic[8]; /* "ALIDADE" and a zero */
  uint32_t struct_size;
  uint16_t abi_major, abi_minor; /* of the header that the plugin was compiled with */
  uint16_t needs_minor;          /* the least minor of a host that computes the right numbers */
  uint16_t reserved0;
  uint32_t kind, flags, isa;
  uint32_t cplusplus; /* __cplusplus */
  char compiler[64];  /* __VERSION__ */
  char build[160];    /* C++ plugin: all that must equal the host's, else empty */
  uint32_t reserved[7];
} AlidadeBuildTag;

/* ---- geometries ------------------------------------------------------------------------------ */

/* x (+) d moves x by d in its tangent, y (-) x is the d with x (+) d = y, the shortest one.
 *
 * ALIDADE_VECTOR           ambient n, tangent n      x (+) d = x + d
 * ALIDADE_ANGLE            ambient 1, tangent 1      the same, wrapped to (-pi, pi]
 * ALIDADE_UNIT_QUATERNION  ambient 4, tangent 3      w x y z, Hamilton; x (+) d = x Exp(d),
 *                                                    Exp(d) = (cos |d|/2, sin(|d|/2) d / |d|)
 * ALIDADE_UNIT_VECTOR      ambient 3, tangent 2      x (+) d = cos |d| x + sin |d| / |d| B(x) d
 * ALIDADE_PRODUCT          sums of the parts         the parts one after the other, each as it is
 *                                                    by itself; of a measurement alone
 *
 * B(x) of a unit vector, with s = -1 where x2 < 0, else 1 (also at x2 = -0), a = -1 / (s + x2):
 *
 *            [ 1 + s x0^2 a    x0 x1 a     ]
 *   B(x)  =  [ s x0 x1 a       s + x1^2 a  ]
 *            [ -s x0           -x1         ]
 *
 * and to the antipode of x, where every way is as short, y (-) x = (pi, 0). docs/plugin_abi.md has
 * numbers of each. */
enum {
  ALIDADE_VECTOR = 1,
  ALIDADE_ANGLE = 2,
  ALIDADE_UNIT_QUATERNION = 3,
  ALIDADE_UNIT_VECTOR = 4,
  ALIDADE_PRODUCT = 5
};

/* Bits of AlidadeSpace.flags. */
enum {
  ALIDADE_ROLE_OPTIONAL = 1 << 16, /* may stay unbound: its pointer is then null */
  ALIDADE_ROLE_OWNED = 1 << 17,    /* the block arrives with its model: a bias, an extrinsic */
  ALIDADE_ROLE_LANDMARK = 1 << 18, /* filled anew for each measurement, by its landmark id */
  ALIDADE_ROLE_SHARED = 1 << 19,   /* with LANDMARK: one block for all that are first seen at one
                                      timestamp */
  ALIDADE_ROLE_CLONE = 1 << 20     /* the value at the earlier timestamp of the observation */
};

enum { ALIDADE_STAYS = 0, ALIDADE_RANDOM_WALK = 1, ALIDADE_GAUSS_MARKOV = 2 };

/* Prior and dynamics of a role with ALIDADE_ROLE_OWNED; a config may override each. */
typedef struct AlidadeOwned {
  uint32_t struct_size, dynamics;
  const double* mean;         /* ambient; null: the neutral element */
  const double* sqrt_prior;   /* L with P = L L', tangent x tangent; null: known exactly */
  const double* sqrt_density; /* L of the driving white noise, per sqrt(s); null: none */
  double time_constant_s;     /* of ALIDADE_GAUSS_MARKOV */
  void* reserved[4];
} AlidadeOwned;

/* A role, a measurement or a control input: a named quantity with its geometry. */
typedef struct AlidadeSpace {
  uint32_t struct_size, geometry;
  int32_t ambient, tangent;
  uint32_t flags, reserved0;
  const char* name;
  const char* unit;     /* of every element; "" where it has none */
  const char* elements; /* names of the ambient elements, comma separated; "" for a single one */
  const char* doc;
  const AlidadeOwned* owned;        /* null: at the neutral element, constant, known exactly */
  const struct AlidadeSpace* parts; /* of a product, 1 to ALIDADE_MAX_ROLES; none is a product */
  uint32_t part_count, part_stride;
  void* reserved[1];
} AlidadeSpace;

/* ---- parameters ------------------------------------------------------------------------------ */

enum {
  ALIDADE_PARAM_NUMBER = 1,
  ALIDADE_PARAM_INTEGER = 2,
  ALIDADE_PARAM_FLAG = 3,
  ALIDADE_PARAM_CHOICE = 4, /* read as the index into `choices`; one at a time */
  ALIDADE_PARAM_TEXT = 5,   /* read by read_text; one at a time */
  ALIDADE_PARAM_FILE = 6    /* the same: the absolute path of a file that can be read */
};

/* Bits of AlidadeParam.flags. */
enum {
  ALIDADE_PARAM_HAS_DEFAULT = 1 << 16,
  ALIDADE_PARAM_LOW_OPEN = 1 << 17, /* the bound itself is excluded */
  ALIDADE_PARAM_HIGH_OPEN = 1 << 18,
  ALIDADE_PARAM_OR_NONE = 1 << 19 /* a number, or the word `none`: read as infinity */
};

/* A parameter is declared by being read. */
typedef struct AlidadeParam {
  uint32_t struct_size, kind;
  const char* key; /* a name; may be dotted: `noise.acceleration` */
  const char* unit;
  const char* doc;
  int32_t count; /* values asked for; -1: a list of any length */
  uint32_t flags;
  double low, high;
  const double*
      fallback; /* `count` defaults, where ALIDADE_PARAM_HAS_DEFAULT; a choice's: an index */
  const char* const* choices;
  int32_t choice_count, reserved0;
  const char* fallback_text; /* of a text or file */
  void* reserved[4];
} AlidadeParam;

/* The host's side of a creation, for the thread that creates the model. It is not to be used once
 * `create` has returned. */
typedef struct AlidadeHost {
  uint32_t struct_size;
  uint16_t abi_major, abi_minor;
  void* context;
  /* Writes at most `capacity` values, returns how many there are, or -1 where the host has noted
   * an error. After -1 the model goes on with any valid value: the host refuses it afterwards. */
  int32_t (*read)(void* context, const AlidadeParam* param, double* values, int32_t capacity);
  /* The same of a text or file: writes at most `capacity` bytes, the last of them 0, and returns
   * the length without it. */
  int32_t (*read_text)(void* context, const AlidadeParam* param, char* text, int32_t capacity);
  /* Notes that parameters do not fit together; `key` may be "". */
  void (*fail)(void* context, const char* key, const char* text);
  AlidadeReservedCall reserved[8];
} AlidadeHost;

/* ---- models ---------------------------------------------------------------------------------- */

/* 3 is reserved. */
enum { ALIDADE_KIND_SENSOR = 1, ALIDADE_KIND_MOTION = 2 };

/* Bits of AlidadeDescription.capabilities: hints below, what a host has to honour above. */
enum {
  ALIDADE_ANALYTIC_JACOBIAN = 1, /* analytic Jacobians, else by automatic differentiation */
  ALIDADE_STATIONARY = 2,        /* motion: x' = x without noise; step need not be called */
  /* motion: four bits from this one on hold N, if `step` without noise is additive in dt but for an
   * error of order dt^N; 0: it is additive */
  ALIDADE_STEP_ORDER_SHIFT = 4,
  ALIDADE_CAN_INITIALISE = 1 << 16,
  ALIDADE_HAS_VALIDITY = 1 << 17,
  ALIDADE_RESIDUAL_ONLY = 1 << 18, /* recursive estimators refuse it */
  ALIDADE_NEEDS_PAYLOAD = 1 << 19, /* works on what comes beside z: an image patch, a scan */
  /* motion: w is held from one change of the state by a measurement to the next, however many steps
   * lead there (discrete white noise); else w of every step is independent of that of all others,
   * and adds up (continuous white noise) */
  ALIDADE_DISCRETE_NOISE = 1 << 20
};

typedef struct AlidadeDescription {
  uint32_t struct_size, capabilities, role_count;
  uint32_t role_stride; /* bytes from one role to the next */
  const AlidadeSpace* roles;
  const AlidadeSpace* output; /* sensor: its measurement; else null */
  const AlidadeSpace*
      residual;               /* where r lives and whose noise sqrt_noise gives; null: as output */
  const AlidadeSpace* known;  /* sensor: numbers that come with each measurement; null: none */
  const AlidadeSpace* inputs; /* motion: its control inputs */
  uint32_t input_count, input_stride;
  int32_t noise_count;          /* motion: n_w */
  int32_t initialise_role;      /* the role that `initialise` computes, where it can */
  const uint8_t* step_sparsity; /* motion: n x n, 1 where F may be non-zero; null: dense */
  int32_t prior_count;          /* numbers that `initialise` needs besides the measurement */
  int32_t reserved0;
  void* reserved[6];
} AlidadeDescription;

enum {
  ALIDADE_PAYLOAD_BYTES = 1,
  ALIDADE_PAYLOAD_IMAGE_U8 = 2,
  ALIDADE_PAYLOAD_IMAGE_F32 = 3,
  ALIDADE_PAYLOAD_POINTS_F32 = 4
};

/* What comes with a measurement and is no number of it. */
typedef struct AlidadePayload {
  uint32_t struct_size, kind;
  const void* data;
  uint64_t bytes;
  int64_t row_bytes;               /* of an image: from one row to the next */
  int32_t width, height, channels; /* of points: how many, 1, numbers of each */
  int32_t reserved0;
  void* reserved[4];
} AlidadePayload;

/* One measurement, lent to a sensor for the time of a call. */
typedef struct AlidadeObservation {
  uint32_t struct_size, flags;
  const double* z;     /* ambient; null where a prediction alone is asked for */
  const double* known; /* as description.known says, else null */
  double offset_s;     /* its timestamp less that of the roles: 0 but within a scan */
  double span_s;       /* its timestamp less that of the roles with ALIDADE_ROLE_CLONE */
  const AlidadePayload* payloads;
  uint32_t payload_count, payload_stride;
  void* reserved[4];
} AlidadeObservation;

/* z = h(roles). `roles[i]` is the ambient value of role i, null where an optional role is unbound.
 * `jacobians` may be null; `jacobians[i]` (tangent of z  x  tangent of role i) may be null. `seen`
 * is never null. */
typedef struct AlidadeSensor {
  uint32_t struct_size, reserved0;
  int32_t (*eval)(const void* self, const AlidadeObservation* seen, const double* const* roles,
                  double* z, double* const* jacobians, const int32_t* row_strides);
  /* L with R = L L', tangent of z squared. */
  int32_t (*sqrt_noise)(const void* self, const AlidadeObservation* seen,
                        const double* const* roles, double* l, int32_t row_stride);
  /* ALIDADE_OK or ALIDADE_INVALID; null: every measurement is valid. */
  int32_t (*valid)(const void* self, const AlidadeObservation* seen);
  /* Inverse measurement model: y, the value of role `initialise_role`, from the other roles, z and
   * a prior of the part that z does not determine (null if it determines all). Where that role is a
   * landmark's, y are the values of it and of the landmark roles that follow it, one after the
   * other. Jacobians jx[i] of y by the other roles, jz by z, jp by the prior; each may be null. */
  int32_t (*initialise)(const void* self, const AlidadeObservation* seen,
                        const double* const* roles, const double* prior, double* y,
                        double* const* jx, const int32_t* jx_strides, double* jz, int32_t jz_stride,
                        double* jp, int32_t jp_stride);
  /* Only with ALIDADE_RESIDUAL_ONLY: r(roles, z) and its Jacobians. */
  int32_t (*residual)(const void* self, const AlidadeObservation* seen, const double* const* roles,
                      double* r, double* const* jacobians, const int32_t* row_strides);
  AlidadeReservedCall reserved[6];
} AlidadeSensor;

/* x' = f(x, u, w, dt), w ~ N(0, Qw). All blocks of the model together have tangent size n, all of
 * its control inputs n_u. */
typedef struct AlidadeMotion {
  uint32_t struct_size, reserved0;
  /* `w` may be null (zero); `f` (n x n, d x'/d x), `g` (n x n_w, d x'/d w) and `b` (n x n_u,
   * d x'/d u) may be null. */
  int32_t (*step)(const void* self, const double* const* blocks, const double* const* inputs,
                  const double* w, double dt_s, double* const* next, double* f, int32_t f_stride,
                  double* g, int32_t g_stride, double* b, int32_t b_stride);
  /* L with Qw = L L', n_w x n_w. */
  int32_t (*sqrt_q)(const void* self, const double* const* blocks, const double* const* inputs,
                    double dt_s, double* l, int32_t row_stride);
  AlidadeReservedCall reserved[6];
} AlidadeMotion;

/* One created model. The host zeroes it and sets struct_size; `create` fills it. */
typedef struct AlidadeInstance {
  uint32_t struct_size, kind;
  void* self;
  void (*destroy)(void* self);
  const char* (*error_text)(const void* self); /* of the last ALIDADE_ERROR in this thread */
  const AlidadeDescription* description;       /* lives as long as self */
  const AlidadeSensor* sensor;                 /* the one that fits `kind`, the other null */
  const AlidadeMotion* motion;
  void* reserved[8];
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
  const char* version; /* of the model; may be "" */
  uint32_t thread_flags, flags;
  /* Reads the parameters and fills `instance`; ALIDADE_OK or ALIDADE_ERROR. */
  int32_t (*create)(const AlidadeHost* host, AlidadeInstance* instance);
  void* reserved[4];
} AlidadeEntry;

typedef struct AlidadeTable {
  uint32_t struct_size, magic;
  uint16_t abi_major, abi_minor;
  uint32_t entry_stride, entry_count, flags;
  const AlidadeEntry* entries;
  const AlidadeBuildTag* build_tag;
  void* reserved[4];
} AlidadeTable;

typedef const AlidadeTable* (*AlidadePluginFunction)(void);

#ifdef __cplusplus
}
#endif
