// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kCsvKeys =
    "path           file or pipe, relative to the folder of the config; '-' is standard input\n"
    "time           {column: t_s, unit: s, repeats: false}; unit s, ms, us or ns; default column "
    "t_s in s; repeats: consecutive rows with the same time are one frame\n"
    "rate_hz        rows per second, if there is no column of time; the first row is at 0\n"
    "streams        stream: x, [x, y], or {columns: x, reciprocal: false, gain: 1, known: [a, b]}; "
    "x is a column; a and b are columns with the known numbers of the sensor\n"
    "truth          the same for true values, but without known; optional\n"
    "separator      character between cells; default ','\n"
    "missing        cells that mark a missing value; default [\"\"], the empty cell\n"
    "blind_after    fraction of the rows, in [0, 1], after which streams are dropped; default 1\n"
    "blind          streams that blind_after drops; default: the first stream";

/// Creates a source of measurements and truth, read from the columns of a table. The table is a
/// file, a pipe, or standard input.
///
/// A frame is one row. With `repeats` a frame is all consecutive rows with one time; it is complete
/// when the next frame begins. The first line that is neither blank nor a comment (`#`) names the
/// columns. The source ignores columns that the config does not name. If a cell marks a missing
/// value, the frame omits the stream or true value of this cell, and nothing replaces it. Times
/// without an exponent are read exactly, also in ns since 1970. Comments above the header can
/// contain the calibration: see CsvCalibration.
///
/// Keys         kCsvKeys.
/// Errors       kBadData with file, line and column of the first invalid cell; kInputMissing; kIo
///              if the file changes during the run; kBadConfig.
std::unique_ptr<Source> CreateCsv(const SourceArguments& arguments);

}  // namespace alidade
