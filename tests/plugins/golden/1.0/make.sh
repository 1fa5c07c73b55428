#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# 1.0/make.sh FOLDER
#
# Records how the plugins in this folder were built: with g++ 12.2 and clang 14.0 of Debian 12, and
# with the first headers of plugin ABI 1.0. Do not run this script again; see ../README.md.
set -eu
to=$(cd "$1" && pwd)
cd "$(dirname "$0")"
core=$(cd ../../../../core && pwd)
cxx="-std=c++17 -O2 -Wall -Wextra -fPIC -shared -fvisibility=hidden -I $core -I /usr/include/eigen3"
small="-s -Wl,--build-id=none -Wl,-z,noseparate-code"
g++ $cxx models.cc -o "$to/gxx.so" $small
clang++ $cxx models.cc -o "$to/clangxx.so" $small
gcc -std=c99 -pedantic -O2 -Wall -Wextra -fPIC -shared -fvisibility=hidden -I "$core" models.c \
  -o "$to/c99.so" $small -lm
