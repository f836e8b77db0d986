// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/obstacles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "query/prediction/velocity.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// LiesOn finds triangles this far from a structure's box.
constexpr double kStructureReachM = 0.1;

Box3d Grown(const Box3d& box, double by_m) {
  return Box3d(box.min().array() - by_m, box.max().array() + by_m);
}

int32_t CellOf(double metres, double size_m) {
  return static_cast<int32_t>(std::clamp(std::floor(metres / size_m), -2147483000.0, 2147483000.0));
}

bool HasInstance(const MeshPiece& piece, uint32_t instance) {
  return instance != 0 && std::find(piece.instances.begin(), piece.instances.end(), instance) !=
                              piece.instances.end();
}

bool HasTriangleOn(const MeshPiece& piece, const StructureFacts& structure) {
  if (HasInstance(piece, structure.instance_id)) return true;
  bool found = false;
  double reach_m = kStructureReachM;
  piece.tree.ForEachNear(structure.box_map, &reach_m, [&](int face) {
    if (found || !LiesOn(structure, piece.tree.Triangle(face), piece.label(face))) return;
    found = true;
    reach_m = kEndWalk;
  });
  return found;
}

}  // namespace

void Obstacles::Clear() {
  solids.clear();
  pieces.clear();
  structures.clear();
  left_out.clear();
}

ObstacleFinder::ObstacleFinder(std::shared_ptr<const GraphView> view,
                               std::shared_ptr<const Snapshot> snapshot,
                               std::optional<TimeNs> at_ns, CollisionCache* cache)
    : view_(std::move(view)),
      snapshot_(std::move(snapshot)),
      at_ns_(at_ns),
      cache_(cache),
      facts_(cache->FactsOf(view_)) {}

absl::Status ObstacleFinder::Find(const Box3d& region, const CollisionScope& scope,
                                  const StopCheck& stop, Obstacles* found) {
  found->Clear();
  if (scope.mesh || scope.objects || scope.structures) {
    DSG_RETURN_IF_ERROR(AddPieces(region, stop, &found->pieces));
    const bool owned = std::any_of(found->pieces.begin(), found->pieces.end(),
                                   [](const auto& piece) { return !piece->instances.empty(); });
    if (owned && found->owners == nullptr) {
      DSG_ASSIGN_OR_RETURN(found->owners, facts_->Owners(*snapshot_, stop));
    }
    DSG_RETURN_IF_ERROR(AddStructures(region, scope, stop, found));
  }
  if (scope.objects) DSG_RETURN_IF_ERROR(AddObjects(region, scope, stop, found));
  return AddAgents(region, scope, stop, found);
}

