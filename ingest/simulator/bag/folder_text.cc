// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/bag/folder_text.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/label_table.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

bool HasSome(const ingest::LogInfo& info, const std::string& channel) {
  const auto count = info.channel_counts.find(channel);
  return count != info.channel_counts.end() && count->second > 0;
}

}  // namespace

absl::StatusOr<FolderText> ReadFolderText(const std::string& log_folder,
                                          const ingest::LogInfo& info) {
  namespace fs = std::filesystem;
  FolderText text;
  std::error_code error;
  const std::string labels_path = (fs::path(log_folder) / "labels.csv").string();
  if (HasSome(info, "label0") || fs::exists(labels_path, error)) {
    DSG_ASSIGN_OR_RETURN(ingest::LogFile file, ingest::ReadLogFile(labels_path));
    DSG_ASSIGN_OR_RETURN(const ingest::LabelTable table, ingest::ReadLabelTable(file));
    text.colors = ColorsOf(table);
    text.labels = std::move(file.bytes);
  }
  const fs::path topology_path = fs::path(log_folder) / "mav0" / "detections0" / "topology.json";
  if (ingest::IsFile(topology_path)) {
    DSG_ASSIGN_OR_RETURN(ingest::LogFile file, ingest::ReadLogFile(topology_path.string()));
    text.body_topology = std::move(file.bytes);
  }
  const fs::path detections_path = fs::path(log_folder) / "mav0" / "detections0" / "data.jsonl";
  if (HasSome(info, "detections0") && !fs::exists(detections_path, error)) {
    return absl::NotFoundError(
        absl::StrCat(detections_path.string(), " does not exist, but the log has detections"));
  }
  DSG_ASSIGN_OR_RETURN(text.detections, DetectionLines::Open(detections_path.string()));
  return text;
}

}  // namespace dsg::simulator
