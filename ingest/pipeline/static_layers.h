// SPDX-License-Identifier: Apache-2.0
// Everything that does not move, built up from depth frames: mesh, objects, places, structures,
// rooms, building.
// Refuses to know the store and the log; it calls the stages in their order.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/commit/graph_told.h"
#include "ingest/grid/distance_field.h"
#include "ingest/objects/carried_things.h"
#include "ingest/objects/object_tracker.h"
#include "ingest/objects/object_watch.h"
#include "ingest/objects/relations.h"
#include "ingest/objects/shapes/shape_fit.h"
#include "ingest/objects/small_objects.h"
#include "ingest/pipeline/layer_graph.h"
#include "ingest/pipeline/mapping_options.h"
#include "ingest/pipeline/stage_clock.h"
#include "ingest/places/place_tracker.h"
#include "ingest/rooms/find_rooms.h"
#include "ingest/rooms/structure.h"
#include "ingest/volume/semantic_volume.h"
#include "schema/model/layer.h"

namespace dsg::ingest {

/// The same frames and calls give the same layers.
///
/// Threads: one caller at a time.
/// Source: RSS 2020, sections III-A and IV; built while the log runs, where the paper builds the
/// upper layers at its end.
class StaticLayers {
 public:
  /// `labels`: classes of the log's label images, may be empty. Requires: valid options.
  StaticLayers(const MappingOptions& options, std::vector<SemanticLabel> labels,
               const NodeNumbering& numbering);

  /// Errors: of SemanticVolume::Integrate; nothing has changed then.
  absl::Status Integrate(const DepthFrame& frame);

  /// Makes the mesh anew where the volume has changed. Returns the blocks that changed, ascending.
  std::vector<BlockIndex> UpdateMesh(double block_size_m);

  /// Until the next call of UpdateMesh: all blocks, ascending by index, and one, nullptr without a
  /// surface.
  std::vector<const MeshBlock*> Mesh() const;
  const MeshBlock* FindBlock(const BlockIndex& index) const;

  /// Finds all layers above the mesh anew. Call UpdateMesh before.
  LayerGraph Update(TimeNs now_ns, bool is_last);

  /// The path that frames were seen from has moved: all that was found moves, by when it was seen.
  void Correct(const TrajectoryChange& change);

  /// The path has moved, and all frames will come once more: what they were fused into is empty
  /// until then (IntegrateAgain). Objects, places and rooms keep their names; an object that the
  /// new surface does not have was one that was mapped twice, and was never there.
  void BeginAgain();
  /// Errors: of SemanticVolume::Integrate; nothing has changed then.
  absl::Status IntegrateAgain(const DepthFrame& frame);

  /// CAD models that nodes refer to for the first time since the last call.
  std::vector<Asset> TakeAssets();

  /// Whether enough of the log has passed since the last Update.
  bool IsUpdateDue(TimeNs now_ns) const;

  /// Of SemanticVolume: once it is not OK, nothing that was found may be used.
  const absl::Status& status() const { return volume_.status(); }

  /// Heights of the floors found by the last Update, ascending.
  const std::vector<double>& floors_m() const { return floors_m_; }
  /// Whether nothing stood between a point and a place by the last Update; empty before it. May be
  /// called for as long as it is kept.
  std::function<bool(const Eigen::Vector3d& point_map, const Eigen::Vector3d& place_map)> Sight()
      const;

  /// Small things that were seen on their way in somebody's hand, by class of objects.
  std::vector<Carry> Carries() const;

  const NodeNumbering& numbering() const { return maker_.numbering(); }
  VolumeCounts counts() const { return volume_.counts(); }
  const StageClock& clock() const { return clock_; }

 private:
  /// Where a frame was seen from; so close together that the rest adds nothing.
  struct Viewpoint {
    TimeNs time_ns = 0;
    Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  };
  std::vector<Eigen::Vector3d> SeenFrom() const;
  DistanceField FindDistances(const std::vector<const MeshBlock*>& mesh,
                              const std::vector<double>& floors_m);
  void NoteCost(int64_t cell_count);
  void MoveObjects(const TrajectoryChange& change);
  void FindObjects(TimeNs now_ns, const std::vector<const MeshBlock*>& mesh);
  void KeepVacated();
  void KeepGone(const std::vector<TrackedObject>& before, const ObjectChanges& changes,
                TimeNs now_ns);
  void FitShapes(const std::vector<double>& floors_m, bool is_last);
  void TellAsset(int model);
  void FindPlacesOfObjects(const DistanceField& field, LayerParts* parts) const;
  std::vector<Storey> FindStoreys(const LayerParts& parts) const;
  void FindRoomsOf(const DistanceField& field, LayerParts* parts);
  void RelateStructures(LayerParts* parts) const;
  void ClassifyRooms(LayerParts* parts) const;

  MappingOptions options_;
  std::vector<SemanticLabel> labels_;
  StructureClasses classes_;
  ShapeFitter fitter_;
  LayerGraphMaker maker_;
  SemanticVolume volume_;
  std::map<BlockIndex, MeshBlock> mesh_;
  std::vector<Viewpoint> viewpoints_;
  ObjectTracker object_tracker_;
  /// Ascending.
  std::vector<int32_t> object_classes_;
  SmallObjects small_objects_;
  CarriedThings carried_things_;
  ObjectWatch object_watch_;
  CoVisibility together_;
  /// By object.
  std::map<int64_t, ShapeFit> fits_;
  std::vector<int64_t> unfitted_;
  std::vector<GoneObject> gone_;
  PlaceTracker place_tracker_;
  StructureTracker structure_tracker_;
  RoomTracker room_tracker_;
  std::vector<bool> is_asset_told_;
  std::vector<Asset> assets_;
  std::vector<double> floors_m_;
  std::shared_ptr<const DistanceField> field_;
  TimeNs updated_ns_ = kTimeMin;
  /// Log time that the next update should wait at least.
  TimeNs update_cost_ns_ = 0;
  TimeNs observed_together_ns_ = kTimeMin;
  StageClock clock_;
};

}  // namespace dsg::ingest
