#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# tests/layering_test.sh [ROOT]
# tests/layering_test.sh --self-test [ROOT]
#
# Checks the include rules and the forbidden content of sources. Prints one line `FILE:LINE: [RULE]
# TEXT` for each violation. The exit code is 1 if there is a violation. With --self-test the script
# adds violations of every rule to a copy of the tree, and fails unless each of them is caught.
#
#   spdx      every source, CMake file and script begins with the licence line
#   core      core includes only headers of core, and tools only headers of core and tools; an
#             include has the full path, "alidade/ROOM/FILE.h"
#   order     a room of core or tools includes only itself and earlier rooms in the order of
#             `rooms`; no room includes testing, which is only for tests
#   model     motion_models and sensors include only alidade/model/, Eigen, the standard library
#             and the header of their own stem
#   plugin    headers of plugins/ are included only by the plugin's own folder, and by
#             tests/plugins and tests/fuzz, which test the code behind the plugin interface; bench
#             may include the cost functions of plugins/ceres
#   upward    lower layers do not include cli, bench, tests or examples
#   library   only sources of core and tools include yaml-cpp, Boost, spdlog, OpenSSL and
#             nlohmann-json; core/alidade/io/json.h may also include the forward declarations of
#             nlohmann-json, because it declares the type for all rooms, and its test may include
#             all of nlohmann-json; only cli and bench include CLI11; only image plugins,
#             tests/images and bench include OpenCV; only plugins/ceres and bench include Ceres;
#             model, state and estimation include no library except Eigen, and base includes only
#             the standard library; only testing and tests include GoogleTest
#   exit      core, tools, models and plugins neither exit nor abort (except `_exit` in a file that
#             forks)
#   print     core, tools, models and plugins do not print
#   flags     CMake files contain no instruction-set flag and no fast-math flag (except for the
#             deliberately faulty plugins in tests/faults and tests/plugins)
#   named     core and tools contain neither the name of a shipped C++ plugin nor the name of its
#             file: a plugin declares its capabilities itself (`scene`, `tables` and `tracks` are
#             allowed, because they are also ordinary words)
set -euo pipefail

self_test=false
if [[ ${1:-} == --self-test ]]; then
  self_test=true
  shift
fi
rooms="model base state estimation testing io config plugin formula diagnosis experiment report evaluate bundle check replay record sweep compare"
root=$(cd "${1:-$(dirname "${BASH_SOURCE[0]}")/..}" && pwd)
folders=(core tools motion_models sensors plugins cli bench tests examples)

