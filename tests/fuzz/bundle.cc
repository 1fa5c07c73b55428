// SPDX-License-Identifier: Apache-2.0
//
// The input is a bundle adjustment problem in any format. BundleText of this problem must read back
// as the same problem.
#include "alidade/bundle/bundle_file.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

void Read(std::string_view bytes) {
  const BundleFile file = ReadBundle(MemoryFile(bytes).path());
  const std::string text = BundleText(file);
  std::string again;
  Require(Accepts([&] { again = BundleText(ReadBundle(MemoryFile(text).path())); }),
          "the reader refuses a BundleText");
  Require(text == again, "reading a BundleText changes it");
}

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  static_cast<void>(Accepts([&] { Read(TextOf(data, size)); }));
  return 0;
}
