// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "alidade/experiment/source_plugin.h"
#include "alidade/plugin/load.h"

namespace alidade {

/// Creates the source of the plugin `name`, which is in a folder of its own because it links OpenCV
/// and loads slowly. The plugin is loaded by this call. Errors: kPlugin, kNotTrusted, those of the
/// source.
inline std::unique_ptr<Source> CreateOnDemand(const std::string& name,
                                              const SourceArguments& arguments) {
  const void* const factory = internal::FactoryOnDemand(
      kSourceKind, name, {},
      ErrorLine(arguments.entry.place(), arguments.entry.path(),
                "this build of alidade cannot read images",
                "a build with OpenCV: apt-get install libopencv-dev, then configure and build "
                "again"));
  return static_cast<const SourceEntry*>(factory)->create(arguments);
}

}  // namespace alidade
