// SPDX-License-Identifier: Apache-2.0
#include "alidade/bundle/bundle_file.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "alidade/bundle/formats.h"
#include "alidade/io/read_file.h"
#include "alidade/io/text_cell.h"

namespace alidade {
namespace {

[[noreturn]] void FailFormat(const std::string& name, const std::string& problem,
                             const std::string& expected) {
  throw Error(ExitCode::kBadData, ErrorLine(Place{name, 1, 1}, {}, problem, expected));
}

bool IsLibmv(std::string_view bytes) {
  return bytes.size() > 1 && (bytes[0] == 'v' || bytes[0] == 'V') &&
         (bytes[1] == 'P' || bytes[1] == 'N');
}

/// Returns the text of a file of a COLMAP folder.
std::string ReadColmapFile(const std::filesystem::path& file) {
  return internal::ReadFile(file, [&](ExitCode code, int error) {
    throw Error(code, ErrorLine(Place{file.string()}, {}, std::strerror(error),
                                "a COLMAP folder: cameras.txt, images.txt and points3D.txt"));
  });
}

BundleFile ReadColmapFolder(const std::filesystem::path& folder) {
  std::error_code ignored;
  const bool is_binary = std::filesystem::exists(folder / "cameras.bin", ignored);
  if (is_binary && !std::filesystem::exists(folder / "cameras.txt", ignored)) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{(folder / "cameras.bin").string()}, {},
                          "binary files of COLMAP are not supported",
                          "text files, from colmap model_converter --output_type TXT"));
  }
  return internal::ReadColmap(
      {ReadColmapFile(folder / "cameras.txt"), ReadColmapFile(folder / "images.txt"),
       ReadColmapFile(folder / "points3D.txt")},
      folder);
}

/// Returns true if the file belongs to a COLMAP folder.
bool IsColmapFile(const std::filesystem::path& file) {
  constexpr const char* kNames[] = {"cameras.txt", "images.txt", "points3D.txt"};
  std::error_code ignored;
  return std::ranges::count(kNames, file.filename()) > 0 &&
         std::ranges::all_of(kNames, [&](const char* name) {
           return std::filesystem::exists(file.parent_path() / name, ignored);
         });
}

/// Throws kBadData if the file is a pose graph of g2o.
void RejectPoseGraph(const std::string& name, std::string_view text) {
  const std::size_t start = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  const std::string_view word = text.substr(start, text.find_first_of(" \t\r\n", start) - start);
  if (!word.starts_with("VERTEX_") && !word.starts_with("EDGE_") && word != "FIX" &&
      !word.starts_with("PARAMS_"))
    return;
  FailFormat(name,
             "the file is a graph of g2o (" + cell::PrintableStart(word) +
                 "): its edges are relative poses, which bundle adjustment does not use",
             "pixels of points in the format BAL, Bundler, libmv or COLMAP; the sensor "
             "relative_pose measures relative poses in a run, see docs/relative_poses.md");
}

/// Returns true if the first word of the file is a number, as in the format BAL.
bool StartsWithCount(std::string_view text) {
  const char first = text[text.find_first_not_of(" \t\r\n")];
  return (first >= '0' && first <= '9') || first == '-' || first == '+';
}

/// Throws kBadData if the file is compressed or binary.
void RejectBinary(const std::string& name, std::string_view beginning) {
  constexpr std::string_view kCompressed[] = {"\x1F\x8B", "BZh",
                                              "\xFD"
                                              "7zXZ",
                                              "\x28\xB5\x2F\xFD"};
  if (std::ranges::any_of(kCompressed, [&](auto magic) { return beginning.starts_with(magic); })) {
    FailFormat(name, "the file is compressed",
               "uncompressed text, for example from zcat FILE | alidade bundle -");
  }
  if (beginning.find('\0') != beginning.npos)
    FailFormat(name, "the file is not text",
               "a bundle adjustment problem in the format BAL, Bundler, libmv or COLMAP");
}

