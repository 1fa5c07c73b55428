// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace alidade {

/// Returns the interactive page of a folder of `alidade run`, `compare`, `sweep` or `bundle`: one
/// HTML file that needs no network. Equal folders yield equal bytes.
///
/// The page of a run that failed quotes the lines of the file that the error names, if this file
/// can still be read. Errors: kInputMissing if the folder contains no results; kBadData if a file
/// of the folder is invalid.
std::string ReportPage(const std::filesystem::path& folder);

}  // namespace alidade
