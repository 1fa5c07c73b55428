// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "alidade/experiment/source.h"
#include "alidade/model/params.h"
#include "alidade/plugin/param_reader.h"
#include "fuzz.h"

namespace alidade::fuzz {

/// Creates a source from the config map `yaml` and the data at `path`. Reads all its frames.
inline void ReadSource(std::unique_ptr<Source> (*create)(const SourceArguments&),
                       const std::string& yaml, const std::filesystem::path& path) {
  Config config = Config::FromText(yaml, "source");
  config.Set("path", path.string(), "fuzz");
  internal::ParamReader reader(config.root(), "source");
  Params params(&reader.host());
  for (const bool any_order : {false, true}) {
    const auto source = create({config.root(), params, 1, "/", any_order});
    reader.Check();
    static_cast<void>(Accepts([&] { static_cast<void>(source->Calibration()); }));
    static_cast<void>(Accepts([&] {
      SourceFrame frame;
      while (source->Next(frame)) {
        for (const Measurement& one : frame.measurements) {
          const auto& streams = source->streams();
          Require(one.stream >= 0 && one.stream < std::ssize(streams), "the stream does not exist");
          const StreamInfo& stream = streams[static_cast<std::size_t>(one.stream)];
          Require(std::ssize(one.values) == stream.size, "the size is not that of the stream");
          Require(std::ssize(one.known) == stream.known,
                  "the count of known numbers is not that of the stream");
        }
        Require(frame.truth.size() <= source->truths().size(), "the frame has too many truths");
      }
    }));
  }
}

}  // namespace alidade::fuzz
