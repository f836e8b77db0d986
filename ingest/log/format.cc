// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/format.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/bag_folder.h"
#include "ingest/log/db3_file.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/folder_log.h"
#include "ingest/log/kitti_folder.h"
#include "ingest/log/mcap_file.h"
#include "ingest/log/readers.h"
#include "ingest/log/rgbd_layout.h"
#include "ingest/log/text_table.h"
#include "ingest/log/tum_folder.h"
#include "schema/base/status.h"
#include "schema/interop/scene_graph_file.h"

namespace dsg::ingest {
namespace {

// A header or a first row is far shorter; what is longer is no table.
constexpr size_t kFirstLineMax = 65536;

bool BeginsWithNumber(std::string_view field) {
  double value = 0.0;
  if (field.starts_with('+')) field.remove_prefix(1);
  return std::from_chars(field.data(), field.data() + field.size(), value).ec == std::errc();
}

std::string WithoutBlanks(std::string_view text) {
  std::string compact;
  for (const char c : text.substr(0, 256)) {
    if (c != ' ' && c != '\t' && c != '\r' && c != '\n') compact += c;
  }
  return compact;
}

bool Has(const std::vector<std::string_view>& fields, std::string_view name) {
  for (const std::string_view field : fields) {
    if (field == name) return true;
  }
  return false;
}

// A name and seven numbers, perhaps with a comment.
bool IsObjectRow(const std::vector<std::string_view>& fields) {
  if (fields[0] == "#name" && fields.size() == 9) return true;
  if ((fields.size() != 8 && fields.size() != 9) || BeginsWithNumber(fields[0])) return false;
  return std::all_of(fields.begin() + 1, fields.begin() + 8, BeginsWithNumber);
}

// Empty when the first line belongs to no format.
std::string FormatOfCommaTable(const std::vector<std::string_view>& fields) {
  if (fields[0].starts_with("#timestamp") && fields.size() >= 8) return "euroc";
  if (Has(fields, "ag_id") && Has(fields, "Time") && Has(fields, "tracklet_id")) return "thor";
  if (Has(fields, "time_ns") && Has(fields, "agent")) return "dsg-tracks";
  if (IsObjectRow(fields)) return "tesse-objects";
  int64_t stamp = 0;
  const bool has_stamp =
      std::from_chars(fields[0].data(), fields[0].data() + fields[0].size(), stamp).ec ==
      std::errc();
  if (has_stamp && (fields.size() == 8 || fields.size() == 17)) return "euroc";
  return "";
}

bool IsWhole(std::string_view field) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  return error == std::errc() && end == field.data() + field.size() && value == std::floor(value);
}

// Both have eight numbers between blanks. Frames and persons of obsmat are whole numbers, which
// seconds and metres are only by chance, not ten times in a row, and no frame counts as far as
// Unix time; and TUM files often begin with a remark, obsmat has none.
std::string FormatOfEightColumns(std::string_view bytes, bool has_remark) {
  if (has_remark) return "tum";
  constexpr int kRowsMax = 10;
  constexpr double kUnixTimeMin = 1e9;
  LineReader lines(bytes);
  TextLine line;
  std::vector<std::string_view> fields;
  for (int i = 0; i < kRowsMax && lines.Next(&line); ++i) {
    SplitAtBlanks(line.text, &fields);
    // The last line may be cut off here.
    if (fields.size() < 2) break;
    double first = 0.0;
    std::from_chars(fields[0].data(), fields[0].data() + fields[0].size(), first);
    if (!IsWhole(fields[0]) || first >= kUnixTimeMin) return "tum";
    if (!IsWhole(fields[1]) && line.has_line_end) return "tum";
  }
  return "obsmat";
}

std::string FormatOfBytes(std::string_view bytes) {
  // Before the scene graphs, which are JSON objects too.
  const std::string begin = WithoutBlanks(bytes);
  if (begin.starts_with("{\"scene\":") || begin.starts_with("{\"track\":")) {
    return "trajnet-ndjson";
  }
  if (LooksLikeSceneGraph(bytes)) return "spark-dsg";
  LineReader lines(bytes.substr(0, kFirstLineMax));
  TextLine line;
  if (!lines.Next(&line)) return "";
  // A remark above the header; no header of ours begins so.
  if (line.text.starts_with("#NOTE") && !lines.Next(&line)) return "";
  std::vector<std::string_view> fields;
  SplitAtCommas(line.text, &fields);
  if (fields.size() > 1) {
    const std::string format = FormatOfCommaTable(fields);
    // EuRoC calls its positions "p_RS_R_x [m]".
    const bool has_other_names = !fields[1].starts_with("p_") && IsCsvHeader(line.text);
    if (format == "euroc" && has_other_names) return "csv";
    if (!format.empty()) return format;
  }
  if (IsCsvHeader(line.text)) return "csv";
  const bool has_remark = line.text.starts_with('#');
  while (line.text.starts_with('#')) {
    if (!lines.Next(&line)) return "";
  }
  SplitAtBlanks(line.text, &fields);
  if (!BeginsWithNumber(fields[0])) return "";
  if (fields.size() == 8) return FormatOfEightColumns(bytes.substr(0, kFirstLineMax), has_remark);
  if (has_remark) return "";
  if (fields.size() == 4) return "trajnet";
  return "";
}

// Rows of twelve numbers: 3x4 matrices, as KITTI's poses are.
bool HasMatrices(std::string_view bytes) {
  LineReader lines(bytes.substr(0, kFirstLineMax));
  TextLine line;
  std::vector<std::string_view> fields;
  if (!lines.Next(&line)) return false;
  SplitAtBlanks(line.text, &fields);
  return fields.size() == 12 && std::all_of(fields.begin(), fields.end(), BeginsWithNumber);
}

absl::Status Unknown(const std::string& path, std::string_view what) {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(path, ": ", std::string(what),
                                "; name the format with --format: ", FormatList()),
                   {{"file", path}, {"formats", FormatList()}});
}

