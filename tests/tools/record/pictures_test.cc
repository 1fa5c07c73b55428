// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/pictures.h"

#include <gtest/gtest.h>

#include <string>

#include "alidade/base/error.h"

namespace alidade {
namespace {

TEST(Pictures, ABuildWithoutThePluginSaysWhatToInstall) {
  const PictureArguments arguments{PictureArguments::Form::kVideo, "/tmp/v.avi", "v.avi", 4, 3};
  try {
    OpenPictures(arguments, "/nonexistent");
    FAIL();
  } catch (const Error& e) {
    const std::string text = e.what();
    EXPECT_EQ(e.code(), ExitCode::kPlugin);
    EXPECT_EQ(text.find("v.avi: this build of alidade draws no pictures; expected one that found "
                        "OpenCV: apt-get install libopencv-dev"),
              0u)
        << text;
    EXPECT_NE(text.find("searched /nonexistent"), std::string::npos);
  }
}

}  // namespace
}  // namespace alidade
