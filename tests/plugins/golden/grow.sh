#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# grow.sh HEADER OUTPUT
#
# Derives the plugin_abi.h of a later minor version from HEADER. The later version uses every
# extension that the rules of the ABI permit. Structs that plugins create have more members at their
# end. All structs use a reserved member (`taken`). There are a kind of entry, hints and required
# bits that HEADER does not define. Fails if a struct is not found, so this script must be changed
# together with the header.
set -eu
awk '
  BEGIN {
    made = "BuildTag Owned Space Param Description Sensor Motion Entry Table"
    lent = "Host Payload Observation Instance"
    count = split(made " " lent, name, " ")
    for (i = 1; i <= count; i++) wanted["Alidade" name[i]] = 1
    count = split(made, name, " ")
    for (i = 1; i <= count; i++) grows["Alidade" name[i]] = 1
  }
  /^#define ALIDADE_ABI_MINOR / { $3 += 3; minor = 1 }
  /^typedef struct Alidade/ { inside = $3 }
  inside in wanted && / reserved\[[0-9]+\];/ {
    open = index($0, "[")
    left = substr($0, open + 1) + 0
    type = $1
    if (left > 1) {
      print "  " type " taken;"
      sub(/\[[0-9]+\]/, "[" left - 1 "]")
      took[inside] = 1
    }
  }
  /^} Alidade/ {
    if (inside in grows) {
      print "  uint32_t later[8];"
      grew[inside] = 1
    }
    inside = ""
  }
  { print }
  /^enum { ALIDADE_KIND_SENSOR / {
    print "enum { ALIDADE_KIND_LATER = 3 };"
    print "enum { ALIDADE_LATER_HINT = 1 << 12, ALIDADE_LATER_BIT = 1 << 28 };"
    kind = 1
  }
  END {
    for (one in grows) if (!(one in grew)) missing = missing " " one
    # AlidadeSpace has only one reserved member.
    for (one in wanted) if (!(one in took) && one != "AlidadeSpace") missing = missing " " one
    if (!minor) missing = missing " ALIDADE_ABI_MINOR"
    if (!kind) missing = missing " ALIDADE_KIND_SENSOR"
    if (missing != "") {
      print "grow.sh: not found, or without room:" missing > "/dev/stderr"
      exit 1
    }
  }' "$1" >"$2"
