// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade::testing {

/// Whether this is built with a sanitizer, under which memory, time and the end of a process that
/// crashes are not those of the code.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace alidade::testing
