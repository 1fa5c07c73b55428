#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/examples/readme_test.sh PROGRAM COMPILER [README [COMMANDS]]
#
# Runs the code blocks of README.md in a temporary folder. A block below `<!-- test: FILE -->` is
# written to FILE. In a block below `<!-- test: output -->` each line that begins with `$ ` is run
# as a command, with PROGRAM instead of `alidade` and COMPILER instead of `g++`. The output of the
# command must contain the lines below the command in this order; other lines may come between them.
# Numbers may differ by 1 %: the seed is fixed, but the last digits depend on the compiler. A block
# marked `output batch` is skipped in a build without the batch estimators. Each scripts/NAME in a
# block of the language sh must exist. README must contain at least COMMANDS commands (default: 3).
set -euo pipefail
program=$(realpath "$1")
compiler=$(command -v "$2")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
readme=${3:-README.md}
least=${4:-3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset ALIDADE_PLUGIN_PATH

mkdir "$work/bin"
touch "$work/scripts"
ln -s "$PWD/core" "$PWD/examples" "$work"
printf '#!/bin/sh\nexec "%s" "$@"\n' "$program" >"$work/bin/alidade"
printf '#!/bin/sh\nexec "%s" "$@"\n' "$compiler" >"$work/bin/g++"
chmod +x "$work/bin/alidade" "$work/bin/g++"
export PATH=$work/bin:$PATH

# Extracts the blocks: files, and commands with their expected lines. A command is written to
# $work/N.command, and its expected lines are written to $work/N.lines.
awk -v work="$work" '
  /^<!-- test: / { kind = $3; needs = $4 == "batch"; next }
  /^```/ && !inside { inside = 1; sh = $0 == "```sh"; next }
  /^```/ { inside = 0; kind = ""; next }
  !inside { next }
  sh { if ($1 ~ /^scripts\//) print $1 > (work "/scripts"); next }
  kind == "" { print "error: a block without a test: " $0; exit 1 }
  kind != "output" { print > (work "/" kind); next }
  /^\$ / {
    n++
    print substr($0, 3) > (work "/" n ".command")
    printf "" > (work "/" n ".lines")
    if (needs) printf "" > (work "/" n ".needs_batch")
    next
  }
  { print > (work "/" n ".lines") }' "$readme"

while read -r script; do
  [[ -x $script ]] || { echo "error: $script does not exist" >&2; exit 1; }
done <"$work/scripts"

# compare SHOWN PRINTED: checks that all lines of SHOWN are in PRINTED, in the same order.
compare() {
  awk '
    function number(word) { return word ~ /^[-+]?[0-9][0-9.]*(e[-+]?[0-9]+)?$/ }
    function near(a, b,    size) {
      if (!number(a) || !number(b)) return a == b
      size = b < 0 ? -b : b
      return a - b <= 0.01 * size && b - a <= 0.01 * size
    }
    function same(shown, printed,    a, b, n, i) {
      n = split(shown, a, " ")
      if (n != split(printed, b, " ")) return 0
      for (i = 1; i <= n; i++) if (!near(a[i], b[i])) return 0
      return 1
    }
    NR == FNR { shown[++lines] = $0; next }
    at < lines && same(shown[at + 1], $0) { at++ }
    END { if (at < lines) { print shown[at + 1]; exit 1 } }' "$1" "$2"
}

commands=0
cd "$work"
plugins=$(alidade plugins list)
for ((n = 1; ; n++)); do
  [[ -e $n.command ]] || break
  if [[ -e $n.needs_batch && $plugins != *ceres_batch* ]]; then
    echo "skipped, because this build has no batch estimator: $(cat $n.command)"
    continue
  fi
  bash -e "$n.command" >"$n.printed" 2>&1 || { cat "$n.printed" >&2; exit 1; }
  if ! missing=$(compare "$n.lines" "$n.printed"); then
    cat "$n.printed"
    echo "error: '$(cat "$n.command")' does not print the line '$missing' of $readme" >&2
    exit 1
  fi
  commands=$((commands + 1))
done
((commands >= least)) || { echo "error: $readme contains only $commands commands; expected at least $least" >&2; exit 1; }
echo "readme: $commands commands print what $readme shows"
