// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/collision_cache.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "schema/base/status.h"

namespace dsg::query {

std::vector<std::array<uint32_t, 3>> UsableFaces(const MeshBlock& block) {
  std::vector<std::array<uint32_t, 3>> faces;
  faces.reserve(block.faces.size());
  for (const std::array<uint32_t, 3>& face : block.faces) {
    const bool usable = std::all_of(face.begin(), face.end(), [&](uint32_t vertex) {
      return vertex < block.positions_map.size() && block.positions_map[vertex].allFinite();
    });
    if (usable) faces.push_back(face);
  }
  return faces;
}

Eigen::AlignedBox3f BoundsOf(const MeshBlock& block) {
  Eigen::AlignedBox3f bounds;
  for (const std::array<uint32_t, 3>& face : UsableFaces(block)) {
    for (const uint32_t vertex : face) bounds.extend(block.positions_map[vertex]);
  }
  return bounds;
}

BlockTable::BlockTable(std::vector<BlockBounds> blocks) : blocks_(std::move(blocks)) {
  std::vector<Eigen::Vector3f> corners;
  std::vector<std::array<uint32_t, 3>> faces;
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const Eigen::AlignedBox3f& bounds = blocks_[i].bounds;
    if (bounds.isEmpty()) continue;
    const auto low = static_cast<uint32_t>(corners.size());
    corners.push_back(bounds.min());
    corners.push_back(bounds.max());
    faces.push_back({low, low + 1, low});
    block_of_face_.push_back(i);
  }
  tree_ = TriangleTree(std::move(corners), std::move(faces));
}

bool BlockTable::Contains(BlockIndex block) const {
  return std::ranges::binary_search(blocks_, block, {}, &BlockBounds::block);
}

std::vector<const BlockBounds*> BlockTable::Touching(const Box3d& region) const {
  std::vector<const BlockBounds*> touching;
  const double reach_m = 0.0;
  tree_.ForEachNear(region, &reach_m, [&](int face) {
    const BlockBounds& block = blocks_[block_of_face_[tree_.source_face(face)]];
    if (block.bounds.cast<double>().intersects(region)) touching.push_back(&block);
  });
  // They lie in one array, so that addresses ascend with the blocks.
  std::sort(touching.begin(), touching.end());
  return touching;
}

namespace {

using Eigen::Vector3d;

// Twice the voxel size that maps are usually made with.
constexpr double kOnPlaneM = 0.1;
// Legs and skirting boards stand on a floor, but do not face it.
constexpr double kFacingCos = 0.82;
// A box whose side is this close to the plane is tight along it.
constexpr double kAlignedCos = 0.996;
constexpr char kFloor[] = "floor";

struct Plane {
  Vector3d normal;
  double offset_m;
};

Plane ThinnestSide(const Convex& box) {
  int axis = 0;
  box.half.minCoeff(&axis);
  const Vector3d normal = box.axes.col(axis);
  return {normal, -normal.dot(box.center)};
}

bool IsAlong(const Convex& box, const Vector3d& normal) {
  return (box.axes.transpose() * normal).cwiseAbs().maxCoeff() > kAlignedCos;
}

// The polygon that a plane cuts out of a box, as triangles around its first corner.
std::vector<Convex> Cut(const Convex& box, const Plane& plane) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    for (int bit = 1; bit < 8; bit *= 2) {
      if ((i & bit) != 0) continue;
      const Vector3d& from = box.corners[i];
      const Vector3d& to = box.corners[i | bit];
      const double before = plane.normal.dot(from) + plane.offset_m;
      const double after = plane.normal.dot(to) + plane.offset_m;
      if ((before > 0.0) == (after > 0.0)) continue;
      corners.push_back(from + before / (before - after) * (to - from));
    }
  }
  if (corners.size() < 3) return {};
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& corner : corners) middle += corner / static_cast<double>(corners.size());
  const Vector3d u = plane.normal.unitOrthogonal();
  const Vector3d v = plane.normal.cross(u);
  std::sort(corners.begin(), corners.end(), [&](const Vector3d& a, const Vector3d& b) {
    return std::atan2(v.dot(a - middle), u.dot(a - middle)) <
           std::atan2(v.dot(b - middle), u.dot(b - middle));
  });
  std::vector<Convex> triangles;
  for (size_t i = 2; i < corners.size(); ++i) {
    triangles.push_back(MakeTriangle(corners[0], corners[i - 1], corners[i]));
  }
  return triangles;
}

}  // namespace

