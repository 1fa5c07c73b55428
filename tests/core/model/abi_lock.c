/* SPDX-License-Identifier: Apache-2.0 */
/* Sizes, offsets and values of plugin ABI 1.0. A failure here means that the host can no longer use
 * existing plugins. A later minor version may only append lines to this file: for reserved members
 * that it uses, and for structs of plugins that it extends. */
#include "alidade/model/plugin_abi.h"

#ifdef __cplusplus
#define HOLDS(condition) static_assert(condition, #condition)
#else
#define HOLDS(condition) extern const char holds[(condition) ? 1 : -1]
#endif
#define SIZE(type, bytes) HOLDS(sizeof(type) == bytes)
#define PLACE(type, member, bytes) HOLDS(offsetof(type, member) == bytes)
#define VALUE(name, number) HOLDS(name == number)

HOLDS(ALIDADE_ABI_MAJOR == 1);
HOLDS(ALIDADE_MAGIC == 0x4144494cu);
HOLDS(ALIDADE_MUST_UNDERSTAND == 0xffff0000u);
HOLDS(sizeof(ALIDADE_ENTRY_SYMBOL) == sizeof("alidade_plugin"));
HOLDS(sizeof(ALIDADE_BUILD_TAG_SECTION) == sizeof(".alidade"));
HOLDS(sizeof(ALIDADE_NAMES_SECTION) == sizeof(".alidade_names"));
HOLDS(sizeof(void*) == 8 && sizeof(double) == 8 && sizeof(int) == 4);

SIZE(AlidadeBuildTag, 288);
PLACE(AlidadeBuildTag, magic, 0);
PLACE(AlidadeBuildTag, struct_size, 8);
PLACE(AlidadeBuildTag, abi_major, 12);
PLACE(AlidadeBuildTag, abi_minor, 14);
PLACE(AlidadeBuildTag, needs_minor, 16);
PLACE(AlidadeBuildTag, reserved0, 18);
PLACE(AlidadeBuildTag, kind, 20);
PLACE(AlidadeBuildTag, flags, 24);
PLACE(AlidadeBuildTag, isa, 28);
PLACE(AlidadeBuildTag, cplusplus, 32);
PLACE(AlidadeBuildTag, compiler, 36);
PLACE(AlidadeBuildTag, build, 100);
PLACE(AlidadeBuildTag, reserved, 260);

SIZE(AlidadeOwned, 72);
PLACE(AlidadeOwned, struct_size, 0);
PLACE(AlidadeOwned, dynamics, 4);
PLACE(AlidadeOwned, mean, 8);
PLACE(AlidadeOwned, sqrt_prior, 16);
PLACE(AlidadeOwned, sqrt_density, 24);
PLACE(AlidadeOwned, time_constant_s, 32);
PLACE(AlidadeOwned, reserved, 40);

SIZE(AlidadeSpace, 88);
PLACE(AlidadeSpace, struct_size, 0);
PLACE(AlidadeSpace, geometry, 4);
PLACE(AlidadeSpace, ambient, 8);
PLACE(AlidadeSpace, tangent, 12);
PLACE(AlidadeSpace, flags, 16);
PLACE(AlidadeSpace, reserved0, 20);
PLACE(AlidadeSpace, name, 24);
PLACE(AlidadeSpace, unit, 32);
PLACE(AlidadeSpace, elements, 40);
PLACE(AlidadeSpace, doc, 48);
PLACE(AlidadeSpace, owned, 56);
PLACE(AlidadeSpace, parts, 64);
PLACE(AlidadeSpace, part_count, 72);
PLACE(AlidadeSpace, part_stride, 76);
PLACE(AlidadeSpace, reserved, 80);

