// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kCsvKeys =
    "path           file or pipe, from the folder of the config; '-' is standard input\n"
    "time           {column: t_s, unit: s, repeats: false}; unit s, ms, us or ns; default column "
    "t_s in s; repeats: rows of one time, one after the other, are one frame\n"
    "rate_hz        rows a second, where there is no column of time; the first is at 0\n"
    "streams        stream: x, [x, y], or {columns: x, reciprocal: false, gain: 1, known: [a, b]}; "
    "x a column, a and b those of numbers that its sensor takes as known\n"
    "truth          the same for truth values, without known; may be left out\n"
    "separator      character between cells; default ','\n"
    "missing        cells that say there is no value; default [\"\"], the empty cell\n"
    "blind_after    share of the rows, in [0, 1], from which on streams are dropped; default 1\n"
    "blind          streams that blind_after drops; default the first";

/// Measurements and truth from the columns of a table: a file, a pipe, or standard input.
///
/// Each row is a frame, or with `repeats` all rows of one time that come one after the other; a
/// frame is then complete where the next one begins. The first line that is neither blank nor a
/// comment (`#`) names the columns; columns that the config does not name may hold anything. A cell
/// that says "missing" leaves its stream, or truth value, out of the frame; nothing stands in for
/// it. Time is read exactly where it is written without an exponent, so that ns since 1970 keep
/// every digit. Comments above the names of the columns may tell the calibration, see
/// CsvCalibration.
///
/// Keys         kCsvKeys.
/// Errors       kBadData with file, line and column of the first cell that is wrong; kInputMissing;
///              kIo where the file changes while it is read; kBadConfig.
std::unique_ptr<Source> CreateCsv(const SourceArguments& arguments);

}  // namespace alidade
