// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "alidade/config/config.h"

/// Functions for tests that create configs from text.
namespace alidade::testing {

inline Config Read(std::string_view text) { return Config::FromText(text, "f.yaml"); }

/// Returns the message of the kBadConfig error that `call` throws.
template <class Call>
std::string Message(const Call& call) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadConfig);
    return e.what();
  }
  return "no error";
}

}  // namespace alidade::testing