absl::Status ObstacleFinder::AddPieces(const Box3d& region, const StopCheck& stop,
                                       std::vector<std::shared_ptr<const MeshPiece>>* pieces) {
  DSG_ASSIGN_OR_RETURN(const auto blocks, cache_->Blocks(facts_.get(), *snapshot_, stop));
  for (const BlockBounds* block : blocks->Touching(region)) {
    if (stop) DSG_RETURN_IF_ERROR(stop());
    DSG_ASSIGN_OR_RETURN(std::shared_ptr<const MeshPiece> piece,
                         cache_->Piece(*facts_, *snapshot_, block->block, block->written));
    pieces->push_back(std::move(piece));
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> ObstacleFinder::StructureHasTriangles(const StructureFacts& structure,
                                                           const StopCheck& stop) {
  return facts_->HasTriangles(structure.id, [&]() -> absl::StatusOr<bool> {
    DSG_ASSIGN_OR_RETURN(const auto blocks, cache_->Blocks(facts_.get(), *snapshot_, stop));
    for (const BlockBounds* block : blocks->Touching(Grown(structure.box_map, kStructureReachM))) {
      if (stop) DSG_RETURN_IF_ERROR(stop());
      DSG_ASSIGN_OR_RETURN(const auto piece,
                           cache_->Piece(*facts_, *snapshot_, block->block, block->written));
      if (HasTriangleOn(*piece, structure)) return true;
    }
    return false;
  });
}

absl::StatusOr<bool> ObstacleFinder::ObjectHasTriangles(const ViewNode& object,
                                                        const StopCheck& stop) {
  return facts_->HasTriangles(object.id, [&]() -> absl::StatusOr<bool> {
    std::vector<std::shared_ptr<const MeshPiece>> pieces;
    DSG_RETURN_IF_ERROR(AddPieces(object.BoxMap(), stop, &pieces));
    std::erase_if(pieces, [](const auto& piece) { return piece->instances.empty(); });
    if (pieces.empty()) return false;
    DSG_ASSIGN_OR_RETURN(const auto owners, facts_->Owners(*snapshot_, stop));
    const auto instance = owners->instance_of.find(object.id);
    if (instance == owners->instance_of.end()) return false;
    // Triangles that two objects claim are those of one of them.
    if (owners->by_instance.at(instance->second).id != object.id) return false;
    return std::any_of(pieces.begin(), pieces.end(),
                       [&](const auto& piece) { return HasInstance(*piece, instance->second); });
  });
}

absl::Status ObstacleFinder::AddStructures(const Box3d& region, const CollisionScope& scope,
                                           const StopCheck& stop, Obstacles* found) {
  if (found->structure_table == nullptr) {
    DSG_ASSIGN_OR_RETURN(found->structure_table, facts_->Structures(*snapshot_, stop));
  }
  if (found->structure_table->empty()) return absl::OkStatus();
  std::vector<const StructureFacts*> near;
  SpaceFilter filter;
  filter.layer = layers::kStructures;
  view_->ForEachTouching(Grown(region, kStructureReachM), filter, [&](const ViewNode& node) {
    const auto facts = found->structure_table->find(node.id);
    if (facts != found->structure_table->end() && IsValid(node.valid)) {
      near.push_back(&facts->second);
    }
    return true;
  });
  std::sort(near.begin(), near.end(), [](const auto* a, const auto* b) { return a->id < b->id; });
  for (const StructureFacts* structure : near) {
    if (scope.ignored.contains(structure->id) || (scope.ignore_floor && structure->is_floor)) {
      found->left_out.push_back(structure);
      continue;
    }
    found->structures.push_back(structure);
    if (!scope.structures) continue;
    DSG_ASSIGN_OR_RETURN(const bool has_triangles, StructureHasTriangles(*structure, stop));
    if (has_triangles) continue;
    for (const Convex& shape : structure->shapes) {
      found->solids.push_back({shape, 0.0, ObstacleKind::kStructure, structure->id});
    }
  }
  return absl::OkStatus();
}

absl::Status ObstacleFinder::AddObjects(const Box3d& region, const CollisionScope& scope,
                                        const StopCheck& stop, Obstacles* found) {
  DSG_ASSIGN_OR_RETURN(const auto blocks, cache_->Blocks(facts_.get(), *snapshot_, stop));
  absl::Status status;
  SpaceFilter filter;
  filter.layer = layers::kObjects;
  int64_t visited_count = 0;
  view_->ForEachTouching(region, filter, [&](const ViewNode& object) {
    if (stop && ++visited_count % 256 == 0) status = stop();
    if (!status.ok()) return false;
    if (!IsValid(object.valid) || scope.ignored.contains(object.id)) return true;
    if (!blocks->empty()) {
      const absl::StatusOr<bool> has_triangles = ObjectHasTriangles(object, stop);
      status = has_triangles.status();
      if (!status.ok() || *has_triangles) return status.ok();
    }
    found->solids.push_back({object.box_node.isEmpty()
                                 ? MakePoint(object.map_T_node.position)
                                 : MakeBox(object.map_T_node, object.box_node),
                             0.0, ObstacleKind::kObject, object.id});
    return true;
  });
  return status;
}

absl::Status ObstacleFinder::AddAgents(const Box3d& region, const CollisionScope& scope,
                                       const StopCheck& stop, Obstacles* found) {
  const auto add = [&](const std::vector<Obstacle>& agents) {
    for (const Obstacle& agent : agents) {
      if (scope.ignored.contains(agent.node)) continue;
      if (Grown(agent.shape.bounds, agent.radius_m).intersects(region)) {
        found->solids.push_back(agent);
      }
    }
  };
  if (scope.agents) {
    if (!agents_.has_value()) {
      DSG_ASSIGN_OR_RETURN(agents_, AgentsAt(*snapshot_, at_ns_, stop));
    }
    add(*agents_);
  }
  if (scope.predicted_agents && at_ns_.has_value()) {
    if (!predicted_.has_value()) {
      DSG_ASSIGN_OR_RETURN(predicted_, AgentsForeseenAt(*snapshot_, *at_ns_, stop));
    }
    add(*predicted_);
  }
  return absl::OkStatus();
}

std::optional<FaceOwner> ObstacleFinder::OwnerOf(const Obstacles& found,
                                                 const CollisionScope& scope,
                                                 const MeshPiece& piece, int face,
                                                 const Convex& triangle) const {
  const uint32_t instance = piece.instance(face);
  if (instance != 0 && found.owners != nullptr) {
    const auto entry = found.owners->by_instance.find(instance);
    if (entry != found.owners->by_instance.end()) {
      const MeshOwner& owner = entry->second;
      if (!IsValid(owner.valid) || scope.ignored.contains(owner.id)) return std::nullopt;
      const auto is_owner = [&](const auto* structure) { return structure->id == owner.id; };
      if (std::any_of(found.left_out.begin(), found.left_out.end(), is_owner)) return std::nullopt;
      if (!(scope.mesh || (owner.is_object ? scope.objects : scope.structures))) {
        return std::nullopt;
      }
      return FaceOwner{owner.is_object ? ObstacleKind::kObject : ObstacleKind::kStructure,
                       owner.id};
    }
  }
  const auto holds = [&](const StructureFacts* structure) {
    return LiesOn(*structure, triangle, piece.label(face));
  };
  if (std::any_of(found.left_out.begin(), found.left_out.end(), holds)) return std::nullopt;
  const auto structure = std::find_if(found.structures.begin(), found.structures.end(), holds);
  if (structure != found.structures.end()) {
    if (!scope.mesh && !scope.structures) return std::nullopt;
    return FaceOwner{ObstacleKind::kStructure, (*structure)->id};
  }
  return scope.mesh ? std::optional<FaceOwner>(FaceOwner()) : std::nullopt;
}

absl::StatusOr<bool> ObstacleFinder::HasBlockAt(const Eigen::Vector3d& point_map,
                                                const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const auto blocks, cache_->Blocks(facts_.get(), *snapshot_, stop));
  if (blocks->empty()) return false;
  const double size_m = snapshot_->spec().mesh_block_size_m;
  return blocks->Contains({CellOf(point_map.x(), size_m), CellOf(point_map.y(), size_m),
                           CellOf(point_map.z(), size_m)});
}

absl::StatusOr<bool> ObstacleFinder::HasTriangleNear(const Eigen::Vector3d& point_map,
                                                     double reach_m, const StopCheck& stop) {
  std::vector<std::shared_ptr<const MeshPiece>> pieces;
  const Box3d point(point_map);
  DSG_RETURN_IF_ERROR(AddPieces(Grown(point, reach_m), stop, &pieces));
  bool found = false;
  for (const auto& piece : pieces) {
    double walk_m = reach_m;
    piece->tree.ForEachNear(point, &walk_m, [&](int face) {
      const Eigen::Vector3d nearest = NearestPoint(piece->tree.Triangle(face), point_map);
      if ((nearest - point_map).norm() > reach_m) return;
      found = true;
      walk_m = kEndWalk;
    });
    if (found) break;
  }
  return found;
}

namespace {

absl::StatusOr<Obstacle> AgentAt(const Snapshot& snapshot, NodeId agent, const Pose3d& map_T_agent,
                                 ObstacleKind kind, double grown_m) {
  DSG_ASSIGN_OR_RETURN(const Node node, snapshot.GetNode(agent));
  Obstacle obstacle;
  obstacle.kind = kind;
  obstacle.node = agent;
  if (!node.box_node.isEmpty()) {
    obstacle.shape = MakeBox(map_T_agent, node.box_node);
    obstacle.radius_m = grown_m;
    return obstacle;
  }
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ() * (0.5 * kAgentHeightM - kAgentRadiusM);
  obstacle.shape = MakeSegment(map_T_agent.position - up, map_T_agent.position + up);
  obstacle.radius_m = kAgentRadiusM + grown_m;
  return obstacle;
}

// Before the smallest number of ns there is nothing.
TimeNs Earlier(TimeNs time_ns, TimeNs by_ns) {
  return time_ns < kTimeMin + by_ns ? kTimeMin : time_ns - by_ns;
}

// When the agent is to be located; nullopt if it is not known to be there then.
std::optional<TimeNs> When(const TrackInfo& track, std::optional<TimeNs> at_ns, TimeNs newest_ns) {
  if (track.pose_count == 0) return std::nullopt;
  if (at_ns.has_value()) {
    if (*at_ns < track.first_ns || *at_ns > track.last_ns) return std::nullopt;
    return at_ns;
  }
  if (track.last_ns < Earlier(newest_ns, track.gap_ns_max)) return std::nullopt;
  return track.last_ns;
}

// What predictions are made from: the same as PredictAgent takes.
absl::StatusOr<std::vector<PathPoint>> LastPoints(const Snapshot& snapshot, const TrackInfo& track,
                                                  const StopCheck& stop) {
  std::vector<PathPoint> path;
  // Poses beyond what is looked at let its first point lie between two.
  const TimeNs window_ns = kTrackSeenNs + std::clamp(track.gap_ns_max, TimeNs{0}, kTrackSeenNs);
  // The last pose is asked for by an end behind it.
  const TimeNs until_ns = track.last_ns == kTimeMax ? kTimeMax : track.last_ns + 1;
  DSG_RETURN_IF_ERROR(
      snapshot.ReadPoses(track.agent, std::max(track.first_ns, Earlier(track.last_ns, window_ns)),
                         until_ns, stop, [&](const TimedPose& pose) {
                           path.push_back({pose.time_ns, pose.map_T_agent.position});
                           return true;
                         }));
  return RecentTrack(path, track.gap_ns_max);
}

}  // namespace

absl::StatusOr<std::vector<Obstacle>> AgentsAt(const Snapshot& snapshot,
                                               std::optional<TimeNs> at_ns, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot.Tracks(stop));
  TimeNs newest_ns = kTimeMin;
  for (const TrackInfo& track : tracks) {
    if (track.pose_count > 0) newest_ns = std::max(newest_ns, track.last_ns);
  }
  std::vector<Obstacle> agents;
  for (const TrackInfo& track : tracks) {
    if (stop) DSG_RETURN_IF_ERROR(stop());
    const std::optional<TimeNs> when_ns = When(track, at_ns, newest_ns);
    if (!when_ns.has_value()) continue;
    DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(track.agent, *when_ns));
    if (located.quality == PoseQuality::kInGap) continue;
    DSG_ASSIGN_OR_RETURN(Obstacle agent, AgentAt(snapshot, track.agent, located.map_T_agent,
                                                 ObstacleKind::kAgent, 0.0));
    agents.push_back(std::move(agent));
  }
  return agents;
}

