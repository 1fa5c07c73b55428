// SPDX-License-Identifier: Apache-2.0
// A fingerprint of another ABI, of another processor or build, as BAD_FINGERPRINT says.
#include "alidade/model/plugin.h"
#include "probe.h"

#define OTHER_ABI 1
#define OTHER_PROCESSOR 2
#define OTHER_BUILD 3

namespace {

constexpr AlidadeFingerprint Spoiled() {
  AlidadeFingerprint f = alidade::detail::MakeFingerprint(
      BAD_FINGERPRINT == OTHER_BUILD ? ALIDADE_TIER_BUILD : ALIDADE_TIER_SEALED, "0.0.9 other");
  if (BAD_FINGERPRINT == OTHER_ABI) f.abi_major = 99;
  if (BAD_FINGERPRINT == OTHER_PROCESSOR) f.isa = 1u << 30;
  return f;
}

}  // namespace

extern "C" {
__attribute__((section(ALIDADE_FINGERPRINT_SECTION), used,
               visibility("default"))) extern const AlidadeFingerprint alidade_fingerprint =
    Spoiled();

__attribute__((visibility("default"))) const AlidadeTable* alidade_plugin() {
  static const AlidadeEntry entries[] = {ALIDADE_SENSOR(Probe, "probe", "", "")};
  static const AlidadeTable table = alidade::detail::Table(entries, &alidade_fingerprint);
  return &table;
}
}
