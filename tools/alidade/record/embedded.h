// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Texts of files in this folder, without the licence lines. The CMake function alidade_embed
/// generates the source.
namespace alidade::internal {

extern const char* const kReportCss;    ///< report.css
extern const char* const kFigureStyle;  ///< style.gp

}  // namespace alidade::internal
