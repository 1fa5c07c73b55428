// SPDX-License-Identifier: Apache-2.0
#include <archive.h>
#include <archive_entry.h>
#include <unistd.h>

#include <bit>
#include <cstdint>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>

#include "alidade/base/error.h"
#include "alidade/base/json.h"
#include "alidade/base/number_text.h"
#include "alidade/base/output_file.h"
#include "alidade/evaluate/errors.h"
#include "alidade/evaluate/report.h"
#include "alidade/evaluate/statistics_names.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "numbers go into .npy as they are");

/// A file of numpy, version 1.0: `values`, rows of `columns` numbers; 0: one dimension.
std::string Npy(const std::vector<double>& values, std::size_t columns = 0) {
  constexpr std::size_t kPreamble = 10, kAlign = 64;
  const std::string shape =
      columns == 0 ? std::to_string(values.size()) + ','
                   : std::to_string(values.size() / columns) + ", " + std::to_string(columns);
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (" + shape + "), }";
  header.append(kAlign - 1 - (kPreamble + header.size()) % kAlign, ' ').append("\n");
  std::string text = "\x93NUMPY";
  text += '\x01';
  text += '\0';
  text += static_cast<char>(header.size() & 0xFF);
  text += static_cast<char>(header.size() >> 8);
  text += header;
  return text.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
}

struct ZipEntry {
  std::string name, content;
};

/// The entries as a zip, in their order and without a time: equal results are equal bytes.
std::string Zip(const std::vector<ZipEntry>& entries) {
  constexpr std::size_t kOverhead = 1024;  // of an entry, more than its two headers take
  std::size_t room = kOverhead;
  for (const ZipEntry& entry : entries) room += entry.content.size() + kOverhead;
  std::string zip(room, '\0');
  std::size_t used = 0;
  const std::unique_ptr<archive, decltype(&archive_write_free)> writer(archive_write_new(),
                                                                       archive_write_free);
  const auto check = [&](bool good) {
    if (good) return;
    throw Error(ExitCode::kInternal,
                std::string("zip: ") + (writer ? archive_error_string(writer.get()) : "no memory"));
  };
  check(writer && archive_write_set_format_zip(writer.get()) == ARCHIVE_OK &&
        archive_write_zip_set_compression_store(writer.get()) == ARCHIVE_OK &&
        archive_write_open_memory(writer.get(), zip.data(), zip.size(), &used) == ARCHIVE_OK);
  for (const ZipEntry& entry : entries) {
    const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> head(archive_entry_new(),
                                                                             archive_entry_free);
    archive_entry_set_pathname(head.get(), entry.name.c_str());
    archive_entry_set_size(head.get(), std::ssize(entry.content));
    archive_entry_set_filetype(head.get(), AE_IFREG);
    archive_entry_set_perm(head.get(), 0644);
    check(archive_write_header(writer.get(), head.get()) == ARCHIVE_OK &&
          archive_write_data(writer.get(), entry.content.data(), entry.content.size()) ==
              std::ssize(entry.content));
  }
  check(archive_write_close(writer.get()) == ARCHIVE_OK);
  zip.resize(used);
  return zip;
}

/// As evo calls it.
std::string RelationText(PoseRelation relation) {
  constexpr const char* kNames[] = {"translation part (m)",
                                    "rotation part (unit-less)",
                                    "rotation angle in degrees (deg)",
                                    "rotation angle in radians (rad)",
                                    "full transformation (unit-less)",
                                    "point distance (m)"};
  return kNames[static_cast<std::size_t>(relation)];
}

std::string AlignmentText(Alignment alignment) {
  constexpr const char* kNames[] = {"(not aligned)",
                                    "(scale corrected)",
                                    "(with origin alignment)",
                                    "(with yaw alignment)",
                                    "(with SE(3) Umeyama alignment)",
                                    "(with Sim(3) Umeyama alignment)"};
  return kNames[static_cast<std::size_t>(alignment)];
}

std::string Title(const Evaluation& evaluation, SavedErrors which, PoseRelation relation) {
  constexpr const char* kUnits[] = {"frames", "m", "s", "deg", "rad"};
  const bool relative = which == SavedErrors::kRelative;
  const PairOptions& pairs = evaluation.options.pairs;
  std::string title = (relative ? "RPE w.r.t. " : "APE w.r.t. ") + RelationText(relation);
  if (relative) {
    title += "\nfor delta = " + internal::NumberText(pairs.delta) + " (" +
             kUnits[static_cast<std::size_t>(pairs.unit)] +
             (pairs.all ? ") using all pairs" : ") using consecutive pairs");
  }
  title += '\n' + AlignmentText(evaluation.options.alignment);
  if (internal::LimitsAlignment(evaluation.options)) {
    title += " (aligned poses: " + std::to_string(evaluation.options.align_poses) + ')';
  }
  return title;
}

