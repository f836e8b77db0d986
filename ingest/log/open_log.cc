// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag_log.h"
#include "ingest/log/folder_log.h"
#include "ingest/log/followed_log.h"
#include "ingest/log/format.h"
#include "ingest/log/kitti_folder.h"
#include "ingest/log/log_input.h"
#include "ingest/log/log_source.h"
#include "ingest/log/readers.h"
#include "ingest/log/rgbd_layout.h"
#include "ingest/log/rgbd_log.h"
#include "ingest/log/text_rows.h"
#include "ingest/log/tum_folder.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

constexpr char kWorldFile[] = "map.json";
constexpr char kTracksFile[] = "tracks.csv";

absl::Status CheckOptions(const LogOptions& options) {
  const std::vector<std::string>& names = FormatNames();
  if (options.format != "auto" &&
      std::find(names.begin(), names.end(), options.format) == names.end()) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("format \"", options.format,
                                  "\" is unknown; use auto or one of: ", FormatList()),
                     {{"field", "format"}, {"value", options.format}});
  }
  const TimeNs period_ns = std::min(options.frame_period_ns, options.image_period_ns);
  if (period_ns <= 0) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("frame period is ", period_ns, " ns; give a positive duration"),
                     {{"field", "frame_period_ns"}, {"value", absl::StrCat(period_ns)}});
  }
  return absl::OkStatus();
}

// A log that has no topics, or no robot of its own, would leave these options out without a word.
absl::Status CheckSensorOptions(const std::string& path, const std::string& format,
                                const LogOptions& options) {
  if (IsBagFormat(format)) return absl::OkStatus();
  if (!options.topics.empty()) {
    const auto& [channel, topic] = *options.topics.begin();
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(path, ": a ", format, " log has no topics; leave --topic ",
                                  channel, "=", topic, " out"),
                     {{"field", "topic"}, {"value", absl::StrCat(channel, "=", topic)}});
  }
  constexpr std::string_view kFolders[] = {"euroc", "rgbd", "tum-rgbd", "kitti"};
  if (std::find(std::begin(kFolders), std::end(kFolders), format) != std::end(kFolders)) {
    return absl::OkStatus();
  }
  if (!options.loop_file.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(path, ": a ", format,
                                  " log takes no loop closures; they go with logs of sensors"),
                     {{"field", "loop_file"}, {"value", options.loop_file}});
  }
  if (options.pose_file.empty() && options.poses != PoseSource::kExternal) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(path, ": a ", format,
                                " log takes no external poses; they go with logs of sensors"),
                   {{"field", "poses"}, {"value", "external"}});
}

absl::Status CheckLabels(const std::string& path, const std::string& format,
                         const LogOptions& options) {
  if (options.label_folder.empty() || format == "rgbd" || format == "tum-rgbd") {
    return absl::OkStatus();
  }
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat(path, ": a ", format, " log takes no --labels; they go with RGB-D folders"),
      {{"field", "labels"}, {"value", options.label_folder}});
}

absl::Status NoSuchLog(const std::string& folder, const std::string& format) {
  return MakeError(
      Reason::kFileMalformed,
      absl::StrCat(folder, ": this folder is no ", format, " log; give the log file itself"),
      {{"file", folder}});
}

OpenedLog OpenTracks(const fs::path& folder, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(const LogFile tracks, ReadLogFile((folder / kTracksFile).string()));
  std::optional<LogFile> world;
  std::error_code error;
  if (fs::exists(folder / kWorldFile, error)) {
    DSG_ASSIGN_OR_RETURN(world, ReadLogFile((folder / kWorldFile).string()));
  }
  return ReadTracks(world, tracks, options);
}

OpenedLog OpenFile(const LogFile& file, const std::string& format, const LogOptions& options) {
  if (format == "thor") return ReadThor(file, options);
  if (format == "dsg-tracks") return ReadTracks(std::nullopt, file, options);
  if (format == "tesse-objects") return ReadTesseObjects(file, options);
  if (!IsRowFormat(format)) return ReadSceneGraphLog(file, options);
  DSG_ASSIGN_OR_RETURN(TextRows rows, ReadTextRows(format, file, options));
  return MakeTextLog(format, std::move(rows), file, options);
}

