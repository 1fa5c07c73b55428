// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/plugin_abi.h"

namespace alidade {

/// Result of one evaluation of a model. Any result except kOk leaves the outputs untouched.
enum class [[nodiscard]] Status : int{
    kOk = ALIDADE_OK,
    kOutOfDomain = ALIDADE_OUT_OF_DOMAIN,  ///< the model is not defined there
    kInvalid = ALIDADE_INVALID,            ///< the measurement itself is unusable
    kError = ALIDADE_ERROR,                ///< the plugin failed
};

}  // namespace alidade
