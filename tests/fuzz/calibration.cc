// SPDX-License-Identifier: Apache-2.0
//
// The input is a camera calibration in the format of this project, OpenCV, ROS, Kalibr, EuRoC,
// ORB-SLAM or VINS.
#include "alidade/experiment/calibration_file.h"
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  const MemoryFile file(TextOf(data, size));
  static_cast<void>(Accepts([&] {
    const alidade::Config config = alidade::ReadCalibrationFile(file.path());
    const std::string text = config.ToYaml();
    std::string again;
    Require(Accepts([&] { again = alidade::Config::FromText(text, "again").ToYaml(); }),
            "the keys of a calibration cannot be read again");
    Require(text == again, "reading a calibration again changes it");
  }));
  return 0;
}