SIZE(AlidadeParam, 120);
PLACE(AlidadeParam, struct_size, 0);
PLACE(AlidadeParam, kind, 4);
PLACE(AlidadeParam, key, 8);
PLACE(AlidadeParam, unit, 16);
PLACE(AlidadeParam, doc, 24);
PLACE(AlidadeParam, count, 32);
PLACE(AlidadeParam, flags, 36);
PLACE(AlidadeParam, low, 40);
PLACE(AlidadeParam, high, 48);
PLACE(AlidadeParam, fallback, 56);
PLACE(AlidadeParam, choices, 64);
PLACE(AlidadeParam, choice_count, 72);
PLACE(AlidadeParam, reserved0, 76);
PLACE(AlidadeParam, fallback_text, 80);
PLACE(AlidadeParam, reserved, 88);

SIZE(AlidadeHost, 104);
PLACE(AlidadeHost, struct_size, 0);
PLACE(AlidadeHost, abi_major, 4);
PLACE(AlidadeHost, abi_minor, 6);
PLACE(AlidadeHost, context, 8);
PLACE(AlidadeHost, read, 16);
PLACE(AlidadeHost, read_text, 24);
PLACE(AlidadeHost, fail, 32);
PLACE(AlidadeHost, reserved, 40);

SIZE(AlidadeDescription, 136);
PLACE(AlidadeDescription, struct_size, 0);
PLACE(AlidadeDescription, capabilities, 4);
PLACE(AlidadeDescription, role_count, 8);
PLACE(AlidadeDescription, role_stride, 12);
PLACE(AlidadeDescription, roles, 16);
PLACE(AlidadeDescription, output, 24);
PLACE(AlidadeDescription, residual, 32);
PLACE(AlidadeDescription, known, 40);
PLACE(AlidadeDescription, inputs, 48);
PLACE(AlidadeDescription, input_count, 56);
PLACE(AlidadeDescription, input_stride, 60);
PLACE(AlidadeDescription, noise_count, 64);
PLACE(AlidadeDescription, initialise_role, 68);
PLACE(AlidadeDescription, step_sparsity, 72);
PLACE(AlidadeDescription, prior_count, 80);
PLACE(AlidadeDescription, reserved0, 84);
PLACE(AlidadeDescription, reserved, 88);

SIZE(AlidadePayload, 80);
PLACE(AlidadePayload, struct_size, 0);
PLACE(AlidadePayload, kind, 4);
PLACE(AlidadePayload, data, 8);
PLACE(AlidadePayload, bytes, 16);
PLACE(AlidadePayload, row_bytes, 24);
PLACE(AlidadePayload, width, 32);
PLACE(AlidadePayload, height, 36);
PLACE(AlidadePayload, channels, 40);
PLACE(AlidadePayload, reserved0, 44);
PLACE(AlidadePayload, reserved, 48);

SIZE(AlidadeObservation, 88);
PLACE(AlidadeObservation, struct_size, 0);
PLACE(AlidadeObservation, flags, 4);
PLACE(AlidadeObservation, z, 8);
PLACE(AlidadeObservation, known, 16);
PLACE(AlidadeObservation, offset_s, 24);
PLACE(AlidadeObservation, span_s, 32);
PLACE(AlidadeObservation, payloads, 40);
PLACE(AlidadeObservation, payload_count, 48);
PLACE(AlidadeObservation, payload_stride, 52);
PLACE(AlidadeObservation, reserved, 56);

SIZE(AlidadeSensor, 96);
PLACE(AlidadeSensor, struct_size, 0);
PLACE(AlidadeSensor, reserved0, 4);
PLACE(AlidadeSensor, eval, 8);
PLACE(AlidadeSensor, sqrt_noise, 16);
PLACE(AlidadeSensor, valid, 24);
PLACE(AlidadeSensor, initialise, 32);
PLACE(AlidadeSensor, residual, 40);
PLACE(AlidadeSensor, reserved, 48);

SIZE(AlidadeMotion, 72);
PLACE(AlidadeMotion, struct_size, 0);
PLACE(AlidadeMotion, reserved0, 4);
PLACE(AlidadeMotion, step, 8);
PLACE(AlidadeMotion, sqrt_q, 16);
PLACE(AlidadeMotion, reserved, 24);

