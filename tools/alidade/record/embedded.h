// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Texts of files next to this one, without their licence lines; alidade_embed makes their source.
namespace alidade::internal {

extern const char* const kReportCss;    ///< report.css
extern const char* const kFigureStyle;  ///< style.gp

}  // namespace alidade::internal
