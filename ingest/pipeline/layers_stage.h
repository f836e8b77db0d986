// SPDX-License-Identifier: Apache-2.0
// The static layers as a stage: frames are fused, and what changed is told.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/commit/graph_told.h"
#include "ingest/commit/map_view.h"
#include "ingest/commit/mesh_told.h"
#include "ingest/depth/frame_maker.h"
#include "ingest/log/log_source.h"
#include "ingest/pipeline/mapping_options.h"
#include "ingest/pipeline/stage.h"
#include "ingest/pipeline/static_layers.h"

namespace dsg::ingest {

/// Depth options of a log: classes of people, and the range of the volume.
MappingOptions WithClasses(MappingOptions options, const LogInfo& info);

/// Which ids a session's layers have in a map. Sessions number their nodes apart; one that was cut
/// off finds its number again on the building that it made. Errors: of MapView.
absl::StatusOr<NodeNumbering> NumberLayers(const MapView& map, const std::string& session_id);

class LayersStage : public Stage {
 public:
  /// `options`: of WithClasses. `is_on`: false for logs without depth, or if mapping is off.
  LayersStage(const LogInfo& info, const MappingOptions& options, const NodeNumbering& numbering,
              double mesh_block_size_m, bool is_on);

  absl::Status See(const DepthFrame& frame) override;
  void Close() override { is_closed_ = true; }
  /// Mesh blocks that changed and are due (MeshTold); every few seconds, and once the log is
  /// closed, all layers above found anew.
  void Tell(Findings* findings, GraphDelta* delta) override;
  void Correct(const TrajectoryChange& change) override { layers_.Correct(change); }
  /// StaticLayers::BeginAgain, and IntegrateAgain.
  void BeginAgain() { layers_.BeginAgain(); }
  absl::Status SeeAgain(const DepthFrame& frame) { return layers_.IntegrateAgain(frame); }
  void Summarize(IngestSummary* summary) const override;

  bool is_on() const { return is_on_; }
  /// Frames that are fused.
  int64_t frame_count() const { return layers_.counts().frame_count; }
  /// As they were told last.
  const LayerGraph& graph() const { return graph_; }
  /// Small things that were seen on their way in somebody's hand.
  std::vector<Carry> Carries() const { return layers_.Carries(); }

 private:
  void TellMesh(const Findings& findings, GraphDelta* delta);
  void TellLayers(Findings* findings, GraphDelta* delta);

  std::vector<SemanticLabel> labels_;
  double mesh_block_size_m_;
  bool is_on_;
  bool is_closed_ = false;
  bool is_begun_ = false;
  StaticLayers layers_;
  GraphTold told_;
  MeshTold mesh_told_;
  LayerGraph graph_;
};

}  // namespace dsg::ingest
