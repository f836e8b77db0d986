// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export_geojson.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "dsg/v1/graph.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/answer_text.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/model/known_names.h"

namespace dsg::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string Dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

class GeoJsonWriter {
 public:
  GeoJsonWriter(const MapRows& map, const GeoOrigin& origin, AtomicFile* file)
      : map_(map), origin_(origin), file_(*file) {}

  absl::Status Write() {
    DSG_RETURN_IF_ERROR(file_.Write("{\"type\":\"FeatureCollection\",\"features\":[\n"));
    DSG_RETURN_IF_ERROR(map_.Nodes([this](const v1::Node& node) { return WriteNode(node); }));
    DSG_ASSIGN_OR_RETURN(const std::vector<AgentRow> agents, map_.Agents());
    for (const AgentRow& agent : agents) DSG_RETURN_IF_ERROR(WriteTrack(agent));
    return file_.Write("\n]}\n");
  }

  int64_t node_count() const { return node_count_; }
  int64_t line_count() const { return line_count_; }

 private:
  // Nine decimals of a degree are a tenth of a millimetre.
  std::string Position(const Eigen::Vector3d& point_map) const {
    const Eigen::Vector3d wgs84 = ToWgs84(origin_, point_map);
    return absl::StrFormat("%.9f,%.9f,%.4f", wgs84.x(), wgs84.y(), wgs84.z());
  }

  std::string Geometry(const v1::Node& node) const {
    const Eigen::Vector3d middle_map = PointOf(node.map_t_node().position());
    // The box of a place is the free space around it.
    Polygon2d outline = node.kind() == kinds::kPlace ? Polygon2d() : OutlineOf(node);
    if (outline.size() < 3 || SignedArea(outline) == 0.0) {
      return absl::StrCat("{\"type\":\"Point\",\"coordinates\":[", Position(middle_map), "]}");
    }
    // RFC 7946: rings are closed and counter-clockwise.
    if (SignedArea(outline) < 0.0) std::reverse(outline.begin(), outline.end());
    outline.push_back(outline.front());
    const double height_m = node.has_region() ? node.region().z_min_m() : middle_map.z();
    std::string ring;
    for (const Eigen::Vector2d& corner : outline) {
      absl::StrAppend(&ring, ring.empty() ? "[" : ",[",
                      Position({corner.x(), corner.y(), height_m}), "]");
    }
    return absl::StrCat("{\"type\":\"Polygon\",\"coordinates\":[[", ring, "]]}");
  }

  // What a feature begins with, behind a comma if it is not the first.
  std::string Begin(const std::string& id) {
    const char* separator = std::exchange(has_features_, true) ? ",\n" : "";
    return absl::StrCat(separator, "{\"type\":\"Feature\",\"id\":", Dump(id), ",\"geometry\":");
  }

  absl::Status WriteNode(const v1::Node& node) {
    const bool is_shown = node.kind() == kinds::kRoom || node.kind() == kinds::kObject ||
                          node.kind() == kinds::kPlace;
    const bool has_ended = !map_.at_ns().has_value() && node.has_valid_to_ns();
    if (!is_shown || has_ended || !node.has_map_t_node()) return absl::OkStatus();
    ++node_count_;
    const Json properties = {{"id", node.id()},
                             {"kind", node.kind()},
                             {"layer", node.layer()},
                             {"name", node.name()},
                             {"class", node.semantic_class().name()},
                             {"height_m", node.map_t_node().position().z()}};
    return file_.Write(
        absl::StrCat(Begin(node.id()), Geometry(node), ",\"properties\":", Dump(properties), "}"));
  }

  // A line is written while its poses arrive; a stretch of one pose is a point.
  absl::Status WriteTrack(const AgentRow& agent) {
    Stretch stretch;
    DSG_RETURN_IF_ERROR(map_.Poses(agent.id, [&](const v1::TimedPose& pose) {
      if (stretch.pose_count > 0 && pose.time_ns() - stretch.last_ns > agent.gap_ns_max) {
        DSG_RETURN_IF_ERROR(EndStretch(agent, &stretch));
      }
      return Extend(agent, pose, &stretch);
    }));
    return EndStretch(agent, &stretch);
  }

  struct Stretch {
    int64_t pose_count = 0;
    TimeNs first_ns = 0;
    TimeNs last_ns = 0;
    /// The first position, until there is a second one.
    std::string first;
  };

  absl::Status Extend(const AgentRow& agent, const v1::TimedPose& pose, Stretch* stretch) {
    std::string position = absl::StrCat("[", Position(PointOf(pose.pose().position())), ",",
                                        SecondsText(pose.time_ns()), "]");
    stretch->last_ns = pose.time_ns();
    if (++stretch->pose_count == 1) {
      stretch->first_ns = pose.time_ns();
      stretch->first = std::move(position);
      return absl::OkStatus();
    }
    if (stretch->pose_count > 2) return file_.Write(absl::StrCat(",", position));
    return file_.Write(absl::StrCat(Begin(TrackId(agent)),
                                    "{\"type\":\"LineString\",\"coordinates\":[", stretch->first,
                                    ",", position));
  }

  absl::Status EndStretch(const AgentRow& agent, Stretch* stretch) {
    if (stretch->pose_count == 0) return absl::OkStatus();
    const std::string id = TrackId(agent);
    ++line_count_;
    const Stretch done = std::exchange(*stretch, Stretch());
    const Json properties = {{"id", agent.id},
                             {"kind", agent.kind},
                             {"name", agent.name},
                             {"poses", done.pose_count},
                             {"from_ns", std::to_string(done.first_ns)},
                             {"to_ns", std::to_string(done.last_ns)}};
    const std::string end = absl::StrCat("},\"properties\":", Dump(properties), "}");
    if (done.pose_count > 1) return file_.Write(absl::StrCat("]", end));
    return file_.Write(
        absl::StrCat(Begin(id), "{\"type\":\"Point\",\"coordinates\":", done.first, end));
  }

  // An agent has several features; ids of features differ.
  std::string TrackId(const AgentRow& agent) const {
    return absl::StrCat(agent.id, "/", line_count_);
  }

  const MapRows& map_;
  const GeoOrigin origin_;
  AtomicFile& file_;
  bool has_features_ = false;
  int64_t node_count_ = 0;
  int64_t line_count_ = 0;
};

}  // namespace

absl::StatusOr<Written> WriteGeoJson(const MapRows& map, const GeoOrigin& origin,
                                     const std::string& path, bool force) {
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, force));
  GeoJsonWriter writer(map, origin, &file);
  DSG_RETURN_IF_ERROR(writer.Write());
  DSG_RETURN_IF_ERROR(file.Commit());
  return Written{.format = "geojson",
                 .path = path,
                 .byte_count = file.byte_count(),
                 .counts = {{"nodes", writer.node_count()}, {"lines", writer.line_count()}}};
}

}  // namespace dsg::cli
