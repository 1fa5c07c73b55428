// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "alidade/experiment/source_plugin.h"
#include "alidade/plugin/load.h"

namespace alidade {

/// Creates the source of the plugin `name`. This call loads the plugin, which links OpenCV and
/// loads slowly. The plugin is in a separate folder, so that it is not loaded with other plugins.
/// Errors: kPlugin, kNotTrusted, and those of the source.
inline std::unique_ptr<Source> CreateOnDemand(const std::string& name,
                                              const SourceArguments& arguments) {
  const void* const factory = internal::FactoryOnDemand(
      kSourceKind, name, {},
      ErrorLine(arguments.entry.place(), arguments.entry.path(),
                "this build of alidade cannot read images",
                "a build with OpenCV: run 'apt-get install libopencv-dev', then configure and "
                "build again"));
  return static_cast<const SourceEntry*>(factory)->create(arguments);
}

}  // namespace alidade
