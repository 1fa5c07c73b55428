// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Texts of files in this folder, without the licence lines. The CMake function alidade_embed
/// generates the source file that defines these texts.
namespace alidade::internal {

extern const char* const kReportCss;    ///< text of report.css
extern const char* const kFigureStyle;  ///< text of style.gp

}  // namespace alidade::internal
