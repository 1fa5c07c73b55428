// SPDX-License-Identifier: Apache-2.0
//
// Tests that several threads can create models of one host.
#include <thread>

#include "host_fixture.h"

namespace alidade {
namespace {

class CreatedAloneTest : public HostTest {};

// ALIDADE_THREAD_INSTANCES applies to existing instances, not to their creation.
TEST_F(CreatedAloneTest, IsEachModelWhateverTheThread) {
  const PluginHost host({Built("created_alone")});
  std::string errors[2];
  {
    std::jthread threads[2];
    for (int i = 0; i < 2; ++i) {
      threads[i] = std::jthread([&host, &error = errors[i]] {
        try {
          static_cast<void>(host.CreateSensor("alone", Parse("model: any").root()));
        } catch (const Error& e) {
          error = e.what();
        }
      });
    }
  }
  EXPECT_EQ(errors[0] + errors[1], "");
}

}  // namespace
}  // namespace alidade
