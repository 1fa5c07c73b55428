// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "alidade/state/manifold.h"

/// Which of the forms of alidade/model/landmark.h a landmark is written in, where that is known at
/// run time only.
namespace alidade {

enum class LandmarkForm;  // in alidade/model/landmark.h

/// `inverse_depth`, `anchored`, `xyz`: the choices of `landmarks.representation`.
const char* ToString(LandmarkForm form);
/// Whether it is the form `xyz`, the point itself.
bool IsXyz(LandmarkForm form);
/// The form that these roles write, of which those that are no landmark's do not count. None: such
/// landmarks are never converted, and have no place in the record.
std::optional<LandmarkForm> FormOf(const std::vector<Space>& roles);

}  // namespace alidade
