// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/plugin.h"
#include "probe.h"

extern "C" __attribute__((visibility("default"))) const AlidadeTable* alidade_plugin() {
  static const AlidadeEntry entries[] = {ALIDADE_SENSOR(Probe, "probe", "", "")};
  static const AlidadeTable table = alidade::detail::Table(entries, nullptr);
  return &table;
}