bool IsEurocTable(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string begin(4096, '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(in.gcount()));
  // An IMU's data.csv has seven columns.
  return FormatOfBytes(begin) == "euroc";
}

}  // namespace

const std::vector<std::string>& FormatNames() {
  static const auto* const names =
      new std::vector<std::string>{"obsmat",      "trajnet",     "trajnet-ndjson",
                                   "thor",        "euroc",       "spark-dsg",
                                   "kimera-json", "region-json", "dsg-tracks",
                                   "rgbd",        "rosbag",      "tesse-objects",
                                   "tum",         "tum-rgbd",    "csv",
                                   "mcap",        "rosbag2",     "kitti"};
  return *names;
}

std::string FormatList() { return absl::StrJoin(FormatNames(), ", "); }

absl::StatusOr<std::string> DetectFileFormat(std::string_view bytes, const std::string& path) {
  std::string format = FormatOfBytes(bytes);
  if (!format.empty()) return format;
  if (HasMatrices(bytes)) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(path,
                                  ": its rows are matrices without times, as KITTI's poses are; "
                                  "give the folder that has times.txt and the scans besides, or "
                                  "make a TUM file of it (time, position, quaternion x y z w)"),
                     {{"file", path}});
  }
  return Unknown(path, "its first line belongs to no known log format");
}

std::string FindEurocFile(const std::string& folder) {
  const std::filesystem::path root(folder);
  const std::filesystem::path file =
      std::filesystem::path("state_groundtruth_estimate0") / "data.csv";
  for (const std::filesystem::path& candidate : {root / "mav0" / file, root / file}) {
    if (IsFile(candidate)) return candidate.string();
  }
  if (IsFile(root / "data.csv") && IsEurocTable(root / "data.csv")) {
    return (root / "data.csv").string();
  }
  return "";
}

bool IsBagFormat(std::string_view format) {
  return format == "rosbag" || format == "mcap" || format == "rosbag2";
}

bool IsBagBegin(std::string_view bytes) {
  return bytes.starts_with(kMcapMagic) || bytes.starts_with(kSqliteMagic) ||
         bytes.starts_with("#ROSBAG") || bytes.starts_with("#ROSRECORD");
}

absl::StatusOr<std::string> DetectBagFormat(const std::string& path) {
  // Opening a pipe would wait for its other end.
  if (!IsFile(path)) return "";
  std::ifstream in(path, std::ios::binary);
  std::string begin(16, '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(in.gcount()));
  if (begin.starts_with(kMcapMagic)) return "mcap";
  if (begin.starts_with(kSqliteMagic)) return "rosbag2";
  if (begin.starts_with("#ROSBAG V2.0")) return "rosbag";
  if (!IsBagBegin(begin)) return "";
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(path, ": is a bag of an old version; run \"rosbag fix\" on it"),
                   {{"file", path}});
}

absl::StatusOr<std::string> DetectFolderFormat(const std::string& folder) {
  const std::filesystem::path root(folder);
  if (IsFile(root / "tracks.csv")) return "dsg-tracks";
  if (!FindSensorRoot(folder).empty() || !FindEurocFile(folder).empty()) return "euroc";
  if (IsBagFolder(folder)) return "rosbag2";
  if (FindRgbdLayout(folder) != RgbdLayout::kNone) return "rgbd";
  if (IsTumFolder(folder)) return "tum-rgbd";
  if (IsKittiFolder(folder)) return "kitti";
  if (!FindSensorRoot((root / "log").string()).empty()) {
    return Unknown(folder,
                   absl::StrCat("holds a simulation; give its log: ", (root / "log").string()));
  }
  return Unknown(folder,
                 "holds neither tracks.csv (dsg-tracks) nor mav0/ with sensors or "
                 "mav0/state_groundtruth_estimate0/data.csv (euroc), nor frames of a known RGB-D "
                 "dataset (rgbd, tum-rgbd), nor scans in velodyne/ (kitti), nor a bag of ROS 2 "
                 "(rosbag2); give the log file itself");
}

}  // namespace dsg::ingest
