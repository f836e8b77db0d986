// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/log_mapper.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/map_things.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

bool IsRegion(const Node& node) {
  return node.layer == layers::kRooms || node.layer == layers::kPlaces;
}

// Sessions number their nodes apart. A session that was cut off finds its number again on the
// building that it made.
absl::StatusOr<NodeNumbering> Number(const MapView& map, const std::string& session_id) {
  NodeNumbering numbering{session_id, 0};
  for (const LayerId layer : {layers::kBuildings, layers::kRooms, layers::kPlaces,
                              layers::kStructures, layers::kObjects}) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Node> nodes, map.NodesOfLayer(layer));
    for (const Node& node : nodes) {
      const auto number = static_cast<int64_t>(node.id.index() / NodeNumbering::kPerSession);
      const auto session = node.attributes.find(kSessionAttribute);
      if (layer == layers::kBuildings && session != node.attributes.end() &&
          session->second == AttributeValue(session_id)) {
        numbering.session_number = number;
        return numbering;
      }
      numbering.session_number = std::max(numbering.session_number, number + 1);
    }
  }
  return numbering;
}

std::vector<SemanticLabel> LabelsOf(const LogInfo& info, bool has_label_images) {
  return has_label_images ? info.labels : std::vector<SemanticLabel>();
}

MappingOptions WithClasses(MappingOptions options, const std::vector<SemanticLabel>& labels) {
  if (options.depth.dynamic_classes.empty()) options.depth.dynamic_classes = DynamicClasses(labels);
  options.depth.range_m = options.volume.range_m;
  return options;
}

}  // namespace

absl::StatusOr<std::unique_ptr<LogMapper>> LogMapper::Make(const LogInfo& info,
                                                           const MappingOptions& options,
                                                           const MapView& map,
                                                           const std::string& session_id) {
  if (!options.is_on) return nullptr;
  DSG_RETURN_IF_ERROR(options.Validate());
  if (!info.channel_counts.contains("poses")) return nullptr;
  DSG_ASSIGN_OR_RETURN(const NodeNumbering numbering, Number(map, session_id));
  std::unique_ptr<LogMapper> mapper(
      new LogMapper(info, options, numbering, map.spec().mesh_block_size_m));
  if (!mapper->frames_.CanMakeFrames()) return nullptr;
  return mapper;
}

LogMapper::LogMapper(const LogInfo& info, const MappingOptions& options,
                     const NodeNumbering& numbering, double mesh_block_size_m)
    : labels_(LabelsOf(info, info.channel_counts.contains("label0"))),
      mesh_block_size_m_(mesh_block_size_m),
      has_depth_camera_(info.channel_counts.contains("depth0")),
      has_lidar_(info.rig.lidar.has_value()),
      has_color_camera_(info.channel_counts.contains("color0")),
      frames_(info.rig, WithClasses(options, labels_).depth),
      layers_(WithClasses(options, labels_), labels_, numbering),
      mesh_told_(options.mesh_wait_max_ns) {}

bool LogMapper::Uses(std::string_view channel) const {
  if (channel == "label0") return true;
  if (!has_depth_camera_ && has_lidar_) return channel == "lidar0";
  if (!has_depth_camera_) return channel == "cam0" || channel == "cam1" || channel == "color0";
  return channel == "depth0" || channel == "color0" || (channel == "cam0" && !has_color_camera_);
}

void LogMapper::AddPicture(ImageMeasurement image) {
  frames_.AddPicture(
      {image.time_ns, std::move(image.channel), std::move(image.origin), std::move(image.load)});
}

void LogMapper::AddPose(const PoseMeasurement& pose) {
  if (pose.agent_kind == kinds::kRobot) {
    frames_.AddPose(pose.pose.time_ns, pose.pose.map_T_agent);
  }
}

void LogMapper::AddDetection(const HumanDetection& detection) { frames_.AddDetection(detection); }

void LogMapper::Close() {
  is_closed_ = true;
  frames_.Finish();
}

absl::Status LogMapper::Advance() {
  while (true) {
    std::optional<DepthFrame> frame;
    {
      const StageClock::Span span(&layers_.clock(), "images");
      frame = frames_.Next();
    }
    if (!frame.has_value()) return absl::OkStatus();
    if (on_frame_) on_frame_(*frame);
    DSG_RETURN_IF_ERROR(layers_.Integrate(*frame));
  }
}

GraphDelta LogMapper::TakeMesh(TimeNs now_ns, bool is_last) {
  for (const BlockIndex& index : layers_.UpdateMesh(mesh_block_size_m_)) {
    mesh_told_.Note(index, layers_.FindBlock(index) != nullptr, now_ns);
  }
  MeshTold::Due due = mesh_told_.TakeDue(now_ns, is_last);
  GraphDelta delta;
  delta.mesh_removals = std::move(due.removed);
  for (const BlockIndex& index : due.written) {
    delta.mesh_blocks.push_back(*layers_.FindBlock(index));
  }
  return delta;
}

LogMapper::LayerChange LogMapper::TakeLayers(TimeNs now_ns) {
  LayerGraph graph = layers_.Update(now_ns, is_closed_);
  LayerChange change;
  bool has_levels = false;
  for (const Node& node : graph.nodes) {
    has_levels = has_levels || node.layer == kLevelLayer;
    if (IsRegion(node)) change.regions.nodes.push_back(node);
  }
  for (const Edge& edge : graph.edges) {
    if (edge.relation == relations::kContains) change.regions.edges.push_back(edge);
  }
  graph_ = graph;
  change.delta = told_.Tell(std::move(graph));
  change.delta.assets = layers_.TakeAssets();
  if (!is_begun_ && !change.delta.empty()) {
    is_begun_ = true;
    change.delta.labels = NamesOf(labels_);
  }
  if (has_levels) change.delta.layers.push_back(LevelLayer());
  return change;
}

MappingSummary LogMapper::Summary() {
  MappingSummary summary{"", layers_.counts(), frames_.skips(), layers_.clock().times()};
  const int64_t number = numbering().session_number;
  if (number > 0) {
    summary.note = absl::StrCat(
        "the map held layers of another log, or of this one with other options: this one's nodes "
        "stand beside them, numbered from ",
        number * static_cast<int64_t>(NodeNumbering::kPerSession),
        ", and its mesh takes the place of theirs where both have a block (earlier revisions keep "
        "it); name another --map to keep them apart");
  }
  return summary;
}

}  // namespace dsg::ingest
