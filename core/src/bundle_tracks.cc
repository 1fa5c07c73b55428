// SPDX-License-Identifier: Apache-2.0
#include "alidade/bundle_file.h"

namespace alidade {

BundleFile ReadBundleTracks(const BundleTracks& from, const PluginHost&) {
  throw Error(ExitCode::kUsage, from.tracks.string());
}

}  // namespace alidade
