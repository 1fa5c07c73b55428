// SPDX-License-Identifier: Apache-2.0
//
// The parts of the input are the files of a COLMAP folder: cameras, images, points. The texts of
// this problem must read back as the same problem.
#include "alidade/bundle/formats.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

void Read(std::string_view bytes) {
  const auto parts = Parts(bytes, 3);
  const internal::ColmapTexts text =
      internal::ColmapTextsOf(internal::ReadColmap({parts[0], parts[1], parts[2]}, "sparse"));
  internal::ColmapTexts again;
  Require(Accepts([&] { again = internal::ColmapTextsOf(internal::ReadColmap(text, "sparse")); }),
          "the reader refuses a written folder");
  Require(
      text.cameras == again.cameras && text.images == again.images && text.points == again.points,
      "reading a written folder changes it");
}

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  static_cast<void>(Accepts([&] { Read(TextOf(data, size)); }));
  return 0;
}
