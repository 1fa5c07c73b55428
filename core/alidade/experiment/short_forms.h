// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// Replaces the short forms of a config by the values that the readers need, and marks these values
/// as filled in (Node::is_filled). docs/config.md, "Short forms", describes the forms: `defaults`,
/// the type of an estimator, `roles: ENTRY`, `exact` and missing means of initial values, and
/// `landmarks.prior.distance_m`. `config` must not share its tree with another config.
/// Has no effect on a config without short forms. Errors: kBadConfig with the place of the short
/// form, and those of PluginHost::CreateSensor and PluginHost::CreateMotion.
void ExpandShortForms(Config& config, const PluginHost& host);

}  // namespace alidade
