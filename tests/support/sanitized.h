// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade::testing {

/// Whether this is a sanitizer build, in which memory use, run time and the exit after a crash
/// differ from those of a normal build.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace alidade::testing