/// Reads a whole file or pipe, or standard input if `file` is `-`. Errors: kInputMissing; kIo if a
/// read fails; kStopped if a signal ends the wait for data.
std::string ReadAll(const std::filesystem::path& file) {
  const bool standard_input = file == "-";
  const Place place{standard_input ? "<stdin>" : file.string()};
  const auto fail = [&](ExitCode code, int error) {
    if (error == EINTR) {
      throw Error(ExitCode::kStopped,
                  ErrorLine(place, {}, "a signal stopped the program while it waited for data"));
    }
    const char* const expected = code == ExitCode::kInputMissing ? "a readable file" : "";
    throw Error(code, ErrorLine(place, {}, std::strerror(error), expected));
  };
  const auto check_beginning = [&](std::string_view beginning) {
    if (!IsLibmv(beginning)) RejectBinary(place.file, beginning);
  };
  return standard_input
             ? internal::ReadDescriptor(STDIN_FILENO, fail, std::string::npos, check_beginning)
             : internal::ReadFile(file, fail, std::string::npos, check_beginning);
}

}  // namespace

const char* ToString(BundleFormat format) {
  constexpr const char* kNames[] = {"bal", "bundler", "libmv", "tracks", "colmap"};
  return kNames[static_cast<int>(format)];
}

BundleFile ReadBundle(const std::filesystem::path& file) {
  std::error_code ignored;
  if (file != "-" && std::filesystem::is_directory(file, ignored)) return ReadColmapFolder(file);
  if (IsColmapFile(file)) return ReadColmapFolder(file.parent_path());
  const std::string name = file == "-" ? "<stdin>" : file.string();
  const std::string text = ReadAll(file);
  const std::string_view view = text;
  if (view.find_first_not_of(" \t\r\n") == view.npos)
    FailFormat(name, "the file is empty",
               "a bundle adjustment problem in the format BAL, Bundler, libmv or COLMAP");
  if (IsLibmv(view)) return internal::ReadLibmv(view, name);
  if (view.starts_with(internal::kBundlerHeader)) return internal::ReadBundler(view, name);
  if (view.starts_with("# Bundle")) {
    FailFormat(name,
               "the header is '" + std::string(view.substr(0, view.find_first_of("\r\n"))) + '\'',
               '\'' + std::string(internal::kBundlerHeader) + '\'');
  }
  RejectPoseGraph(name, view);
  const std::size_t first = std::min(view.find('\n'), view.size());
  if (view.substr(0, first).find(',') != view.npos) {
    FailFormat(name,
               "the columns are separated by commas: tracks need a calibration and initial poses",
               "the options --camera FILE and --start FILE");
  }
  if (!StartsWithCount(view)) {
    FailFormat(
        name, "the format of the file is unknown",
        std::string("a file that begins with the numbers of cameras, points and observations "
                    "(BAL), with '") +
            std::string(internal::kBundlerHeader) +
            "' (Bundler), or with vP or VP (libmv), a COLMAP folder, or tracks with --camera and "
            "--start");
  }
  return internal::ReadBal(view, name);
}

std::string BundleText(const BundleFile& file) {
  ALIDADE_EXPECTS(file.format != BundleFormat::kTracks && file.format != BundleFormat::kColmap);
  if (file.format == BundleFormat::kBundler) return internal::BundlerText(file);
  if (file.format == BundleFormat::kLibmv) return internal::LibmvBytes(file);
  return internal::BalText(file);
}

std::vector<std::pair<std::string, std::string>> BundleTexts(const BundleFile& file) {
  switch (file.format) {
    case BundleFormat::kBal:
      return {{"problem.txt", BundleText(file)}};
    case BundleFormat::kBundler:
      return {{"problem.out", BundleText(file)}};
    case BundleFormat::kLibmv:
      return {{"problem.bin", BundleText(file)}};
    case BundleFormat::kTracks:
      return {};
    case BundleFormat::kColmap:
      break;
  }
  internal::ColmapTexts texts = internal::ColmapTextsOf(file);
  return {{"problem/cameras.txt", std::move(texts.cameras)},
          {"problem/images.txt", std::move(texts.images)},
          {"problem/points3D.txt", std::move(texts.points)}};
}

}  // namespace alidade
