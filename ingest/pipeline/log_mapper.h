// SPDX-License-Identifier: Apache-2.0
// A sensor log's way into the static layers: frames are made, fused, and what changed is told.
// Refuses to commit; it hands out deltas.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/commit/map_view.h"
#include "ingest/commit/mesh_told.h"
#include "ingest/depth/frame_maker.h"
#include "ingest/log/log_source.h"
#include "ingest/pipeline/mapping_options.h"
#include "ingest/pipeline/static_layers.h"
#include "ingest/presence/region_index.h"

namespace dsg::ingest {

/// What became of a log's frames, for the user.
struct MappingSummary {
  /// A sentence about what was in the map already; empty when there is nothing to say.
  std::string note;
  VolumeCounts volume;
  SkipCounts skipped;
  std::map<std::string, StageClock::Time> stages;
};

/// Threads: one caller at a time.
class LogMapper {
 public:
  /// nullptr when the log has no depth, or mapping is off.
  ///
  /// Errors: of MappingOptions::Validate and MapView.
  static absl::StatusOr<std::unique_ptr<LogMapper>> Make(const LogInfo& info,
                                                         const MappingOptions& options,
                                                         const MapView& map,
                                                         const std::string& session_id);

  /// True when the mapper has a use for the channel.
  bool Uses(std::string_view channel) const;

  void AddPicture(ImageMeasurement image);
  void AddPose(const PoseMeasurement& pose);
  void AddDetection(const HumanDetection& detection);
  /// Called with each frame before it is fused.
  void SetFrameObserver(std::function<void(const DepthFrame&)> observer) {
    on_frame_ = std::move(observer);
  }
  /// No more will be added.
  void Close();

  /// Fuses the frames that are complete. Errors: of StaticLayers::Integrate.
  absl::Status Advance();

  const NodeNumbering& numbering() const { return layers_.numbering(); }
  bool IsUpdateDue(TimeNs now_ns) const { return layers_.IsUpdateDue(now_ns); }

  /// The layers above the mesh found anew, as a change of what was told before, and the rooms,
  /// places and their containment as they are now. Once a log is closed, this is its last word.
  struct LayerChange {
    GraphDelta delta;
    GraphDelta regions;
  };
  LayerChange TakeLayers(TimeNs now_ns);
  /// Mesh blocks that changed and are due (MeshTold); with `is_last` all that changed.
  GraphDelta TakeMesh(TimeNs now_ns, bool is_last);

  /// Of the last TakeLayers: heights of floors, the layers, the mesh, and whether nothing stands
  /// between a point and a place.
  const std::vector<double>& floors_m() const { return layers_.floors_m(); }
  const LayerGraph& graph() const { return graph_; }
  std::vector<const MeshBlock*> Mesh() const { return layers_.Mesh(); }
  RegionIndex::Sight Sight() const { return layers_.Sight(); }
  /// Small things that were seen on their way in somebody's hand.
  std::vector<Carry> Carries() const { return layers_.Carries(); }

  MappingSummary Summary();

 private:
  LogMapper(const LogInfo& info, const MappingOptions& options, const NodeNumbering& numbering,
            double mesh_block_size_m);

  std::vector<SemanticLabel> labels_;
  double mesh_block_size_m_;
  bool has_depth_camera_;
  bool has_lidar_;
  bool has_color_camera_;
  bool is_closed_ = false;
  bool is_begun_ = false;
  FrameMaker frames_;
  StaticLayers layers_;
  GraphTold told_;
  MeshTold mesh_told_;
  LayerGraph graph_;
  std::function<void(const DepthFrame&)> on_frame_;
};

}  // namespace dsg::ingest