std::string InfoJson(const Evaluation& evaluation, SavedErrors which, PoseRelation relation) {
  const std::string unit = UnitOf(relation);
  return internal::JsonText({{"title", Title(evaluation, which, relation)},
                             {"ref_name", evaluation.reference.name},
                             {"est_name", evaluation.label},
                             {"label", (which == SavedErrors::kRelative ? "RPE (" : "APE (") +
                                           (unit.empty() ? "unit-less" : unit) + ')'}});
}

std::string StatsJson(const ErrorStatistics& statistics) {
  internal::Json json;
  for (const auto& [name, member] : internal::kStatistics) json[name] = statistics.*member;
  return internal::JsonText(json);
}

/// When and where along the path the errors are: arrays as long as they.
void AddPlaces(const Evaluation& evaluation, const std::vector<int>& poses,
               std::vector<ZipEntry>& entries) {
  const Trajectory& estimate = evaluation.estimate;
  if (!estimate.has_timestamps()) return;
  const std::vector<double> reference_path =
      internal::Progress(evaluation.reference, DeltaUnit::kMetres);
  const std::vector<double> path = internal::Progress(estimate, DeltaUnit::kMetres);
  std::vector<double> times, seconds, along_reference, along;
  for (const int i : poses) {
    const auto at = static_cast<std::size_t>(i);
    times.push_back(Seconds(estimate.timestamps[at]));
    seconds.push_back(Seconds(estimate.timestamps[at] - estimate.timestamps.front()));
    along_reference.push_back(reference_path[at]);
    along.push_back(path[at]);
  }
  entries.push_back({"seconds_from_start.npy", Npy(seconds)});
  entries.push_back({"timestamps.npy", Npy(times)});
  entries.push_back({"distances_from_start.npy", Npy(along_reference)});
  entries.push_back({"distances.npy", Npy(along)});
}

std::string AlignmentNpy(const Similarity& alignment) {
  std::vector<double> matrix;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      matrix.push_back(alignment.scale * alignment.rotation(row, column));
    }
    matrix.push_back(alignment.translation[row]);
  }
  matrix.insert(matrix.end(), {0.0, 0.0, 0.0, 1.0});
  return Npy(matrix, 4);
}

/// Writes next to its place, and renames.
void WriteWhole(const fs::path& file, const std::string& content) {
  const fs::path partial = fs::path(file) += ".partial-" + std::to_string(::getpid());
  try {
    internal::OutputFile output(partial);
    output.Write(content);
    output.Close();
    std::error_code error;
    fs::rename(partial, file, error);
    if (error) internal::FailCreate(file.string(), error.value());
  } catch (...) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw;
  }
}

}  // namespace

void CheckEvoResult(const fs::path& zip, bool force) {
  std::error_code ignored;
  if (!fs::exists(zip, ignored)) return;
  const auto refuse = [&](const char* why, const char* remedy) {
    throw Error(ExitCode::kCannotCreate, ErrorLine({zip.string()}, {}, why, remedy));
  };
  if (!fs::is_regular_file(zip, ignored)) refuse("is not a regular file", "another name");
  if (!force) refuse("is there already", "--force, or another name");
  char magic[4] = {};
  std::ifstream(zip, std::ios::binary).read(magic, 4);
  if (std::string_view(magic, 4) != "PK\3\4") refuse("is not a zip", "another name");
}

void SaveEvoResult(const Evaluation& evaluation, SavedErrors which, const fs::path& zip,
                   bool force) {
  const bool relative = which == SavedErrors::kRelative;
  const std::vector<PoseErrors>& all = relative ? evaluation.relative : evaluation.absolute;
  if (all.empty()) {
    throw Error(ExitCode::kBadData, ErrorLine({evaluation.estimate.name}, {}, "no relative errors",
                                              "matched poses that are --delta apart"));
  }
  CheckEvoResult(zip, force);
  std::vector<int> poses;
  if (relative) {
    for (const auto& [i, j] : evaluation.pairs) poses.push_back(j);
  } else {
    for (int i = 0; i < evaluation.estimate.size(); ++i) poses.push_back(i);
  }
  const PoseErrors& errors = all.front();
  std::vector<ZipEntry> entries = {{"info.json", InfoJson(evaluation, which, errors.relation)},
                                   {"stats.json", StatsJson(errors.statistics)},
                                   {"error_array.npy", Npy(errors.errors)}};
  AddPlaces(evaluation, poses, entries);
  if (evaluation.options.alignment != Alignment::kNone) {
    entries.push_back({"alignment_transformation_sim3.npy", AlignmentNpy(evaluation.alignment)});
  }
  WriteWhole(zip, Zip(entries));
}

}  // namespace alidade
