// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/error.h"

namespace alidade {

/// A video of JPEG images, one after the other: Motion JPEG in a RIFF AVI file with an index.
///
///   RIFF AVI   LIST hdrl   avih, LIST strl (strh, strf)
///              LIST movi   a chunk 00dc for each image
///              idx1        16 bytes for each image
///
/// Numbers are little-endian. It is complete after Close(), and holds up to 4 GB.
/// Errors       kCannotCreate, kIo.
class AviFile {
 public:
  /// `shown` is the path in messages; size in px; `rate_hz` images a second.
  AviFile(const std::filesystem::path& path, std::string shown, int width, int height,
          std::uint32_t rate_hz)
      : shown_(std::move(shown)),
        width_(static_cast<std::uint32_t>(width)),
        height_(static_cast<std::uint32_t>(height)),
        rate_hz_(rate_hz),
        file_(path, std::ios::binary) {
    if (!file_) throw Error(ExitCode::kCannotCreate, ErrorLine({shown_}, {}, "cannot be created"));
    WriteHeader();
  }

  /// One image, the bytes of a JPEG file.
  void Add(const std::vector<unsigned char>& jpeg) {
    const auto size = static_cast<std::uint32_t>(jpeg.size());
    const std::uint64_t end =
        std::uint64_t{kHeader} + movi_ + 10U + size + 16U * (index_.size() + 2);
    if (end > 0xFFFFFFFFU) {
      throw Error(ExitCode::kIo, ErrorLine({shown_}, {}, "is longer than 4 GB", "a shorter run"));
    }
    index_.push_back({movi_ + 4U, size});
    Text("00dc");
    Number(size);
    file_.write(reinterpret_cast<const char*>(jpeg.data()), size);
    if (size % 2 == 1) file_.put('\0');
    movi_ += 8U + size + size % 2U;
    Check();
  }

  void Close() {
    Text("idx1");
    Number(static_cast<std::uint32_t>(16U * index_.size()));
    for (const auto& [at, size] : index_) {
      Text("00dc");
      Number(0x10);  // a key frame
      Number(at);    // from the word `movi`
      Number(size);
    }
    file_.seekp(0);
    WriteHeader();
    file_.close();
    Check();
  }

 private:
  static constexpr std::uint32_t kHeader = 224;  ///< bytes before the first image

  void WriteHeader() {
    const auto count = static_cast<std::uint32_t>(index_.size());
    Text("RIFF");
    Number(kHeader - 8U + movi_ + 8U + 16U * count);
    Text("AVI LIST");
    Number(192);
    Text("hdrlavih");
    Numbers({56, 1000000U / rate_hz_, 0, 0, 0x10, count, 0, 1, 0, width_, height_, 0, 0, 0, 0});
    Text("LIST");
    Number(116);
    Text("strlstrh");
    Number(56);
    Text("vidsMJPG");
    Numbers({0, 0, 0, 1, rate_hz_, 0, count, 0, 0xFFFFFFFFU, 0, 0, height_ << 16U | width_});
    Text("strf");
    Numbers({40, 40, width_, height_, 24U << 16U | 1U});
    Text("MJPG");
    Numbers({3U * width_ * height_, 0, 0, 0, 0});
    Text("LIST");
    Number(4U + movi_);
    Text("movi");
  }
  void Text(std::string_view text) { file_ << text; }
  void Number(std::uint32_t number) {
    for (int shift = 0; shift < 32; shift += 8)
      file_.put(static_cast<char>(number >> shift & 0xFFU));
  }
  void Numbers(const std::vector<std::uint32_t>& numbers) {
    for (const std::uint32_t number : numbers) Number(number);
  }
  void Check() {
    if (!file_) throw Error(ExitCode::kIo, ErrorLine({shown_}, {}, "cannot be written in full"));
  }

  struct Entry {
    std::uint32_t at, size;
  };
  std::string shown_;
  std::uint32_t width_, height_, rate_hz_;
  std::ofstream file_;
  std::uint32_t movi_ = 0;  ///< bytes of the images with their heads
  std::vector<Entry> index_;
};

}  // namespace alidade
