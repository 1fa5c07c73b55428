// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/images.h"

#include <gtest/gtest.h>

#include <string>

#include "alidade/base/error.h"

namespace alidade {
namespace {

TEST(Images, ABuildWithoutThePluginSaysWhatToInstall) {
  const ImageArguments arguments{ImageArguments::Form::kVideo, "/tmp/v.avi", "v.avi", 4, 3};
  try {
    OpenImageWriter(arguments, "/nonexistent");
    FAIL();
  } catch (const Error& e) {
    const std::string text = e.what();
    EXPECT_EQ(e.code(), ExitCode::kPlugin);
    EXPECT_EQ(text.find("v.avi: this build of alidade cannot write images; expected a build with "
                        "OpenCV: run 'apt-get install libopencv-dev'"),
              0u)
        << text;
    EXPECT_NE(text.find("searched /nonexistent"), std::string::npos);
  }
}

}  // namespace
}  // namespace alidade
