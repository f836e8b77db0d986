// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/files/output_file.h"
#include "ingest/truth/truth_parts_internal.h"
#include "schema/base/status.h"

namespace dsg::truth {
namespace {

namespace fs = std::filesystem;
using ingest::OutputFile;

// The largest file, joints of 60 people over ten minutes, has half of it.
constexpr uintmax_t kFileBytesMax = uintmax_t{2} << 30;

constexpr char kWorldFile[] = "world.json";
constexpr char kRobotFile[] = "robot.csv";
constexpr char kHumansFile[] = "humans.csv";
constexpr char kDetectionsFile[] = "detections.csv";
constexpr char kMeshFile[] = "mesh.ply";
constexpr char kGridFile[] = "free_grid.png";

std::string PathOf(const std::string& folder, const char* name) {
  return (fs::path(folder) / name).string();
}

template <typename Row>
absl::Status WriteTable(const std::string& folder, const char* name, void (*header)(std::string*),
                        void (*append)(const Row&, std::string*), const std::vector<Row>& rows) {
  DSG_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(PathOf(folder, name)));
  header(&file.buffer());
  for (const Row& row : rows) {
    append(row, &file.buffer());
    DSG_RETURN_IF_ERROR(file.Flush());
  }
  return file.Commit();
}

absl::Status CannotRead(const std::string& path, const std::string& why) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat("cannot read ", path, ": ", why),
                   {{"path", path}});
}

absl::StatusOr<std::string> ReadWhole(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    return absl::NotFoundError(
        absl::StrCat(path, " is missing; give what dsg-simulate sensors --out has made"));
  }
  if (!fs::is_regular_file(path, error)) return CannotRead(path, "it is no regular file");
  const uintmax_t size = fs::file_size(path, error);
  if (error) return CannotRead(path, error.message());
  if (size > kFileBytesMax) {
    return CannotRead(path, absl::StrCat("it has ", size, " bytes; at most ", kFileBytesMax));
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (file == nullptr) return CannotRead(path, std::strerror(errno));
  std::string bytes(size, '\0');
  if (std::fread(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) {
    return CannotRead(path, "it ended early; is it still being written?");
  }
  return bytes;
}

absl::Status CheckCount(const std::string& path, uint64_t found, uint64_t promised) {
  if (found == promised) return absl::OkStatus();
  return Malformed(path, absl::StrCat("has ", found, " rows where ", kWorldFile, " promises ",
                                      promised, "; the file was cut, or is of another log"));
}

template <typename Read>
absl::Status ReadPart(const std::string& folder, const char* name, Read read, Truth* truth) {
  const std::string path = PathOf(folder, name);
  DSG_ASSIGN_OR_RETURN(const std::string bytes, ReadWhole(path));
  return read(bytes, path, truth);
}

absl::Status CheckCounts(const std::string& folder, const RowCounts& counts, const Truth& truth) {
  DSG_RETURN_IF_ERROR(CheckCount(PathOf(folder, kRobotFile), truth.robot.size(), counts.robot));
  DSG_RETURN_IF_ERROR(
      CheckCount(PathOf(folder, kHumansFile), truth.human_states.size(), counts.human_states));
  DSG_RETURN_IF_ERROR(
      CheckCount(PathOf(folder, kDetectionsFile), truth.detections.size(), counts.detections));
  const std::string mesh = PathOf(folder, kMeshFile);
  DSG_RETURN_IF_ERROR(CheckCount(mesh, truth.mesh.positions_map.size(), counts.vertices));
  return CheckCount(mesh, truth.mesh.faces.size(), counts.faces);
}

absl::Status ReadGrid(const std::string& folder, FreeGrid* grid) {
  if (grid->width == 0 || grid->height == 0) return absl::OkStatus();
  const std::string path = PathOf(folder, kGridFile);
  DSG_ASSIGN_OR_RETURN(const std::string bytes, ReadWhole(path));
  return GridFromPng(bytes, path, grid);
}

}  // namespace

absl::Status Malformed(const std::string& file, const std::string& what) {
  return MakeError(Reason::kFileMalformed, absl::StrCat(file, ": ", what), {{"path", file}});
}

absl::Status WriteTruth(const Truth& truth, const std::string& folder) {
  DSG_RETURN_IF_ERROR(CheckTruth(truth));
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("cannot make the folder ", folder, ": ", error.message()),
                     {{"path", folder}});
  }
  // An old world.json must not vouch for new tables.
  fs::remove(PathOf(folder, kWorldFile), error);
  DSG_RETURN_IF_ERROR(
      WriteTable(folder, kRobotFile, AppendRobotHeader, AppendRobotRow, truth.robot));
  DSG_RETURN_IF_ERROR(
      WriteTable(folder, kHumansFile, AppendHumanHeader, AppendHumanRow, truth.human_states));
  DSG_RETURN_IF_ERROR(WriteTable(folder, kDetectionsFile, AppendDetectionHeader, AppendDetectionRow,
                                 truth.detections));
  DSG_RETURN_IF_ERROR(
      ingest::WriteFile(PathOf(folder, kMeshFile), MeshToPly(truth.mesh, truth.face_observed)));
  if (!truth.free_grid.cells.empty()) {
    DSG_ASSIGN_OR_RETURN(std::string png, GridToPng(truth.free_grid));
    DSG_RETURN_IF_ERROR(ingest::WriteFile(PathOf(folder, kGridFile), std::move(png)));
  }
  return ingest::WriteFile(PathOf(folder, kWorldFile), TruthToJson(truth));
}

absl::StatusOr<Truth> ReadTruth(const std::string& folder) {
  Truth truth;
  RowCounts counts;
  const std::string world = PathOf(folder, kWorldFile);
  {
    DSG_ASSIGN_OR_RETURN(const std::string bytes, ReadWhole(world));
    DSG_RETURN_IF_ERROR(TruthFromJson(bytes, world, &truth, &counts));
  }
  DSG_RETURN_IF_ERROR(ReadPart(folder, kRobotFile, ReadRobotTable, &truth));
  DSG_RETURN_IF_ERROR(ReadPart(folder, kHumansFile, ReadHumanTable, &truth));
  DSG_RETURN_IF_ERROR(ReadPart(folder, kDetectionsFile, ReadDetectionTable, &truth));
  DSG_RETURN_IF_ERROR(ReadPart(folder, kMeshFile, MeshFromPly, &truth));
  DSG_RETURN_IF_ERROR(CheckCounts(folder, counts, truth));
  DSG_RETURN_IF_ERROR(ReadGrid(folder, &truth.free_grid));
  if (const absl::Status status = CheckTruth(truth); !status.ok()) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(world, ": ", std::string(status.message())), {{"path", world}});
  }
  return truth;
}

}  // namespace dsg::truth