# Prints the violations in the sources that are given as arguments.
sources() {
  awk -v rooms="$rooms" '
    function report(rule, text) { print FILENAME ":" FNR ": [" rule "] " text }
    function exists(path,    line, status) {
      status = (getline line < path)
      close(path)
      return status >= 0
    }
    function forks(file,    line, found) {
      while ((getline line < file) > 0) if (line ~ /[^A-Za-z0-9_]fork\(\)/) found = 1
      close(file)
      return found
    }
    # Blanks comments and the contents of strings; `in_comment` carries over to the next line.
    function code_of(text,    out, two, c) {
      out = ""
      while (text != "") {
        two = substr(text, 1, 2)
        c = substr(text, 1, 1)
        if (in_comment) {
          if (two == "*/") { in_comment = 0; text = substr(text, 3) } else { text = substr(text, 2) }
        } else if (two == "//") {
          break
        } else if (two == "/*") {
          in_comment = 1
          text = substr(text, 3)
        } else if (c == "\"" && match(text, /^"([^"\\]|\\.)*"/)) {
          out = out "\"\""
          text = substr(text, RLENGTH + 1)
        } else if (c == "\047" && match(text, /^\047([^\047\\]|\\.[^\047]*)\047/)) {
          out = out "0"
          text = substr(text, RLENGTH + 1)
        } else {
          out = out c
          text = substr(text, 2)
        }
      }
      return out
    }
    # Returns true if `path` names a file of a plugin other than that of the current file.
    function of_plugin(path,    base) {
      base = path
      while (sub(/^(\.\.?\/)+/, "", base)) {}
      if (own_plugin != "" && index(base, "plugins/" own_plugin "/") == 1) return 0
      if (own_plugin != "" && index(base, "plugins/common/") == 1) return 0
      if (folder == "bench" && base ~ /^plugins\/ceres\/[a-z_\/]+\.h$/) return 0
      if (base ~ /^plugins\//) return !(folder == "tests" && exists("tests/" base))
      if (own_plugin != "" && exists("plugins/" own_plugin "/" path)) return path ~ /^\.\.\//
      if (own_plugin != "" && base ~ /\// && exists("plugins/" base)) return 1
      return path ~ /\/plugins\//
    }
    function foreign_to_library(path, bracket) {
      if (path ~ /^alidade\//)
        return !exists("core/" path) && !(folder == "tools" && exists("tools/" path))
      if (bracket && path ~ /^gtest\//) return FILENAME !~ /^core\/alidade\/testing\//
      if (bracket) return path !~ /^[a-z_0-9.]+$/ && path !~ /^(Eigen|sys|linux|boost|yaml-cpp|spdlog|openssl|nlohmann)\//
      return 1
    }
    # Returns the position of the room of `path` in the order of `rooms`. `path` is, for example,
    # "core/alidade/base/x.h" or "alidade/base/x.h".
    function floor_of(path) {
      sub(/^(core|tools)\//, "", path)
      sub(/^alidade\//, "", path)
      sub(/\/.*|\.h$/, "", path)
      return path in floor ? floor[path] : 0
    }
    function foreign_to_model(path, bracket) {
      if (path ~ /^alidade\//) return path !~ /^alidade\/model\// || !exists("core/" path)
      if (bracket) return path !~ /^(Eigen\/[A-Za-z]+|[a-z_0-9]+)$/
      return path != stem ".h"
    }
    function check_include(path, bracket) {
      if (path ~ /^(yaml-cpp|boost|spdlog|openssl|nlohmann)\// && FILENAME !~ /^(core|tools)\/.*\.cc$/ &&
          !(path == "nlohmann/json_fwd.hpp" && FILENAME == "core/alidade/io/json.h") &&
          !(path == "nlohmann/json.hpp" && FILENAME == "tests/core/io/json_test.cc"))
        report("library", "only sources of core and tools include " path)
      if (bracket && path ~ /\// && FILENAME ~ /^core\/alidade\/(model|base|state|estimation)\// &&
          (path !~ /^Eigen\// || FILENAME ~ /\/base\//))
        report("library", "estimation includes Eigen alone, base not even that: " path)
      if (path ~ /^CLI\// && folder != "cli" && folder != "bench")
        report("library", "only cli and bench include " path)
      if (path ~ /^ceres\// && own_plugin != "ceres" && folder != "bench")
        report("library", "only plugins/ceres and bench include " path)
      if (path ~ /^opencv/ && own_plugin !~ /image/ && folder != "bench" &&
          FILENAME !~ /^(tests|plugins\/[a-z_]+)\/images\//)
        report("library", "only image plugins, their tests and bench include " path)
      if (FILENAME !~ /^tests\/(plugins|fuzz)\// && of_plugin(path))
        report("plugin", "plugins are loaded, not included: " path)
      # core/CMakeLists.txt writes headers_hash.h.
      if (folder ~ /^(core|tools)$/ && foreign_to_library(path, bracket) &&
          path != "alidade/plugin/headers_hash.h")
        report("core", "not a header of " folder ", or not by its full path: " path)
      if (folder ~ /^(core|tools)$/ && path ~ /^alidade\// && floor_of(path) > floor_of(FILENAME))
        report("order", "a room that stands above: " path)
      if (folder !~ /^(tests|bench)$/ && path ~ /^alidade\/testing\// &&
          FILENAME !~ /^core\/alidade\/testing\//)
        report("order", "of use to tests alone: " path)
      if (folder ~ /^(sensors|motion_models)$/ && foreign_to_model(path, bracket))
        report("model", "a model includes alidade/model, Eigen and its own header alone: " path)
      if (folder ~ /^(core|tools|sensors|motion_models|plugins|cli)$/ &&
          path ~ /^(\.\.\/)*(cli|bench|tests|examples)\//)
        report("upward", "a layer above: " path)
    }
    BEGIN {
      count = split(rooms, name, " ")
      for (i = 1; i <= count; i++) floor[name[i]] = i
    }
    FNR == 1 {
      in_comment = 0
      folder = FILENAME
      sub(/\/.*/, "", folder)
      own_plugin = ""
      if (FILENAME ~ /^plugins\/[^\/]+\//) {
        own_plugin = substr(FILENAME, 9)
        sub(/\/.*/, "", own_plugin)
      }
      stem = FILENAME
      sub(/.*\//, "", stem)
      sub(/\.[a-z]+$/, "", stem)
      if ($0 !~ /^(\/\/|\/\*) SPDX-License-Identifier: Apache-2\.0( \*\/)?$/)
        report("spdx", "the first line is not the licence line")
    }
    /^[ \t]*#[ \t]*include[ \t]*[<"]/ {
      path = $0
      sub(/^[ \t]*#[ \t]*include[ \t]*/, "", path)
      bracket = substr(path, 1, 1) == "<"
      path = substr(path, 2)
      sub(/[>"].*/, "", path)
      check_include(path, bracket)
      next
    }
    folder ~ /^(core|tools)$/ && " " $0 " " ~ /[^a-z_](ceres_batch|fixed_lag|ceres_bundle|image_writer|image_tracks|depth_target|alidade_[a-z_0-9]+\.so)[^a-z_]/ {
      report("named", $0)
    }
    folder ~ /^(core|tools|sensors|motion_models|plugins)$/ {
      code = " " code_of($0) " "
      if (code ~ /[^A-Za-z0-9_.>:](std::|::)?(exit|_Exit|quick_exit|abort|terminate)[ \t]*\(/ ||
          code ~ /[^A-Za-z0-9_.>:](::)?_exit[ \t]*\(/ && !forks(FILENAME))
        report("exit", $0)
      if (code ~ /std::(cout|cerr|clog)[^A-Za-z0-9_]/ ||
          code ~ /[^A-Za-z0-9_.>:](std::|::)?(printf|vprintf|puts|putchar)[ \t]*\(/ ||
          code ~ /std::(print|println)[ \t]*\(/ ||
          code ~ /[^A-Za-z0-9_.>](stdout|stderr)[^A-Za-z0-9_]/)
        report("print", $0)
    }' "$@"
}

# Checks scripts and CMake files: the licence line must be the first line, or the line after `#!`.
licences() {
  awk '
    FNR == 1 && /^#!/ { below = 1; next }
    FNR == 1 || below {
      below = 0
      if ($0 !~ /^# SPDX-License-Identifier: Apache-2\.0$/)
        print FILENAME ":" FNR ": [spdx] the first line is not the licence line"
    }' "$@"
}

flags() {
  awk '
    FILENAME !~ /\.json$/ { sub(/(^|[ \t])#.*/, "") }
    /-(march|mtune|mcpu)=|-ffast-math|-funsafe-math|-ffinite-math|-Ofast|-m(avx|fma|sse)/ {
      print FILENAME ":" FNR ": [flags] " $0
    }' "$@"
}

# Prints all violations in the tree at $1, or only the violations in its file $2.
violations() {
  cd "$1"
  local only=${2:-}
  of_only() { if [[ -n $only ]]; then grep -Fx -- "$only" || true; else cat; fi; }
  local present=() found
  for found in "${folders[@]}"; do [[ -d $found ]] && present+=("$found"); done
  local list
  mapfile -t list < <(find "${present[@]}" -type f \( -name '*.h' -o -name '*.cc' -o -name '*.c' \) | sort | of_only)
  ((${#list[@]} == 0)) || sources "${list[@]}"

  local cmake
  mapfile -t cmake < <({
    ls CMakeLists.txt
    find "${present[@]}" cmake -type f \( -name CMakeLists.txt -o -name '*.cmake' -o -name '*.cmake.in' \)
  } | sort | of_only)
  local scripts
  mapfile -t scripts < <({
    find scripts .ci -type f ! -name '*.txt'
    find "${present[@]}" -type f -name '*.sh'
  } 2>/dev/null | sort | of_only)
  ((${#cmake[@]} + ${#scripts[@]} == 0)) || licences "${cmake[@]}" "${scripts[@]}"

  local flagged=()
  for found in "${cmake[@]}" $(echo CMakePresets.json | of_only); do
    [[ $found == tests/faults/* || $found == tests/plugins/* || ! -f $found ]] || flagged+=("$found")
  done
  ((${#flagged[@]} == 0)) || flags "${flagged[@]}"
}

check() {
  local found
  found=$(violations "$1")
  [[ -z $found ]] && return 0
  printf '%s\n' "$found"
  return 1
}

if ! $self_test; then
  check "$root" || exit 1
  echo "layering: no violations"
  exit 0
fi

# ---- self-test --------------------------------------------------------------------------------

copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
(cd "$root" && tar -cf - --exclude='*.partial' --exclude='./runs' --exclude='./build*' --exclude='./.git' .) |
  tar -xf - -C "$copy"
planted=0
failed=0
licence='// SPDX-License-Identifier: Apache-2.0'

# plant RULE FILE TEXT: appends TEXT to FILE; this must violate RULE on the last line.
plant() {
  local rule=$1 file=$copy/$2 text=$3 existed=false found
  planted=$((planted + 1))
  mkdir -p "$(dirname "$file")"
  if [[ -f $file ]]; then
    existed=true
    cp "$file" "$file.kept"
  fi
  printf '%b\n' "$text" >>"$file"
  found=$(violations "$copy" "$2")
  if ! grep -qF "$2:$(wc -l <"$file"): [$rule]" <<<"$found"; then
    echo "violation was not reported: [$rule] $2: $text"
    failed=$((failed + 1))
  fi
  if $existed; then mv "$file.kept" "$file"; else rm "$file"; fi
}

# allow FILE TEXT: appends TEXT to FILE; this must not violate a rule.
allow() {
  local file=$copy/$1 existed=false found
  planted=$((planted + 1))
  mkdir -p "$(dirname "$file")"
  if [[ -f $file ]]; then
    existed=true
    cp "$file" "$file.kept"
  fi
  printf '%b\n' "$2" >>"$file"
  found=$(violations "$copy" "$1" | grep -F "$1:" || true)
  if [[ -n $found ]]; then
    echo "allowed content was reported: $found"
    failed=$((failed + 1))
  fi
  if $existed; then mv "$file.kept" "$file"; else rm "$file"; fi
}

check "$copy" || { echo "the unchanged tree already has violations"; failed=1; }

plant spdx core/alidade/experiment/new.cc 'int x;'
plant spdx sensors/new.h '#pragma once'
plant spdx cmake/New.cmake 'set(x 1)'
plant spdx scripts/new '#!/bin/sh\ntrue'
plant spdx tests/new/CMakeLists.txt 'project(x)'
for header in sensors/scale_2d.h motion_models/constant.h alidade/experiment/no_such.h ../../sensors/scale_2d.h scale_2d.h \
  alidade/sensors/scale_2d.h run.h ../base/error.h alidade/record/recorder.h; do
  plant core core/alidade/experiment/new.cc "$licence\n#include \"$header\""
done
plant core core/alidade/experiment/new.h "$licence\n#  include <sensors/scale_2d.h>"
plant core tools/alidade/sweep/new.cc "$licence\n#include \"sensors/scale_2d.h\""
plant core tools/alidade/sweep/new.cc "$licence\n#include \"sweep.h\""
plant order core/alidade/base/new.h "$licence\n#include \"alidade/config/config.h\""
plant order core/alidade/model/new.h "$licence\n#include \"alidade/base/error.h\""
plant order core/alidade/estimation/new.cc "$licence\n#include \"alidade/experiment/run.h\""
plant order core/alidade/testing/new.h "$licence\n#include \"alidade/io/json.h\""
plant order core/alidade/experiment/new.cc "$licence\n#include \"alidade/testing/frames.h\""
plant order sensors/new.cc "$licence\n#include \"alidade/testing/frames.h\""
allow core/alidade/testing/new.h "$licence\n#include <gtest/gtest.h>\n#include \"alidade/estimation/ekf.h\""
plant core core/alidade/estimation/new.h "$licence\n#include <gtest/gtest.h>"
plant order tools/alidade/evaluate/new.cc "$licence\n#  include \"alidade/sweep/sweep.h\""
for header in '"stereo_disparity.h"' '"motion_models/constant.h"' '"../motion_models/constant.h"' '<vector.h>' \
  '<unistd.h>' '<sys/stat.h>' '"ceres/jet.h"' '<yaml-cpp/yaml.h>' '"alidade/model/no_such.h"' '"alidade/base/error.h"'; do
  plant model sensors/new.cc "$licence\n#include $header"
  plant model motion_models/new.cc "$licence\n#include ${header/stereo_disparity/scale_2d}"
done
for file in core/alidade/experiment/new.cc sensors/new.h cli/new.cc tests/core/new.cc bench/speed/new.cc examples/new.cc; do
  plant plugin "$file" "$licence\n#include \"plugins/tables/tables.h\""
done
plant plugin tests/sensors/new.cc "$licence\n#include \"../../plugins/tables/tables.h\""
mkdir -p "$copy/plugins/depth_target" && echo "$licence" >"$copy/plugins/depth_target/planted.h"
plant plugin plugins/tables/new.cc "$licence\n#include \"../depth_target/planted.h\""
plant plugin plugins/tables/new.cc "$licence\n#include \"depth_target/planted.h\""
for header in cli/main.h bench/speed/x.h tests/support/x.h ../tests/support/x.h; do
  plant upward plugins/tables/new.cc "$licence\n#include \"$header\""
  plant upward sensors/new.cc "$licence\n#include \"$header\""
done
for header in yaml-cpp/yaml.h boost/dll.hpp spdlog/spdlog.h openssl/evp.h nlohmann/json.hpp; do
  plant library core/alidade/experiment/new.h "$licence\n#include <$header>"
done
for file in plugins/tables/new.cc cli/new.cc tests/core/new.cc; do
  plant library "$file" "$licence\n#include <yaml-cpp/yaml.h>"
done
for file in core/alidade/experiment/new.cc plugins/tables/new.cc tests/core/new.cc; do
  plant library "$file" "$licence\n#include <CLI/App.hpp>"
done
for header in boost/math/distributions/chi_squared.hpp spdlog/spdlog.h sys/stat.h; do
  plant library core/alidade/estimation/new.cc "$licence\n#include <$header>"
done
plant library core/alidade/base/new.cc "$licence\n#include <Eigen/Core>"
allow core/alidade/state/new.h "$licence\n#include <Eigen/Core>\n#include \"alidade/base/error.h\""
plant library core/alidade/experiment/new.cc "$licence\n#include <ceres/problem.h>"
plant library plugins/tables/new.cc "$licence\n#include \"ceres/ceres.h\""
plant library core/alidade/experiment/new.cc "$licence\n#include <opencv2/core.hpp>"
plant library plugins/tables/new.cc "$licence\n#include <opencv2/core.hpp>"
plant library tests/plugins/new.cc "$licence\n#include <opencv2/core.hpp>"
for call in 'std::exit(1);' 'exit (1);' 'std::abort();' 'abort();' '::_exit(0);' 'if (x) std::quick_exit(1);' \
  'std::terminate();' '/* why */ abort();'; do
  plant exit core/alidade/experiment/new.cc "$licence\n$call"
done
for call in 'std::cout << 1;' 'std::cerr << 1;' 'printf("x");' 'std::printf("//");' 'puts("x");' \
  'fprintf(stdout, "x");' 'std::fputs("x", stderr);' 'std::print("x");'; do
  plant print core/alidade/experiment/new.cc "$licence\n$call"
done
for file in sensors/new.cc motion_models/new.h plugins/tables/new.cc; do
  plant exit "$file" "$licence\nabort();"
  plant print "$file" "$licence\nputs(\"x\");"
done
for name in ceres_batch fixed_lag ceres_bundle image_writer image_tracks depth_target alidade_ceres_bundle.so; do
  plant named tools/alidade/compare/new.h "$licence\nif (entry.name == \"$name\") return;"
done
plant named core/alidade/experiment/new.h "$licence\n/// As of ceres_batch."
for flag in -march=native -ffast-math -Ofast -mavx2; do
  plant flags sensors/CMakeLists.txt "add_compile_options($flag)"
  plant flags cmake/AlidadeAddPlugin.cmake "  target_compile_options(x PRIVATE $flag)  # fast"
  plant flags tests/CMakeLists.txt "add_compile_options($flag)"
  plant flags CMakePresets.json "\"CMAKE_CXX_FLAGS\": \"$flag\""
done

allow core/alidade/experiment/new.cc "$licence\n#include <yaml-cpp/yaml.h>\n#include <boost/dll.hpp>\n#include <spdlog/spdlog.h>\n#include <sys/stat.h>\n#include \"alidade/base/error.h\""
plant library core/alidade/base/number_text.h '#include <nlohmann/json_fwd.hpp>'
plant library core/alidade/io/json.h '#include <nlohmann/json.hpp>'
allow core/alidade/io/json.h '#include <nlohmann/json_fwd.hpp>'
allow tests/core/io/json_test.cc '#include <nlohmann/json.hpp>'
allow core/alidade/experiment/new.cc "$licence\n// std::cout, abort()\n/* exit(1);\n printf(\"x\") */ int a = std::snprintf(b, 3, \"exit(1)\");"
allow core/alidade/experiment/new.cc "$licence\nloop.abort(); p->exit(); my_exit(); stop::exit_code(); char c = '\"'; f(\"std::cout <<\");"
allow core/alidade/experiment/new.cc "$licence\nif (fork() == 0) _exit(0);"
allow core/alidade/experiment/new.cc "$licence\nf(\"tracks\", \"tables\", EstimatorKind::kSlidingWindow);  // my_fixed_lag_s"
allow plugins/tables/new.cc "$licence\nconst char* kName = \"ceres_batch\";"
allow sensors/new.cc "$licence\n#include \"new.h\"\n#include <cmath>\n#include <Eigen/Dense>\n#include \"alidade/model/model.h\""
allow plugins/tables/new.cc "$licence\n#include \"own.h\"\n#include <fcntl.h>\n#include \"sensors/scale_2d.h\""
allow plugins/ceres/batch/new.cc "$licence\n#include <ceres/ceres.h>"
allow plugins/image_sequence/new.cc "$licence\n#include <opencv2/core.hpp>"
allow plugins/tracks/images/new.cc "$licence\n#include <opencv2/core.hpp>"
allow tests/images/new.cc "$licence\n#include <opencv2/core.hpp>"
allow bench/speed/new.cc "$licence\n#include <ceres/problem.h>\n#include \"plugins/ceres/bundle/sensor_cost.h\""
allow bench/speed/new.cc "$licence\n#include <CLI/CLI.hpp>\n#include <opencv2/core.hpp>"
allow cli/new.cc "$licence\n#include <CLI/CLI.hpp>\nint main() { std::cout << 1; }"
allow tests/core/new.cc "$licence\n#include \"sensors/scale_2d.h\"\n#include \"alidade/config/tree.h\""
allow tests/plugins/new.cc "$licence\n#include \"plugins/tables/tables.h\""
allow tests/faults/CMakeLists.txt '# SPDX-License-Identifier: Apache-2.0\nadd_compile_options(-ffast-math)'
allow tests/plugins/CMakeLists.txt '# SPDX-License-Identifier: Apache-2.0\nadd_compile_options(-march=native)'
allow cmake/New.cmake '# SPDX-License-Identifier: Apache-2.0\n# never -march=native'

echo "layering: $planted cases, $failed with an unexpected result"
((failed == 0))
