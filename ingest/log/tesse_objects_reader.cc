// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>

#include "absl/strings/str_cat.h"
#include "ingest/log/label_table.h"
#include "ingest/log/readers.h"
#include "ingest/log/text_table.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

// Unity's axes are right, up, forward and left-handed; ours are forward, left, up. The world keeps
// its x, so an object that looks along Unity's z looks along our y: a quarter turn about z.
Pose3d FromUnity(const Pose3d& unity) {
  const Eigen::Quaterniond& q = unity.orientation;
  const Eigen::Quaterniond swapped(q.w(), -q.x(), -q.z(), -q.y());
  const Eigen::Quaterniond quarter(M_SQRT1_2, 0.0, 0.0, M_SQRT1_2);
  return {{unity.position.x(), unity.position.z(), unity.position.y()},
          (swapped * quarter).normalized()};
}

// "Chair (12)" is a copy of "Chair".
std::string WithoutCopyNumber(const std::string& name) {
  const size_t open = name.rfind(" (");
  if (open == std::string::npos || !name.ends_with(')')) return name;
  return name.substr(0, open);
}

absl::StatusOr<Node> ReadObjectRow(const LinePosition& at,
                                   const std::vector<std::string_view>& fields, uint64_t index) {
  Node node;
  node.id = NodeId('O', index);
  node.layer = *LayerOfKind(kinds::kObject);
  node.kind = kinds::kObject;
  node.name = std::string(fields[0]);
  if (node.name.empty() || node.name.size() > 1024 || !IsUtf8(node.name)) {
    return at.FieldError("name", fields[0], "a name in UTF-8 of at most 1024 bytes is due");
  }
  constexpr std::string_view kNames[] = {"x", "y", "z", "qx", "qy", "qz", "qw"};
  double values[7] = {};
  for (size_t i = 0; i < 7; ++i) {
    DSG_ASSIGN_OR_RETURN(values[i], i < 3 ? ParseCoordinate(at, kNames[i], fields[1 + i])
                                          : ParseNumber(at, kNames[i], fields[1 + i]));
  }
  node.map_T_node.position = {values[0], values[1], values[2]};
  DSG_ASSIGN_OR_RETURN(node.map_T_node.orientation,
                       Normalize(at, {values[6], values[3], values[4], values[5]}));
  node.provenance = Provenance::kImported;
  node.object.emplace();
  return node;
}

// The table of classes beside the objects, by the names that uHumans2 gave both; empty if none.
std::string FindLabels(const std::string& path) {
  const fs::path file(path);
  const std::string stem = file.stem().string();
  std::vector<std::string> scenes;
  if (const size_t at = stem.find("_static_tfs"); at != std::string::npos) {
    scenes.push_back(stem.substr(0, at));
  }
  const std::pair<const char*, const char*> kScenes[] = {
      {"apartment_", "archviz1"}, {"office_", "office1"}, {"neighborhood_", "neighborhood1"}};
  for (const auto& [prefix, scene] : kScenes) {
    if (stem.starts_with(prefix)) scenes.push_back(absl::StrCat("tesse_multiscene_", scene));
  }
  std::error_code error;
  for (const std::string& scene : scenes) {
    const fs::path labels = file.parent_path() / (scene + "_segmentation_mapping.csv");
    if (fs::is_regular_file(labels, error)) return labels.string();
  }
  return "";
}

absl::Status AddClasses(const std::string& path, GraphDelta* delta, std::string* identity,
                        LogInfo* info) {
  const std::string labels = FindLabels(path);
  if (labels.empty()) {
    info->notes.push_back("no ..._segmentation_mapping.csv beside the objects: they have no class");
    return absl::OkStatus();
  }
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(labels));
  DSG_ASSIGN_OR_RETURN(const LabelTable table, ReadLabelTable(file));
  absl::StrAppend(identity, Sha256Hex(file.bytes));
  std::map<std::string, int32_t> class_of_name;
  for (const LabelRow& row : table.rows) class_of_name[row.name] = row.class_id;
  int64_t known_count = 0;
  for (Node& node : delta->nodes) {
    auto found = class_of_name.find(node.name);
    if (found == class_of_name.end()) found = class_of_name.find(WithoutCopyNumber(node.name));
    if (found == class_of_name.end()) continue;
    node.class_id = found->second;
    // Many names share a class; the table names none of the classes themselves.
    node.class_name = absl::StrCat("class ", found->second);
    ++known_count;
  }
  info->notes.push_back(absl::StrCat("classes by name from ", file.name, ": ", known_count, " of ",
                                     delta->nodes.size(), " objects"));
  return absl::OkStatus();
}

}  // namespace

OpenedLog ReadTesseObjects(const LogFile& file, const LogOptions&) {
  GraphDelta delta;
  LineReader lines(file.bytes);
  TextLine line;
  std::vector<std::string_view> fields;
  bool is_unity = false;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) {
      // Only the tables in Unity's own frame have comments.
      is_unity = true;
      continue;
    }
    const LinePosition at{file.path, line.number};
    SplitAtCommas(line.text, &fields);
    DSG_RETURN_IF_ERROR(
        CheckFieldCount(at, line, fields.size(), is_unity ? 9 : 8,
                        is_unity ? "name,x,y,z,qx,qy,qz,qw,comment" : "name,x,y,z,qx,qy,qz,qw"));
    DSG_ASSIGN_OR_RETURN(Node node, ReadObjectRow(at, fields, delta.nodes.size()));
    if (is_unity) node.map_T_node = FromUnity(node.map_T_node);
    delta.nodes.push_back(std::move(node));
  }
  if (delta.nodes.empty()) return LinePosition{file.path, 1}.Error("the table holds no object");
  LogInfo info = DescribeTextLog("tesse-objects", file);
  info.channel_counts["objects"] = static_cast<int64_t>(delta.nodes.size());
  if (is_unity) info.notes.push_back("poses are turned from Unity's axes to z up");
  info.notes.push_back(
      "the table lists all objects of a scene, the robot's own sensors among them; repeated names "
      "are objects of their own");
  std::string identity = info.content_sha256;
  DSG_RETURN_IF_ERROR(AddClasses(file.path, &delta, &identity, &info));
  info.content_sha256 = Sha256Hex(identity);
  TrackTable no_tracks;
  no_tracks.file = file.path;
  return MakeTrackLog(std::move(no_tracks), GraphMeasurement{std::move(delta)}, std::move(info));
}

}  // namespace dsg::ingest
