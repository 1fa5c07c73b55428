// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/plugin_abi.h"

namespace alidade {

/// Result of one evaluation of a model. Unless the result is kOk, the outputs are unchanged.
enum class [[nodiscard]] Status : int{
    kOk = ALIDADE_OK,
    kOutOfDomain = ALIDADE_OUT_OF_DOMAIN,  ///< the model is not defined at the arguments
    kInvalid = ALIDADE_INVALID,            ///< the measurement is invalid at every state
    kError = ALIDADE_ERROR,                ///< the plugin failed
};

}  // namespace alidade