StructureFacts FactsOf(const Node& structure) {
  StructureFacts facts;
  facts.id = structure.id;
  facts.valid = structure.valid;
  facts.class_id = structure.class_id;
  facts.is_floor = structure.class_name == kFloor;
  facts.box_map = structure.BoxMap();
  Plane plane{Vector3d::Zero(), 0.0};
  if (structure.structure.has_value()) {
    facts.is_floor |= structure.structure->structure_type == kFloor;
    facts.instance_id = structure.structure->mesh_instance_id;
    plane = {structure.structure->plane_normal_map, structure.structure->plane_offset_m};
  }
  if (structure.box_node.isEmpty()) {
    facts.shapes = {MakePoint(structure.map_T_node.position)};
    facts.offset_m = -structure.map_T_node.position.z();
    return facts;
  }
  const Convex box = MakeBox(structure.map_T_node, structure.box_node);
  const double length = plane.normal.norm();
  if (length > 0.0 && std::isfinite(length) && std::isfinite(plane.offset_m)) {
    plane = {plane.normal / length, plane.offset_m / length};
    if (!IsAlong(box, plane.normal)) facts.shapes = Cut(box, plane);
  } else {
    plane = ThinnestSide(box);
  }
  if (facts.shapes.empty()) facts.shapes = {box};
  facts.normal_map = plane.normal;
  facts.offset_m = plane.offset_m;
  return facts;
}

bool LiesOn(const StructureFacts& structure, const Convex& triangle, uint32_t label) {
  if (label > 0 && structure.class_id > 0 && static_cast<int64_t>(label) != structure.class_id) {
    return false;
  }
  if (DistanceBetween(structure.box_map, triangle.bounds) > kOnPlaneM) return false;
  for (int i = 0; i < 3; ++i) {
    const Vector3d& corner = triangle.corners[i];
    if (std::abs(structure.normal_map.dot(corner) + structure.offset_m) > kOnPlaneM) return false;
    if (structure.box_map.exteriorDistance(corner) > kOnPlaneM) return false;
  }
  const Vector3d normal =
      (triangle.corners[1] - triangle.corners[0]).cross(triangle.corners[2] - triangle.corners[0]);
  return std::abs(normal.dot(structure.normal_map)) >= kFacingCos * normal.norm();
}

absl::StatusOr<std::shared_ptr<const StructureTable>> ReadStructures(const Snapshot& snapshot,
                                                                     const StopCheck& stop) {
  auto table = std::make_shared<StructureTable>();
  NodeFilter filter;
  filter.layer = layers::kStructures;
  DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
    table->emplace(node.id, FactsOf(node));
    return true;
  }));
  return table;
}

absl::StatusOr<std::shared_ptr<const OwnerTable>> ReadOwners(const Snapshot& snapshot,
                                                             const StopCheck& stop) {
  auto table = std::make_shared<OwnerTable>();
  for (const LayerId layer : {layers::kObjects, layers::kStructures}) {
    NodeFilter filter;
    filter.layer = layer;
    DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
      const bool is_object = node.object.has_value();
      uint32_t instance = 0;
      if (is_object) instance = node.object->mesh_instance_id;
      if (node.structure.has_value()) instance = node.structure->mesh_instance_id;
      if (instance == 0) return true;
      table->by_instance.try_emplace(instance, MeshOwner{node.id, is_object, node.valid});
      table->instance_of.emplace(node.id, instance);
      return true;
    }));
  }
  return table;
}

namespace {

using Face = std::array<uint32_t, 3>;

// Of each face of the tree what its corners agree on.
std::vector<uint32_t> Agreed(const std::vector<uint32_t>& of_vertices, const TriangleTree& tree) {
  if (of_vertices.size() != tree.vertices().size()) return {};
  std::vector<uint32_t> of_faces;
  of_faces.reserve(static_cast<size_t>(tree.face_count()));
  for (int i = 0; i < tree.face_count(); ++i) {
    const Face& face = tree.face(i);
    const uint32_t value = of_vertices[face[0]];
    const bool agree = value == of_vertices[face[1]] && value == of_vertices[face[2]];
    of_faces.push_back(agree ? value : 0);
  }
  const bool none =
      std::all_of(of_faces.begin(), of_faces.end(), [](uint32_t value) { return value == 0; });
  return none ? std::vector<uint32_t>() : of_faces;
}

}  // namespace

size_t MeshPiece::memory_bytes() const {
  return tree.memory_bytes() + (instances.capacity() + labels.capacity()) * sizeof(uint32_t);
}

MeshPiece MakePiece(const MeshBlock& block) {
  MeshPiece piece;
  piece.tree = TriangleTree(block.positions_map, UsableFaces(block));
  piece.instances = Agreed(block.instance_ids, piece.tree);
  piece.labels = Agreed(block.labels, piece.tree);
  return piece;
}

absl::StatusOr<std::shared_ptr<const StructureTable>> RevisionFacts::Structures(
    const Snapshot& snapshot, const StopCheck& stop) {
  return structures_.Get(stop, [&] { return ReadStructures(snapshot, stop); });
}

absl::StatusOr<std::shared_ptr<const OwnerTable>> RevisionFacts::Owners(const Snapshot& snapshot,
                                                                        const StopCheck& stop) {
  return owners_.Get(stop, [&] { return ReadOwners(snapshot, stop); });
}

