// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kCsvKeys =
    "path           file or pipe, relative to the folder of the config; '-' is standard input\n"
    "time           {column: t_s, unit: s, repeats: false}, with the defaults; unit is s, ms, us "
    "or ns; repeats: true joins consecutive rows with the same time into one frame\n"
    "rate_hz        rows per second, if the table has no time column; the first row is at 0 s\n"
    "streams        {STREAM: x}, {STREAM: [x, y]}, or {STREAM: {columns: x, reciprocal: false, "
    "gain: 1, known: [a, b]}}; x and y are columns with the measurement; a and b are columns with "
    "the known numbers of the sensor\n"
    "truth          true values, in the form of streams, but without known; optional\n"
    "separator      character between cells; default ','\n"
    "missing        texts of cells that mark a missing value; default [\"\"]: an empty cell\n"
    "blind_after    fraction of the rows, in [0, 1], after which the streams of blind are dropped; "
    "default 1\n"
    "blind          streams that blind_after drops; default: the first stream";

/// Creates a source of measurements and truth, read from the columns of a table. The table is a
/// file, a pipe, or standard input.
///
/// A frame is one row. With `repeats` a frame consists of all consecutive rows with the same time.
/// It is complete when the next frame begins. The first line that is neither blank nor a comment
/// (`#`) names the columns. The source ignores columns that the config does not name. If a cell
/// marks a missing value, the frame omits the stream or true value of this cell. Times that are
/// written without an exponent are read exactly, even in ns since 1970. Comments above the header
/// can contain the calibration: see CsvCalibration.
///
/// Keys         kCsvKeys.
/// Errors       kBadData with file, line and column of the first invalid cell; kInputMissing; kIo
///              if the file changes during the run; kBadConfig.
std::unique_ptr<Source> CreateCsv(const SourceArguments& arguments);

}  // namespace alidade
