// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/pose_file.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/log_input.h"
#include "ingest/log/loop_file.h"
#include "ingest/log/pose_table.h"
#include "ingest/truth/truth.h"
#include "schema/base/status.h"

namespace dsg::evaluation {
namespace {

namespace fs = std::filesystem;

constexpr char kRobotName[] = "robot";
// Matrices printed with rounding that is worth a word.
constexpr double kDeviationNoted = 1e-3;

absl::StatusOr<PoseFile> ReadMatrices(const ingest::LogFile& file) {
  DSG_ASSIGN_OR_RETURN(const ingest::MatrixPoses matrices, ingest::ReadMatrixPoses(file));
  PoseFile out{.path = file.path, .has_times = false, .poses = {}, .notes = {}};
  for (const auto& row : matrices.rows) {
    out.poses.push_back({static_cast<TimeNs>(out.poses.size()), row.map_T_body, nullptr});
  }
  if (matrices.deviation_max > kDeviationNoted) {
    out.notes.push_back(absl::StrCat("rotations of ", file.path, " were off by up to ",
                                     matrices.deviation_max, " and were made orthonormal"));
  }
  return out;
}

absl::StatusOr<PoseFile> ReadTable(const ingest::LogFile& file, TimeNs epoch_ns) {
  DSG_ASSIGN_OR_RETURN(ingest::TrackTable table, ingest::ReadPoseTable(file, kRobotName));
  DSG_RETURN_IF_ERROR(ingest::CheckRows(table));
  ingest::LogOptions options;
  options.epoch_ns = epoch_ns;
  ingest::LogInfo info;
  DSG_RETURN_IF_ERROR(ingest::SetClock(options, &table, &info));
  const size_t row_count = table.rows.size();
  ingest::DropRepeats(/*is_strict=*/false, &table, &info.notes);
  DSG_RETURN_IF_ERROR(ingest::CheckOrder(table, "time"));
  PoseFile out{.path = file.path, .has_times = true, .poses = {}, .notes = {}};
  for (const ingest::TrackRow& row : table.rows) {
    out.poses.push_back({row.time_ns, row.map_T_agent, nullptr});
  }
  if (table.rows.size() < row_count) {
    out.notes.push_back(absl::StrCat(row_count - table.rows.size(), " of ", row_count, " rows of ",
                                     file.path,
                                     " repeat the stamp of the row before and do not count"));
  }
  return out;
}

absl::StatusOr<PoseFile> ReadSimulated(const std::string& folder) {
  DSG_ASSIGN_OR_RETURN(const truth::Truth truth, truth::ReadTruth(folder));
  PoseFile out{.path = folder, .has_times = true, .poses = {}, .notes = {}};
  for (const truth::RobotState& state : truth.robot) {
    out.poses.push_back({state.time_ns, state.map_T_body, nullptr});
  }
  return out;
}

absl::StatusOr<std::string> FileIn(const std::string& folder) {
  constexpr const char* kNames[] = {"state_groundtruth_estimate0/data.csv",
                                    "mav0/state_groundtruth_estimate0/data.csv", "data.csv",
                                    "groundtruth.txt"};
  for (const char* name : kNames) {
    const fs::path file = fs::path(folder) / name;
    if (ingest::IsFile(file)) return file.string();
  }
  return absl::NotFoundError(
      absl::StrCat(folder,
                   " holds no trajectory: neither state_groundtruth_estimate0/data.csv (also in "
                   "mav0), data.csv, groundtruth.txt nor the world.json of a simulated truth; "
                   "name the file"));
}

}  // namespace

bool IsSimulatedTruth(const std::string& path) {
  return ingest::IsFile(fs::path(path) / "world.json");
}

absl::StatusOr<PoseFile> ReadPoseFile(const std::string& path, TimeNs epoch_ns) {
  if (IsSimulatedTruth(path)) return ReadSimulated(path);
  std::string name = path;
  std::error_code error;
  if (fs::is_directory(path, error)) {
    DSG_ASSIGN_OR_RETURN(name, FileIn(path));
  }
  DSG_ASSIGN_OR_RETURN(const ingest::LogFile file, ingest::ReadInput(name));
  return ingest::HasMatrixRows(file) ? ReadMatrices(file) : ReadTable(file, epoch_ns);
}

absl::StatusOr<std::vector<FoundLoop>> ReadLoopFile(const std::string& path,
                                                    std::vector<std::string>* notes) {
  std::error_code error;
  // A detector that found nothing.
  if (fs::file_size(path, error) == 0 && !error) return std::vector<FoundLoop>();
  DSG_ASSIGN_OR_RETURN(const ingest::LogFile file, ingest::ReadInput(path));
  ingest::LoopLines reader;
  ingest::LineReader lines(file.bytes);
  ingest::TextLine line;
  std::vector<FoundLoop> loops;
  while (lines.Next(&line)) {
    DSG_ASSIGN_OR_RETURN(const ingest::LoopMeasurement loop,
                         reader.Read(ingest::LinePosition{file.path, line.number}, line.text));
    loops.push_back({loop.from_ns, loop.time_ns, loop.from_T_to, true});
  }
  reader.NoteKeys(notes);
  return loops;
}

}  // namespace dsg::evaluation