absl::StatusOr<bool> RevisionFacts::HasTriangles(
    NodeId node, const std::function<absl::StatusOr<bool>()>& look) {
  {
    std::lock_guard lock(mutex_);
    const auto known = has_triangles_.find(node);
    if (known != has_triangles_.end()) return known->second;
  }
  DSG_ASSIGN_OR_RETURN(const bool has, look());
  std::lock_guard lock(mutex_);
  has_triangles_.emplace(node, has);
  return has;
}

std::shared_ptr<RevisionFacts> CollisionCache::FactsOf(
    const std::shared_ptr<const GraphView>& view) {
  std::lock_guard lock(mutex_);
  for (const KnownView& known : views_) {
    if (!known.view.owner_before(view) && !view.owner_before(known.view)) return known.facts;
  }
  std::erase_if(views_, [](const KnownView& known) { return known.view.expired(); });
  std::erase_if(bounds_, [&](const auto& bounds) {
    return std::none_of(views_.begin(), views_.end(), [&](const KnownView& known) {
      return known.facts->map_key() == bounds.first;
    });
  });
  // Views of one map share their symbols; while one of them lives, the address is theirs alone.
  uint64_t map_key = 0;
  for (const KnownView& known : views_) {
    const std::shared_ptr<const GraphView> other = known.view.lock();
    if (other != nullptr && &other->symbols() == &view->symbols()) {
      map_key = known.facts->map_key();
    }
  }
  if (map_key == 0) map_key = next_map_key_++;
  views_.push_back({view, std::make_shared<RevisionFacts>(map_key)});
  return views_.back().facts;
}

absl::StatusOr<std::shared_ptr<const BlockTable>> CollisionCache::Blocks(RevisionFacts* facts,
                                                                         const Snapshot& snapshot,
                                                                         const StopCheck& stop) {
  return facts->blocks_.Get(stop, [&] { return ReadBlocks(facts->map_key(), snapshot, stop); });
}

absl::StatusOr<std::shared_ptr<const BlockTable>> CollisionCache::ReadBlocks(
    uint64_t map_key, const Snapshot& snapshot, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const auto versions, snapshot.MeshBlockVersions(stop));
  const KnownBounds known = FindBounds(map_key);
  auto next = known->begin();
  std::vector<BlockBounds> bounds;
  int64_t measured_count = 0;
  absl::Status status;
  for (const auto& [block, written] : versions) {
    next = std::ranges::lower_bound(next, known->end(), block, {}, &BlockBounds::block);
    if (next != known->end() && next->block == block && next->written == written) {
      bounds.push_back(*next);
      continue;
    }
    if (stop) status = stop();
    if (!status.ok()) break;
    const absl::StatusOr<MeshBlock> read = snapshot.ReadMeshBlock(block);
    status = read.status();
    if (!status.ok()) break;
    bounds.push_back({block, written, BoundsOf(*read)});
    ++measured_count;
  }
  std::vector<BlockBounds> kept = bounds;
  // The next who asks goes on from there.
  if (!status.ok()) kept.insert(kept.end(), next, known->end());
  KeepBounds(map_key, std::move(kept), measured_count);
  DSG_RETURN_IF_ERROR(status);
  return std::make_shared<const BlockTable>(std::move(bounds));
}

CollisionCache::KnownBounds CollisionCache::FindBounds(uint64_t map_key) const {
  std::lock_guard lock(mutex_);
  const auto found = bounds_.find(map_key);
  if (found != bounds_.end()) return found->second;
  return std::make_shared<const std::vector<BlockBounds>>();
}

void CollisionCache::KeepBounds(uint64_t map_key, std::vector<BlockBounds> bounds,
                                int64_t measured_count) {
  auto kept = std::make_shared<const std::vector<BlockBounds>>(std::move(bounds));
  std::lock_guard lock(mutex_);
  bounds_[map_key] = std::move(kept);
  measured_count_ += measured_count;
}

absl::StatusOr<std::shared_ptr<const MeshPiece>> CollisionCache::Piece(const RevisionFacts& facts,
                                                                       const Snapshot& snapshot,
                                                                       BlockIndex block,
                                                                       Revision written) {
  const Key key{facts.map_key(), block, written};
  if (const auto known = pieces_.Find(key)) return *known;
  DSG_ASSIGN_OR_RETURN(const MeshBlock read, snapshot.ReadMeshBlock(block));
  auto piece = std::make_shared<const MeshPiece>(MakePiece(read));
  ++read_count_;
  const size_t bytes = piece->memory_bytes() + 2 * sizeof(Key) + sizeof(piece);
  if (bytes <= bytes_max_) pieces_.Insert(key, piece, bytes);
  return piece;
}

CollisionCache::Stats CollisionCache::stats() const {
  const auto pieces = pieces_.stats();
  std::lock_guard lock(mutex_);
  return {pieces.bytes, pieces.entry_count, read_count_, measured_count_,
          static_cast<int64_t>(views_.size())};
}

}  // namespace dsg::query
