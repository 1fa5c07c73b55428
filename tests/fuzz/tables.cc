// SPDX-License-Identifier: Apache-2.0
//
// The input is the config of the source tables and the table that it reads.
#include "plugins/tables/tables.h"

#include "fuzz.h"
#include "read_source.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  const auto parts = Parts(TextOf(data, size), 2);
  const MemoryFile table(parts[1]);
  static_cast<void>(Accepts([&] { ReadSource(alidade::CreateTables, parts[0], table.path()); }));
  return 0;
}
