// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade::internal {

class ElfFile;

/// Refuses a library whose segments, or the tables that the dynamic loader walks, are not as it
/// takes them to be: it trusts them all, and what it would overwrite depends on what lies beside.
/// So a library that a child process loads may still be the end of its parent.
void CheckLoadable(const ElfFile& file);

}  // namespace alidade::internal
