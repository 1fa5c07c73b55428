/* SPDX-License-Identifier: Apache-2.0 */
#pragma once

/* Plugin ABI: the interface between alidade and a C-ABI plugin, which consists of plain C data.
 * Authors of models use model.h, which implements this interface for them. This header compiles as
 * C99 and as C++17. The text below is normative; docs/plugin_abi.md explains the reasons.
 *
 * A plugin exports one function, `alidade_plugin`, which returns the table of the plugin. A plugin
 * also contains one build tag in the ELF section `.alidade`, which the host reads before it loads
 * the file. A plugin may list the names of its entries in the section `.alidade_names`. The host
 * can then find the names without loading the file.
 *
 * Structs. Every struct begins with its own size. The reader of a struct is the side that did not
 * create it. A reader reads only the stated number of bytes, and treats all members beyond them as
 * zero. The stride of an array of structs is stated next to the array. Within a major version,
 * structs that plugins create may grow at their end and may use reserved members. Structs that
 * hosts create (AlidadeHost, AlidadeInstance, AlidadeObservation, AlidadePayload) may only use
 * reserved members. Reserved members are zero; a reader rejects a struct with a reserved member
 * that is not zero. ALIDADE_MUST_UNDERSTAND is the upper half of every word of flags. A reader
 * rejects a struct if an unknown bit of the upper half is set, and ignores unknown bits of the
 * lower half. A host ignores an entry of unknown kind, but uses the other entries of the plugin.
 *
 * Texts are UTF-8 without control characters and have at most ALIDADE_MAX_TEXT bytes. Names consist
 * of 1 to ALIDADE_MAX_NAME printable ASCII characters without blanks. Texts of the table are valid
 * while the library is loaded. Texts of a description are valid while the instance exists. The
 * result of error_text is valid until the next call in the same thread. A null text means "".
 *
 * Numbers. Matrices are row-major arrays of doubles with an explicit row stride. Jacobians are in
 * the tangent space of each block. Angles are in rad, lengths in m, times in s, unless another unit
 * is stated. The length of a quaternion or direction differs from 1 by at most 1e-9. A quaternion
 * may have either sign.
 *
 * Calls. The caller owns all buffers. Outputs overlap neither inputs nor each other. Pointers are
 * aligned to 8 bytes, payloads to 64 bytes. Outputs are uninitialised before a call. A call that
 * returns ALIDADE_OK has written every element of its outputs, including zeros: both triangles of
 * L, all of F, G, B and each Jacobian. `alidade check` finds elements that were not written. A call
 * that returns another code has not written any output. Codes 4 to 15 are reserved; a host treats
 * an unknown code as ALIDADE_ERROR. Calls do not write to inputs and do not throw. During a call,
 * the processor rounds to nearest, does not trap, and does not flush subnormal numbers to zero. A
 * call must not change these settings. All calls on an instance end before `destroy` is called.
 * `dt_s` is at least 0. The exception is a `step` without noise: `dt_s` may be negative, so that a
 * host can predict backwards. */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ALIDADE_ABI_MAJOR 1
#define ALIDADE_ABI_MINOR 1
#define ALIDADE_MAGIC 0x4144494cu /* "LIDA" */
#define ALIDADE_ENTRY_SYMBOL "alidade_plugin"
#define ALIDADE_BUILD_TAG_SECTION ".alidade"
/* Optional section that contains only the names of all entries, each followed by a zero byte. If a
 * name is not listed, a host that searches for this name need not load the plugin. */
#define ALIDADE_NAMES_SECTION ".alidade_names"

/* Upper half of every word of flags. */
#define ALIDADE_MUST_UNDERSTAND 0xffff0000u
/* True if `*p`, a struct that the other side created, is large enough to contain `member`. */
#define ALIDADE_HAS(p, type, member) \
  ((p)->struct_size >= offsetof(type, member) + sizeof((p)->member))

/* Limits that both sides rely on. */
enum {
  ALIDADE_MAX_ENTRIES = 1024,
  ALIDADE_MAX_ROLES = 64, /* roles of a sensor, and blocks of a motion model */
  ALIDADE_MAX_NAME = 128,
  ALIDADE_MAX_TEXT = 4096,
  ALIDADE_MAX_PARAMS = 4096,
  ALIDADE_MAX_CHOICES = 256,
  ALIDADE_MAX_SIZE = 1 << 20 /* ambient and tangent size, n_w, number of prior and known numbers */
};

