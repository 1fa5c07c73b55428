// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "alidade/experiment/source_plugin.h"
#include "alidade/plugin/load.h"

namespace alidade {

/// The source of the plugin `name` in a folder of its own, which has OpenCV and takes long to load:
/// it is loaded when its source is made. Errors: kPlugin, kNotTrusted, those of the source.
inline std::unique_ptr<Source> CreateOnDemand(const std::string& name,
                                              const SourceArguments& arguments) {
  const void* const factory = internal::FactoryOnDemand(
      kSourceKind, name, {},
      ErrorLine(arguments.entry.place(), arguments.entry.path(),
                "this build of alidade reads no images",
                "one that found OpenCV: apt-get install libopencv-dev, then configure and build "
                "again"));
  return static_cast<const SourceEntry*>(factory)->create(arguments);
}

}  // namespace alidade