SIZE(AlidadeInstance, 120);
PLACE(AlidadeInstance, struct_size, 0);
PLACE(AlidadeInstance, kind, 4);
PLACE(AlidadeInstance, self, 8);
PLACE(AlidadeInstance, destroy, 16);
PLACE(AlidadeInstance, error_text, 24);
PLACE(AlidadeInstance, description, 32);
PLACE(AlidadeInstance, sensor, 40);
PLACE(AlidadeInstance, motion, 48);
PLACE(AlidadeInstance, reserved, 56);

SIZE(AlidadeEntry, 96);
PLACE(AlidadeEntry, struct_size, 0);
PLACE(AlidadeEntry, kind, 4);
PLACE(AlidadeEntry, family, 8);
PLACE(AlidadeEntry, name, 16);
PLACE(AlidadeEntry, doc, 24);
PLACE(AlidadeEntry, citation, 32);
PLACE(AlidadeEntry, version, 40);
PLACE(AlidadeEntry, thread_flags, 48);
PLACE(AlidadeEntry, flags, 52);
PLACE(AlidadeEntry, create, 56);
PLACE(AlidadeEntry, reserved, 64);

SIZE(AlidadeTable, 72);
PLACE(AlidadeTable, struct_size, 0);
PLACE(AlidadeTable, magic, 4);
PLACE(AlidadeTable, abi_major, 8);
PLACE(AlidadeTable, abi_minor, 10);
PLACE(AlidadeTable, entry_stride, 12);
PLACE(AlidadeTable, entry_count, 16);
PLACE(AlidadeTable, flags, 20);
PLACE(AlidadeTable, entries, 24);
PLACE(AlidadeTable, build_tag, 32);
PLACE(AlidadeTable, reserved, 40);