/* Result of an evaluation. */
enum {
  ALIDADE_OK = 0,
  ALIDADE_OUT_OF_DOMAIN = 1, /* the arguments are outside the domain, such as a depth Z <= 0 */
  ALIDADE_INVALID = 2,       /* the measurement is invalid, for example out of range */
  ALIDADE_ERROR = 3          /* the plugin failed; error_text returns the reason */
};

/* Reserved function pointer; null in this version. */
typedef void (*AlidadeReservedCall)(void);

enum { ALIDADE_PLUGIN_C_ABI = 1, ALIDADE_PLUGIN_CPP = 2 };

/* Bits of AlidadeBuildTag.flags that some plugins set. A host ignores these bits. */
enum {
  ALIDADE_BUILT_UNOPTIMISED = 1,
  ALIDADE_BUILT_FAST_MATH = 1 << 16,
  ALIDADE_BUILT_DEBUG_STL = 1 << 17
};

/* Bits of AlidadeBuildTag.isa: the features of the processor that the code needs beyond the
 * baseline. Every feature has its own bit. A host rejects an unknown bit. */
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
  ALIDADE_ISA_OTHER = 1 << 30 /* any other feature that a compiler may use; all hosts reject it */
};

/* The only content of the section `.alidade`. */
typedef struct AlidadeBuildTag {
  char magic[8]; /* "ALIDADE" and a zero byte */
  uint32_t struct_size;
  uint16_t abi_major, abi_minor; /* version of the header that the plugin includes */
  uint16_t needs_minor;          /* lowest minor version of a host that can use it */
  uint16_t reserved0;
  uint32_t kind, flags, isa;
  uint32_t cplusplus; /* __cplusplus */
  char compiler[64];  /* __VERSION__ */
  char build[160];    /* C++ plugin: must equal the text of the host; C ABI: "" */
  uint32_t reserved[7];
} AlidadeBuildTag;

/* ---- geometries ------------------------------------------------------------------------------ */

/* x (+) d moves x by the tangent vector d. y (-) x is the shortest d with x (+) d = y.
 *
 * ALIDADE_VECTOR           ambient n, tangent n      x (+) d = x + d
 * ALIDADE_ANGLE            ambient 1, tangent 1      x (+) d = x + d, wrapped to (-pi, pi]
 * ALIDADE_UNIT_QUATERNION  ambient 4, tangent 3      w x y z, Hamilton; x (+) d = x Exp(d),
 *                                                    Exp(d) = (cos |d|/2, sin(|d|/2) d / |d|)
 * ALIDADE_UNIT_VECTOR      ambient 3, tangent 2      x (+) d = cos |d| x + sin |d| / |d| B(x) d
 * ALIDADE_PRODUCT          sums of the parts         concatenation of the parts, each with its
 *                                                    own (+); only for measurements
 * ALIDADE_SE_2_LEFT        ambient 3, tangent 3      x, y, theta; x (+) d = x Exp(d)
 * ALIDADE_SE_2_RIGHT       ambient 3, tangent 3      the same elements; x (+) d = Exp(d) x
 * ALIDADE_SE_3_LEFT        ambient 7, tangent 6      position, then quaternion; x (+) d = x Exp(d)
 * ALIDADE_SE_3_RIGHT       ambient 7, tangent 6      the same elements; x (+) d = Exp(d) x
 * ALIDADE_SE_2_3_LEFT      ambient 10, tangent 9     position, quaternion, velocity;
 *                                                    x (+) d = x Exp(d)
 * ALIDADE_SE_2_3_RIGHT     ambient 10, tangent 9     the same elements; x (+) d = Exp(d) x
 *
 * B(x) of a unit vector, with s = -1 if x2 < 0, else s = 1 (also for x2 = -0), a = -1 / (s + x2):
 *
 *            [ 1 + s x0^2 a    x0 x1 a     ]
 *   B(x)  =  [ s x0 x1 a       s + x1^2 a  ]
 *            [ -s x0           -x1         ]
 *
 * The product of two poses is (p, R) (p', R') = (p + R p', R R'). A velocity transforms like a
 * position. With V = I + (1 - cos t)/t^2 W + (t - sin t)/t^3 W^2, W = [phi]x and t = |phi|,
 * Exp(rho, phi, nu) has the position V rho, the rotation Exp(phi) and the velocity V nu. In the
 * plane, W = [0 -theta; theta 0]. The numbers from ALIDADE_SE_2_LEFT on require a host with minor
 * version 1 or later.
 *
 * If y is the antipode of x, several shortest d exist, and y (-) x = (pi, 0).
 * docs/plugin_abi.md contains an example of each geometry. */
