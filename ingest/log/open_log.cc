// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "ingest/log/format.h"
#include "ingest/log/log_source.h"
#include "ingest/log/readers.h"
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
  if (options.frame_period_ns <= 0) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("frame period is ", options.frame_period_ns, " ns; give a positive duration"),
        {{"field", "frame_period_ns"}, {"value", absl::StrCat(options.frame_period_ns)}});
  }
  return absl::OkStatus();
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
  if (format == "obsmat") return ReadObsmat(file, options);
  if (format == "trajnet") return ReadTrajnet(file, options);
  if (format == "trajnet-ndjson") return ReadTrajnetNdjson(file, options);
  if (format == "thor") return ReadThor(file, options);
  if (format == "euroc") return ReadEuroc(file, options);
  if (format == "dsg-tracks") return ReadTracks(std::nullopt, file, options);
  return ReadSceneGraphLog(file, options);
}

OpenedLog OpenFolder(const std::string& folder, const LogOptions& options) {
  std::string format = options.format;
  if (format == "auto") {
    DSG_ASSIGN_OR_RETURN(format, DetectFolderFormat(folder));
  }
  if (format == "dsg-tracks") return OpenTracks(folder, options);
  const std::string euroc = format == "euroc" ? FindEurocFile(folder) : "";
  if (euroc.empty()) {
    return MakeError(
        Reason::kFileMalformed,
        absl::StrCat(folder, ": this folder is no ", format, " log; give the log file itself"),
        {{"file", folder}});
  }
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(euroc));
  return ReadEuroc(file, options);
}

}  // namespace

absl::StatusOr<std::unique_ptr<LogSource>> OpenLog(const std::string& path,
                                                   const LogOptions& options) {
  DSG_RETURN_IF_ERROR(CheckOptions(options));
  std::error_code error;
  if (fs::is_directory(path, error)) return OpenFolder(path, options);
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(path));
  std::string format = options.format;
  if (format == "auto") {
    DSG_ASSIGN_OR_RETURN(format, DetectFileFormat(file.bytes, path));
  }
  return OpenFile(file, format, options);
}

}  // namespace dsg::ingest
