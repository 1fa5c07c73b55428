// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "alidade/evaluate/trajectory.h"
#include "alidade/io/number_rows.h"

/// Table of the formats of pose files, and the detection of the format of a file.
namespace alidade::internal {

/// Format of a row with a particular number of columns.
struct RowFormat {
  TrajectoryFormat format = TrajectoryFormat::kDetect;
  std::size_t columns = 0;             ///< number of columns of the row
  bool only_commas = false;            ///< true: detected only if commas separate the columns
  bool w_first = false;                ///< true: qw is before qx
  std::span<const char* const> names;  ///< names of the columns that are read, the first ones
  const char* description = "";        ///< all columns, for messages
};

/// Formats that can be detected, for messages.
inline constexpr const char* kDetectedFormats =
    "8 columns (TUM), 20 (TUM with covariances), 12 (KITTI), or with commas 8, 11 or 17 (EuRoC)";

/// Order of the quaternion in a header: true if qw is before qx, nullopt if it is not named.
using HeaderOrder = std::optional<bool>;

/// Returns true if the row is a header: none of its cells is a number.
bool IsHeader(const NumberRows& rows);

/// Returns the order of the columns `q...w` and `q...x` of a header, as in `qw` or `q_RS_w []`.
HeaderOrder QuaternionOrder(const NumberRows& header);

/// Returns the row format of the given format. Its number of columns is that of the row, if the
/// format has a row format with this number.
RowFormat RowFormatOf(TrajectoryFormat format, const NumberRows& rows);

/// Row format that was detected, and the reason for it.
struct DetectedFormat {
  RowFormat row_format;
  /// Names the format, the reason for it and the option for other formats. It completes an error
  /// message.
  std::string assumption;
};

/// Detects the format from the first row of numbers: by its number of columns, by its commas, and
/// by the order of the quaternion in the header. With commas, 8 columns may be EuRoC or TUM. They
/// are EuRoC if the timestamp is a whole number.
///
/// Errors: kBadData if no format has this number of columns.
DetectedFormat DetectFormat(const NumberRows& rows, HeaderOrder header_order);

}  // namespace alidade::internal