enum {
  ALIDADE_VECTOR = 1,
  ALIDADE_ANGLE = 2,
  ALIDADE_UNIT_QUATERNION = 3,
  ALIDADE_UNIT_VECTOR = 4,
  ALIDADE_PRODUCT = 5,
  ALIDADE_SE_2_LEFT = 6,
  ALIDADE_SE_2_RIGHT = 7,
  ALIDADE_SE_3_LEFT = 8,
  ALIDADE_SE_3_RIGHT = 9,
  ALIDADE_SE_2_3_LEFT = 10,
  ALIDADE_SE_2_3_RIGHT = 11
};

/* Bits of AlidadeSpace.flags. */
enum {
  ALIDADE_ROLE_OPTIONAL = 1 << 16, /* may have no block; the pointer is then null */
  ALIDADE_ROLE_OWNED = 1 << 17,    /* parameter of the model, such as a bias */
  ALIDADE_ROLE_LANDMARK = 1 << 18, /* bound to the landmark of the measurement */
  ALIDADE_ROLE_SHARED = 1 << 19,   /* with LANDMARK: all landmarks that are first observed
                                      at the same timestamp share one block */
  ALIDADE_ROLE_CLONE = 1 << 20     /* value of the block at the time of z minus span_s */
};

enum { ALIDADE_STAYS = 0, ALIDADE_RANDOM_WALK = 1, ALIDADE_GAUSS_MARKOV = 2 };

/* Prior and dynamics of a role with ALIDADE_ROLE_OWNED. A config may override each of them. */
typedef struct AlidadeOwned {
  uint32_t struct_size, dynamics;
  const double* mean;         /* ambient values; null: the neutral element */
  const double* sqrt_prior;   /* L with P = L L', tangent x tangent; null: known exactly */
  const double* sqrt_density; /* root L of the spectral density of the noise; null: zero */
  double time_constant_s;     /* time constant of ALIDADE_GAUSS_MARKOV */
  void* reserved[4];
} AlidadeOwned;

/* Quantity with a name and a geometry: a role, a measurement or a control input. */
typedef struct AlidadeSpace {
  uint32_t struct_size, geometry;
  int32_t ambient, tangent;
  uint32_t flags, reserved0;
  const char* name;
  const char* unit; /* unit of every element; "" if there is no unit */
  const char*
      elements; /* names of the ambient elements, comma separated; "" for a single element */
  const char* doc;
  const AlidadeOwned* owned;        /* null: constant at the neutral element, known exactly */
  const struct AlidadeSpace* parts; /* 1 to ALIDADE_MAX_ROLES parts; a part is not a product */
  uint32_t part_count, part_stride;
  void* reserved[1];
} AlidadeSpace;

/* ---- parameters ------------------------------------------------------------------------------ */

enum {
  ALIDADE_PARAM_NUMBER = 1,
  ALIDADE_PARAM_INTEGER = 2,
  ALIDADE_PARAM_FLAG = 3,
  ALIDADE_PARAM_CHOICE = 4, /* read as the index into `choices`; `count` is 1 */
  ALIDADE_PARAM_TEXT = 5,   /* read by read_text; `count` is 1 */
  ALIDADE_PARAM_FILE = 6    /* like TEXT; the text is the absolute path of a readable file */
};

/* Bits of AlidadeParam.flags. */
enum {
  ALIDADE_PARAM_HAS_DEFAULT = 1 << 16,
  ALIDADE_PARAM_LOW_OPEN = 1 << 17, /* the bound itself is excluded */
  ALIDADE_PARAM_HIGH_OPEN = 1 << 18,
  ALIDADE_PARAM_OR_NONE = 1 << 19 /* a number, or the word `none`, which is read as infinity */
};

/* Declaration of a parameter. To read a parameter, the plugin passes its declaration. */
typedef struct AlidadeParam {
  uint32_t struct_size, kind;
  const char* key; /* name; may contain dots: `noise.acceleration` */
  const char* unit;
  const char* doc;
  int32_t count; /* number of values; -1: a list of any length */
  uint32_t flags;
  double low, high;
  const double*
      fallback; /* `count` defaults if ALIDADE_PARAM_HAS_DEFAULT is set; for a choice: an index */
  const char* const* choices;
  int32_t choice_count, reserved0;
  const char* fallback_text; /* default of a text or file */
  void* reserved[4];
} AlidadeParam;