VALUE(ALIDADE_MAX_ENTRIES, 1024);
VALUE(ALIDADE_MAX_ROLES, 64);
VALUE(ALIDADE_MAX_NAME, 128);
VALUE(ALIDADE_MAX_TEXT, 4096);
VALUE(ALIDADE_MAX_PARAMS, 4096);
VALUE(ALIDADE_MAX_CHOICES, 256);
VALUE(ALIDADE_MAX_SIZE, 1048576);
VALUE(ALIDADE_OK, 0);
VALUE(ALIDADE_OUT_OF_DOMAIN, 1);
VALUE(ALIDADE_INVALID, 2);
VALUE(ALIDADE_ERROR, 3);
VALUE(ALIDADE_PLUGIN_C_ABI, 1);
VALUE(ALIDADE_PLUGIN_CPP, 2);
VALUE(ALIDADE_BUILT_UNOPTIMISED, 1);
VALUE(ALIDADE_BUILT_FAST_MATH, 65536);
VALUE(ALIDADE_BUILT_DEBUG_STL, 131072);
VALUE(ALIDADE_ISA_SSE3, 1);
VALUE(ALIDADE_ISA_SSSE3, 2);
VALUE(ALIDADE_ISA_SSE4_1, 4);
VALUE(ALIDADE_ISA_SSE4_2, 8);
VALUE(ALIDADE_ISA_POPCNT, 16);
VALUE(ALIDADE_ISA_AVX, 32);
VALUE(ALIDADE_ISA_F16C, 64);
VALUE(ALIDADE_ISA_FMA, 128);
VALUE(ALIDADE_ISA_AVX2, 256);
VALUE(ALIDADE_ISA_BMI, 512);
VALUE(ALIDADE_ISA_BMI2, 1024);
VALUE(ALIDADE_ISA_LZCNT, 2048);
VALUE(ALIDADE_ISA_MOVBE, 4096);
VALUE(ALIDADE_ISA_AVX512F, 8192);
VALUE(ALIDADE_ISA_AVX512BW, 16384);
VALUE(ALIDADE_ISA_AVX512CD, 32768);
VALUE(ALIDADE_ISA_AVX512DQ, 65536);
VALUE(ALIDADE_ISA_AVX512VL, 131072);
VALUE(ALIDADE_ISA_AVX512IFMA, 262144);
VALUE(ALIDADE_ISA_AVX512VBMI, 524288);
VALUE(ALIDADE_ISA_AVX512VBMI2, 1048576);
VALUE(ALIDADE_ISA_AVX512VNNI, 2097152);
VALUE(ALIDADE_ISA_AVX512BITALG, 4194304);
VALUE(ALIDADE_ISA_AVX512VPOPCNTDQ, 8388608);
VALUE(ALIDADE_ISA_AVX512BF16, 16777216);
VALUE(ALIDADE_ISA_AVX512FP16, 33554432);
VALUE(ALIDADE_ISA_AVXVNNI, 67108864);
VALUE(ALIDADE_ISA_GFNI, 134217728);
VALUE(ALIDADE_ISA_OTHER, 1073741824);
VALUE(ALIDADE_VECTOR, 1);
VALUE(ALIDADE_ANGLE, 2);
VALUE(ALIDADE_UNIT_QUATERNION, 3);
VALUE(ALIDADE_UNIT_VECTOR, 4);
VALUE(ALIDADE_PRODUCT, 5);
VALUE(ALIDADE_SE_2_LEFT, 6);
VALUE(ALIDADE_SE_2_RIGHT, 7);
VALUE(ALIDADE_SE_3_LEFT, 8);
VALUE(ALIDADE_SE_3_RIGHT, 9);
VALUE(ALIDADE_SE_2_3_LEFT, 10);
VALUE(ALIDADE_SE_2_3_RIGHT, 11);
VALUE(ALIDADE_ROLE_OPTIONAL, 65536);
VALUE(ALIDADE_ROLE_OWNED, 131072);
VALUE(ALIDADE_ROLE_LANDMARK, 262144);
VALUE(ALIDADE_ROLE_SHARED, 524288);
VALUE(ALIDADE_ROLE_CLONE, 1048576);
VALUE(ALIDADE_STAYS, 0);
VALUE(ALIDADE_RANDOM_WALK, 1);
VALUE(ALIDADE_GAUSS_MARKOV, 2);
VALUE(ALIDADE_PARAM_NUMBER, 1);
VALUE(ALIDADE_PARAM_INTEGER, 2);
VALUE(ALIDADE_PARAM_FLAG, 3);
VALUE(ALIDADE_PARAM_CHOICE, 4);
VALUE(ALIDADE_PARAM_TEXT, 5);
VALUE(ALIDADE_PARAM_FILE, 6);
VALUE(ALIDADE_PARAM_HAS_DEFAULT, 65536);
VALUE(ALIDADE_PARAM_LOW_OPEN, 131072);
VALUE(ALIDADE_PARAM_HIGH_OPEN, 262144);
VALUE(ALIDADE_PARAM_OR_NONE, 524288);
VALUE(ALIDADE_KIND_SENSOR, 1);
VALUE(ALIDADE_KIND_MOTION, 2);
VALUE(ALIDADE_ANALYTIC_JACOBIAN, 1);
VALUE(ALIDADE_STATIONARY, 2);
VALUE(ALIDADE_STEP_ORDER_SHIFT, 4);
VALUE(ALIDADE_CAN_INITIALISE, 65536);
VALUE(ALIDADE_HAS_VALIDITY, 131072);
VALUE(ALIDADE_RESIDUAL_ONLY, 262144);
VALUE(ALIDADE_NEEDS_PAYLOAD, 524288);
VALUE(ALIDADE_DISCRETE_NOISE, 1048576);
VALUE(ALIDADE_PAYLOAD_BYTES, 1);
VALUE(ALIDADE_PAYLOAD_IMAGE_U8, 2);
VALUE(ALIDADE_PAYLOAD_IMAGE_F32, 3);
VALUE(ALIDADE_PAYLOAD_POINTS_F32, 4);
VALUE(ALIDADE_THREAD_INSTANCES, 1);
VALUE(ALIDADE_THREAD_CALLS, 2);
