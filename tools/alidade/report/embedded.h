// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Texts of the files in the folder `page`, without the licence lines. The CMake function
/// alidade_embed generates the source files that define these texts.
namespace alidade::internal {

extern const char* const kPageTemplate;  ///< text of template.html
extern const char* const kPageStyle;     ///< text of style.css
extern const char* const kPageScript;    ///< texts of all scripts, joined

}  // namespace alidade::internal