/* Functions of the host that `create` may call, in the thread that creates the model. A plugin must
 * not use the struct after `create` has returned. */
typedef struct AlidadeHost {
  uint32_t struct_size;
  uint16_t abi_major, abi_minor;
  void* context;
  /* Reads a parameter: writes at most `capacity` values and returns the number of values in the
   * config. Returns -1 if the host recorded an error. The plugin then continues with any valid
   * value, and the host rejects the model afterwards. */
  int32_t (*read)(void* context, const AlidadeParam* param, double* values, int32_t capacity);
  /* Reads a text or file: writes at most `capacity` bytes, of which the last is 0. Returns the
   * length without this zero. */
  int32_t (*read_text)(void* context, const AlidadeParam* param, char* text, int32_t capacity);
  /* Reports an error, such as parameters that contradict each other. `key` may be "". */
  void (*fail)(void* context, const char* key, const char* text);
  AlidadeReservedCall reserved[8];
} AlidadeHost;

/* ---- models ---------------------------------------------------------------------------------- */

/* Kinds of models. The value 3 is reserved. */
enum { ALIDADE_KIND_SENSOR = 1, ALIDADE_KIND_MOTION = 2 };

/* Bits of AlidadeDescription.capabilities. The lower half are hints. A host must support every bit
 * of the upper half that is set. */
enum {
  ALIDADE_ANALYTIC_JACOBIAN = 1, /* analytic Jacobians; else automatic differentiation */
  ALIDADE_STATIONARY = 2,        /* motion: x' = x and no noise; step need not be called */
  /* motion: this bit and the three bits above contain N. `step` without noise is additive in dt up
   * to an error of order dt^N. N = 0: `step` is exactly additive. */
  ALIDADE_STEP_ORDER_SHIFT = 4,
  ALIDADE_CAN_INITIALISE = 1 << 16,
  ALIDADE_HAS_VALIDITY = 1 << 17,
  ALIDADE_RESIDUAL_ONLY = 1 << 18, /* recursive estimators reject such a sensor */
  ALIDADE_NEEDS_PAYLOAD = 1 << 19, /* needs a payload, such as an image patch */
  /* motion: the white noise is discrete. w is then constant between two updates of the state by
   * measurements, also over several steps. Without this bit, the white noise is continuous: the w
   * of each step is independent of all other steps. */
  ALIDADE_DISCRETE_NOISE = 1 << 20
};

typedef struct AlidadeDescription {
  uint32_t struct_size, capabilities, role_count;
  uint32_t role_stride; /* bytes from one role to the next */
  const AlidadeSpace* roles;
  const AlidadeSpace* output;   /* sensor: the measurement; motion: null */
  const AlidadeSpace* residual; /* space of r, and of the noise of sqrt_noise; null: output */
  const AlidadeSpace* known;    /* sensor: known numbers of each measurement; null: none */
  const AlidadeSpace* inputs;   /* motion: control inputs */
  uint32_t input_count, input_stride;
  int32_t noise_count;          /* motion: n_w */
  int32_t initialise_role;      /* index of the role that `initialise` computes */
  const uint8_t* step_sparsity; /* motion: n x n, 1 if F may be non-zero; null: dense */
  int32_t prior_count;          /* number of prior values that `initialise` needs */
  int32_t reserved0;
  void* reserved[6];
} AlidadeDescription;

enum {
  ALIDADE_PAYLOAD_BYTES = 1,
  ALIDADE_PAYLOAD_IMAGE_U8 = 2,
  ALIDADE_PAYLOAD_IMAGE_F32 = 3,
  ALIDADE_PAYLOAD_POINTS_F32 = 4
};

/* Data of a measurement in addition to its numbers, such as an image. */
typedef struct AlidadePayload {
  uint32_t struct_size, kind;
  const void* data;
  uint64_t bytes;
  int64_t row_bytes;               /* image: distance between rows */
  int32_t width, height, channels; /* points: number of points, 1, numbers per point */
  int32_t reserved0;
  void* reserved[4];
} AlidadePayload;

/* One measurement. The struct is valid only during a call. */
typedef struct AlidadeObservation {
  uint32_t struct_size, flags;
  const double* z;     /* ambient values; null if only a prediction is requested */
  const double* known; /* space: description.known; null if description.known is null */
  double offset_s;     /* timestamp of z minus timestamp of the roles; 0 except in a scan */
  double span_s;       /* timestamp of z minus timestamp of roles with ALIDADE_ROLE_CLONE */
  const AlidadePayload* payloads;
  uint32_t payload_count, payload_stride;
  void* reserved[4];
} AlidadeObservation;

