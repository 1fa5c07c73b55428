// SPDX-License-Identifier: Apache-2.0
//
// Several threads that create models of one host.
#include <thread>

#include "host_fixture.h"

namespace alidade {
namespace {

class CreatedAtOnceTest : public HostTest {
 protected:
  /// What two threads hear that create such a model each.
  std::string ErrorsOfTwo(const char* name) const {
    const PluginHost host({Built("created_at_once")});
    std::string errors[2];
    {
      std::jthread threads[2];
      for (int i = 0; i < 2; ++i) {
        threads[i] = std::jthread([&host, name, &error = errors[i]] {
          try {
            static_cast<void>(host.CreateSensor(name, Parse("model: any").root()));
          } catch (const Error& e) {
            error = e.what();
          }
        });
      }
    }
    return errors[0] + errors[1];
  }
};

TEST_F(CreatedAtOnceTest, AreThoseOfWhichSeveralMayWorkAtOnce) {
  EXPECT_EQ(ErrorsOfTwo("in_company"), "");
}

TEST_F(CreatedAtOnceTest, AreNoOthers) { EXPECT_EQ(ErrorsOfTwo("alone"), ""); }

}  // namespace
}  // namespace alidade
