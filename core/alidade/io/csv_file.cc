// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/csv_file.h"

#include "alidade/base/number_text.h"

namespace alidade::internal {

std::string CsvQuoted(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == text.npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted += '"';
}

CsvFile::CsvFile(const OutputFolder& folder, const std::string& name,
                 const std::vector<std::string>& header)
    : file_(folder.Create(name)), columns_(header.size()) {
  for (const std::string& column : header) Text(column);
  EndRow();
  rows_ = 0;
}

void CsvFile::Separate() {
  if (cells_++ > 0) row_ += ',';
}

CsvFile& CsvFile::Time(Timestamp timestamp) {
  Separate();
  if (timestamp != kNoTimestamp) AppendSeconds(row_, timestamp);
  return *this;
}

CsvFile& CsvFile::Number(double value) {
  Separate();
  AppendNumber(row_, value);
  return *this;
}

CsvFile& CsvFile::Integer(std::int64_t value) {
  Separate();
  row_ += std::to_string(value);
  return *this;
}

CsvFile& CsvFile::Landmark(std::int64_t id) { return id < 0 ? Empty() : Integer(id); }

CsvFile& CsvFile::Text(std::string_view value) {
  Separate();
  row_ += CsvQuoted(value);
  return *this;
}

CsvFile& CsvFile::Empty(std::size_t cells) {
  for (std::size_t i = 0; i < cells; ++i) Separate();
  return *this;
}

CsvFile& CsvFile::Numbers(const double* values, std::size_t count, std::size_t width) {
  ALIDADE_EXPECTS(count <= width);
  for (std::size_t i = 0; i < count; ++i) Number(values[i]);
  return Empty(width - count);
}

void CsvFile::EndRow() {
  ALIDADE_EXPECTS(cells_ == columns_);
  row_ += '\n';
  file_->Write(row_);
  row_.clear();
  cells_ = 0;
  ++rows_;
}

void CsvFile::Close() { file_->Close(); }

}  // namespace alidade::internal
