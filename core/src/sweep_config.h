// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config.h"

/// The configs of a sweep's runs.
namespace alidade::internal {

/// A config of its own: reading one marks what was read.
Config Copy(const Config& config);

/// Refuses a source that the second run would find empty: standard input, or a pipe. Error:
/// kBadConfig.
void CheckReadableAgain(const Config& config);

}  // namespace alidade::internal
