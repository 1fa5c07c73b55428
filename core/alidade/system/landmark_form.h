// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "alidade/state/manifold.h"

/// Which of the representations of alidade/model/landmark.h a landmark is written in, where that is
/// known at run time only.
namespace alidade {

enum class LandmarkRepresentation;  // in alidade/model/landmark.h

/// `inverse_depth`, `anchored`, `xyz`: the choices of `landmarks.representation`.
const char* ToString(LandmarkRepresentation representation);
/// Whether it is the representation `xyz`, the point itself.
bool IsXyz(LandmarkRepresentation representation);
/// The representation that these roles write, of which those that are no landmark's do not count.
/// None: such landmarks are never converted, and have no place in the record.
std::optional<LandmarkRepresentation> RepresentationOf(const std::vector<Space>& roles);

}  // namespace alidade
