// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/followed_log.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/format.h"
#include "ingest/log/log_input.h"
#include "ingest/log/mcap_file.h"
#include "ingest/log/packed_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::Status CannotFollow(const std::string& path, const std::string& why) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat(path, ": ", why),
                   {{"field", "follow"}, {"value", path}});
}

absl::Status CheckPath(const std::string& path, const LogOptions& options) {
  if (path == kStandardInput) {
    return CannotFollow(path,
                        "standard input is read to its end before anything is committed, and "
                        "cannot be followed; write the log to a file and follow that");
  }
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return CannotFollow(path,
                        "is a folder; single files can be followed: tables of poses or tracks, "
                        "and MCAP files");
  }
  if (!options.label_folder.empty()) {
    return CannotFollow(path, "--labels go with RGB-D folders, which cannot be followed");
  }
  if (options.pose_file.empty()) return absl::OkStatus();
  return CannotFollow(path,
                      "--pose-file is read as a whole and does not go with --follow; take the log "
                      "with it when it is finished");
}

}  // namespace

absl::StatusOr<std::unique_ptr<LogSource>> OpenFollowed(const std::string& path,
                                                        const LogOptions& options) {
  DSG_RETURN_IF_ERROR(CheckPath(path, options));
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GrowingFile> file, GrowingFile::Open(path, *options.follow));
  DSG_RETURN_IF_ERROR(file->WaitBeyond(kMcapMagic.size() - 1).status());
  DSG_ASSIGN_OR_RETURN(const std::string begin, file->Read(0, 16));
  const bool is_mcap = begin.starts_with(kMcapMagic);
  if (IsPacked(begin)) {
    return CannotFollow(path,
                        "is packed, and what is packed comes out only when the packer has ended; "
                        "follow the file before it is packed");
  }
  if (!is_mcap && IsBagBegin(begin)) {
    return CannotFollow(path,
                        "is a bag of which the index comes last or changes; of bags only MCAP "
                        "files can be followed; take this one when it is finished");
  }
  if (options.format != "auto" && is_mcap != (options.format == "mcap")) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(path, is_mcap ? ": is mcap, not " : ": is no ", options.format,
                                  "; leave --format out"),
                     {{"file", path}});
  }
  if (is_mcap) return OpenFollowedBag(std::move(file), options);
  if (options.loop_file.empty()) return OpenFollowedTable(std::move(file), options);
  return CannotFollow(path, "a table takes no loop closures; they go with logs of sensors");
}

}  // namespace dsg::ingest
