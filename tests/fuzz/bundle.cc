// SPDX-License-Identifier: Apache-2.0
//
// The input is a bundle adjustment problem in any format. Reading its BundleText must give the same
// problem.
#include "alidade/bundle/bundle_file.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

void Read(std::string_view bytes) {
  const BundleFile file = ReadBundle(MemoryFile(bytes).path());
  const std::string text = BundleText(file);
  std::string again;
  Require(Accepts([&] { again = BundleText(ReadBundle(MemoryFile(text).path())); }),
          "BundleText is refused");
  Require(text == again, "another BundleText");
}

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  static_cast<void>(Accepts([&] { Read(TextOf(data, size)); }));
  return 0;
}