absl::StatusOr<std::vector<Obstacle>> AgentsForeseenAt(const Snapshot& snapshot, TimeNs at_ns,
                                                       const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot.Tracks(stop));
  std::vector<Obstacle> agents;
  for (const TrackInfo& track : tracks) {
    if (stop) DSG_RETURN_IF_ERROR(stop());
    if (track.pose_count == 0 || at_ns <= track.last_ns) continue;
    if (track.last_ns < Earlier(at_ns, kForeseenNsMax)) continue;
    DSG_ASSIGN_OR_RETURN(const std::vector<PathPoint> path, LastPoints(snapshot, track, stop));
    if (path.empty()) continue;
    const PredictedPath foreseen = PredictWeightedVelocity(path, {at_ns}, {});
    DSG_ASSIGN_OR_RETURN(const LocatedPose last, snapshot.Locate(track.agent, track.last_ns));
    const Pose3d map_T_agent{foreseen.positions_map.back(), last.map_T_agent.orientation};
    DSG_ASSIGN_OR_RETURN(Obstacle agent,
                         AgentAt(snapshot, track.agent, map_T_agent, ObstacleKind::kPredictedAgent,
                                 kForeseenSigmas * foreseen.sigma_m.back()));
    agents.push_back(std::move(agent));
  }
  return agents;
}

}  // namespace dsg::query
