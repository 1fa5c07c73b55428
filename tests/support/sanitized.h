// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade::testing {

/// True in a sanitizer build. Memory use, run time and the exit after a crash then differ from
/// those of a normal build.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace alidade::testing
