// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <type_traits>

/// Settings of Eigen that must be equal in the library and in its users, because Eigen matrices are
/// part of the API. The library aligns matrices to 16 bytes and allocates them by malloc. A program
/// must use the same settings, whichever compiler flags it uses. The CMake target
/// alidade::estimation ensures this.
static_assert(
    EIGEN_MAX_ALIGN_BYTES == 16 && EIGEN_MAX_STATIC_ALIGN_BYTES == 16,
    "Eigen aligns matrices differently from libalidade-estimation, because of -mavx, "
    "-march=native or a macro of Eigen: link the CMake target alidade::estimation, or compile "
    "every source with -DEIGEN_MAX_ALIGN_BYTES=16");
static_assert(
    EIGEN_MALLOC_ALREADY_ALIGNED == 1,
    "Eigen allocates memory differently from libalidade-estimation, because of "
    "-fsanitize=address or a macro of Eigen: link the CMake target alidade::estimation, or "
    "compile every source with -DEIGEN_MALLOC_ALREADY_ALIGNED=1");
static_assert(!Eigen::MatrixXd::IsRowMajor && std::is_same_v<Eigen::Index, std::ptrdiff_t>,
              "Eigen stores matrices differently from libalidade-estimation: compile without "
              "EIGEN_DEFAULT_TO_ROW_MAJOR and EIGEN_DEFAULT_DENSE_INDEX_TYPE");