// A log that is read whole.
OpenedLog OpenInput(const std::string& path, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadInput(path));
  if (IsBagBegin(file.bytes)) {
    return MalformedFile(file.path,
                         "is a bag, of which single messages are read where they lie; unpack or "
                         "save it to a file and give that");
  }
  std::string format = options.format;
  if (format == "auto") {
    DSG_ASSIGN_OR_RETURN(format, DetectFileFormat(file.bytes, file.path));
  }
  DSG_RETURN_IF_ERROR(CheckSensorOptions(file.path, format, options));
  DSG_RETURN_IF_ERROR(CheckLabels(file.path, format, options));
  return OpenFile(file, format, options);
}

OpenedLog OpenEuroc(const std::string& folder, const LogOptions& options) {
  if (!FindSensorRoot(folder).empty()) return OpenSensorFolder(folder, options);
  const std::string path = FindEurocFile(folder);
  if (path.empty()) return NoSuchLog(folder, "euroc");
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(path));
  return OpenFile(file, "euroc", options);
}

OpenedLog OpenFolder(const std::string& folder, const LogOptions& options) {
  std::error_code error;
  if (fs::exists(fs::path(folder) / ".rendering", error) &&
      !fs::exists(fs::path(folder) / "log", error)) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(folder,
                                  ": the simulation of this log is not finished; run the "
                                  "same dsg-simulate command again, then give ",
                                  folder, "/log"),
                     {{"file", folder}});
  }
  std::string format = options.format;
  if (format == "auto") {
    DSG_ASSIGN_OR_RETURN(format, DetectFolderFormat(folder));
  }
  DSG_RETURN_IF_ERROR(CheckSensorOptions(folder, format, options));
  DSG_RETURN_IF_ERROR(CheckLabels(folder, format, options));
  if (format == "dsg-tracks") return OpenTracks(folder, options);
  if (format == "euroc") return OpenEuroc(folder, options);
  if (format == "rgbd" && FindRgbdLayout(folder) != RgbdLayout::kNone) {
    return OpenRgbdFolder(folder, options);
  }
  if (format == "tum-rgbd" && IsTumFolder(folder)) return OpenTumFolder(folder, options);
  if (format == "kitti" && IsKittiFolder(folder)) return OpenKittiFolder(folder, options);
  if (format == "rosbag2") return OpenBag(folder, options);
  return NoSuchLog(folder, format);
}

}  // namespace

absl::StatusOr<std::unique_ptr<LogSource>> OpenLog(const std::string& path,
                                                   const LogOptions& options) {
  DSG_RETURN_IF_ERROR(CheckOptions(options));
  if (options.follow.has_value()) return OpenFollowed(path, options);
  if (path == kStandardInput) return OpenInput(path, options);
  std::error_code error;
  if (fs::is_directory(path, error)) return OpenFolder(path, options);
  // Bags may be larger than the memory.
  DSG_ASSIGN_OR_RETURN(const std::string bag_format, DetectBagFormat(path));
  const bool wants_bag = IsBagFormat(options.format);
  if (fs::is_regular_file(path, error) && options.format != "auto" &&
      (wants_bag || !bag_format.empty()) && bag_format != options.format) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(path, bag_format.empty() ? ": is no " : ": is ",
                                  bag_format.empty() ? options.format : bag_format,
                                  bag_format.empty() ? "" : ", not ",
                                  bag_format.empty() ? "" : options.format, "; leave --format out"),
                     {{"file", path}});
  }
  constexpr std::string_view kFolders[] = {"rgbd", "tum-rgbd", "kitti"};
  if (std::find(std::begin(kFolders), std::end(kFolders), options.format) != std::end(kFolders)) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(path, ": a ", options.format,
                                  " log is a folder, and this is a file; give the folder"),
                     {{"file", path}});
  }
  if (!bag_format.empty()) {
    DSG_RETURN_IF_ERROR(CheckLabels(path, bag_format, options));
    return OpenBag(path, options);
  }
  return OpenInput(path, options);
}

}  // namespace dsg::ingest