/* Functions of a sensor z = h(roles). `roles[i]` is the ambient value of role i, or null for an
 * optional role without a block. `jacobians` may be null. Each `jacobians[i]` (tangent size of z  x
 * tangent size of role i) may also be null. `seen` is never null. */
typedef struct AlidadeSensor {
  uint32_t struct_size, reserved0;
  int32_t (*eval)(const void* self, const AlidadeObservation* seen, const double* const* roles,
                  double* z, double* const* jacobians, const int32_t* row_strides);
  /* Computes L of R = L L', a square matrix of the tangent size of z. */
  int32_t (*sqrt_noise)(const void* self, const AlidadeObservation* seen,
                        const double* const* roles, double* l, int32_t row_stride);
  /* Returns ALIDADE_OK or ALIDADE_INVALID. Null: every measurement is valid. */
  int32_t (*valid)(const void* self, const AlidadeObservation* seen);
  /* Inverse measurement model: computes y, the value of the role `initialise_role`, from the other
   * roles, z and the prior. The prior contains the numbers that z does not determine, and is null
   * if z determines all of y. If the role has ALIDADE_ROLE_LANDMARK, y contains the values of this
   * role and of the landmark roles that follow, one after the other. Also computes the Jacobians of
   * y: jx[i] = dy/d role i, jz = dy/dz, jp = dy/d prior. Each Jacobian may be null. */
  int32_t (*initialise)(const void* self, const AlidadeObservation* seen,
                        const double* const* roles, const double* prior, double* y,
                        double* const* jx, const int32_t* jx_strides, double* jz, int32_t jz_stride,
                        double* jp, int32_t jp_stride);
  /* Only with ALIDADE_RESIDUAL_ONLY: computes r(roles, z) and its Jacobians. */
  int32_t (*residual)(const void* self, const AlidadeObservation* seen, const double* const* roles,
                      double* r, double* const* jacobians, const int32_t* row_strides);
  AlidadeReservedCall reserved[6];
} AlidadeSensor;

/* Functions of a motion model x' = f(x, u, w, dt), w ~ N(0, Qw). n is the sum of the tangent sizes
 * of the blocks, and n_u the sum of the tangent sizes of the control inputs. */
typedef struct AlidadeMotion {
  uint32_t struct_size, reserved0;
  /* Computes x' and the Jacobians `f` = d x'/d x (n x n), `g` = d x'/d w (n x n_w) and
   * `b` = d x'/d u (n x n_u). `f`, `g` and `b` may be null. A null `w` means w = 0. */
  int32_t (*step)(const void* self, const double* const* blocks, const double* const* inputs,
                  const double* w, double dt_s, double* const* next, double* f, int32_t f_stride,
                  double* g, int32_t g_stride, double* b, int32_t b_stride);
  /* Computes L of Qw = L L', n_w x n_w. */
  int32_t (*sqrt_q)(const void* self, const double* const* blocks, const double* const* inputs,
                    double dt_s, double* l, int32_t row_stride);
  AlidadeReservedCall reserved[6];
} AlidadeMotion;

/* One model. The host zeroes the struct and sets struct_size. `create` sets the other members. */
typedef struct AlidadeInstance {
  uint32_t struct_size, kind;
  void* self;
  void (*destroy)(void* self);
  const char* (*error_text)(const void* self); /* text of the last ALIDADE_ERROR in this thread */
  const AlidadeDescription* description;       /* valid while self exists */
  const AlidadeSensor* sensor; /* `kind` determines whether sensor or motion is set */
  const AlidadeMotion* motion;
  void* reserved[8];
} AlidadeInstance;

/* Bits of AlidadeEntry.thread_flags. */
enum {
  ALIDADE_THREAD_INSTANCES = 1, /* several instances may be used at the same time */
  ALIDADE_THREAD_CALLS = 2      /* several threads may call one instance at once */
};

typedef struct AlidadeEntry {
  uint32_t struct_size, kind;
  const char* family; /* sensors of one family can share landmarks; may be "" */
  const char* name;
  const char* doc;
  const char* citation;
  const char* version; /* version of the model; may be "" */
  uint32_t thread_flags, flags;
  /* Reads the parameters and fills `instance`. Returns ALIDADE_OK or ALIDADE_ERROR. */
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
