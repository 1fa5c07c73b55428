// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kTableKeys =
    "files          list of tables, which are merged by time; each has the keys below, and its "
    "path is relative to the source's path; the keys of a single table may stand in the source\n"
    "origin         {latitude_deg, longitude_deg, height_m: 0}: origin of east, north and up; "
    "default: the first geodetic position\n"
    "path           file or pipe, relative to the folder of the config; '-' is standard input; "
    "with files: folder of the files\n"
    "time           {column: t_s, unit: s, offset_s: 0, delay_s: 0, repeats: false}, with the "
    "defaults; unit is s, ms, us or ns; offset_s is added to each time; delay_s is the default of "
    "the streams; repeats: true joins consecutive rows with the same time into one frame\n"
    "rate_hz        rows per second, if the table has no time column; the first row is at 0 s\n"
    "max_gap_s      longest time from one row to the next; default: unlimited\n"
    "on_gap         treatment of a row that is further ahead: fail (default) or skip\n"
    "streams        {STREAM: x}, {STREAM: [x, y]}, or {STREAM: {columns: [x, y], unit: deg, gain: "
    "1, offset: 0, reciprocal: false, geodetic: false, constant: 0, sigma: s, variance: v, "
    "covariance: [..], landmark: id, known: [a, b], rows: {column: value}, valid: flag, delay_s: "
    "0, min_interval_s: 0}}; every key but columns is optional, and constant replaces columns; "
    "known: {path: beacons.csv, id: beacon, columns: [a, b]} reads the row of a table with the "
    "same id; with a name such as range_*, there is one stream for each id\n"
    "truth          true values, in the form of streams; optional\n"
    "columns        names of the columns of a table without header\n"
    "separator      character between cells, or ' ' for any blanks; default: that of the table\n"
    "missing        texts of cells that mark a missing value, in addition to the empty cell\n"
    "blind_after    fraction of the rows, in [0, 1], after which the streams of blind are dropped; "
    "default 1\n"
    "blind          streams that blind_after drops; default: the first stream";

/// Creates a source of measurements and truth, read from the columns of tables. A table is a file,
/// a pipe, or standard input. Several tables are merged by time, in memory that does not grow with
/// their length.
///
/// A frame consists of the rows with the same time, one of each table. With `repeats` it consists
/// of all consecutive rows with the same time, and is complete when the next frame begins. The
/// first line that is neither blank nor a comment (`#`) names the columns. If this line contains
/// numbers, the comment above it names the columns. The source ignores columns that the config does
/// not name. If a cell marks a missing value, the frame omits the stream or true value of this
/// cell. Times that are written without an exponent are read exactly, even in ns since 1970.
///
/// A measurement with a delay is earlier than its row. If frames may arrive in any order, they are
/// in the order of the rows. Otherwise they are in the order of time, and the source holds rows
/// back as long as the largest delay requires.
///
/// Comments above the header can contain the calibration: see TableCalibration.
///
/// Keys         kTableKeys.
/// Errors       kBadData with file, line and column of the first invalid cell; kInputMissing; kIo
///              if a file changes during the run; kBadConfig.
std::unique_ptr<Source> CreateTables(const SourceArguments& arguments);

}  // namespace alidade
