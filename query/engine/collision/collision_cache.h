// SPDX-License-Identifier: Apache-2.0
// What collision questions derive from a map and keep: where the triangles of each mesh block are,
// who owns them, and trees over them. Knows maps by their views alone, so it keeps no file open.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/collision/shapes.h"
#include "query/view/graph_view.h"
#include "schema/base/cache.h"
#include "schema/base/time.h"
#include "schema/model/mesh.h"
#include "schema/model/revision.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

struct BlockBounds {
  BlockIndex block;
  /// The revision that wrote it.
  Revision written = 0;
  /// Of its triangles; empty if it has none.
  Eigen::AlignedBox3f bounds;
};

/// The faces that can be used: those that name vertices, all of them finite.
std::vector<std::array<uint32_t, 3>> UsableFaces(const MeshBlock& block);

/// Of the usable faces.
Eigen::AlignedBox3f BoundsOf(const MeshBlock& block);

/// The blocks of a mesh with triangles in a region. Goes by where the triangles are: a face belongs
/// to the block of its first corner and may reach far out of it.
///
/// Threads: immutable.
class BlockTable {
 public:
  /// Requires: ascending by block, each once. Cost: n log n.
  explicit BlockTable(std::vector<BlockBounds> blocks);

  bool empty() const { return blocks_.empty(); }
  /// Ascending.
  const std::vector<BlockBounds>& blocks() const { return blocks_; }
  /// Whether there is a block, with or without triangles.
  bool Contains(BlockIndex block) const;
  /// Blocks with triangles whose bounds touch the region, ascending. Valid as long as the table.
  std::vector<const BlockBounds*> Touching(const Box3d& region) const;

 private:
  std::vector<BlockBounds> blocks_;
  // A flat triangle for each block that has any, from corner to corner of its bounds.
  TriangleTree tree_;
  // Of each such triangle.
  std::vector<size_t> block_of_face_;
};

/// What counts of a structure.
struct StructureFacts {
  NodeId id;
  Interval valid;
  bool is_floor = false;
  int32_t class_id = -1;
  uint32_t instance_id = 0;
  /// n.x + d = 0; where the node has no plane, that of its thinnest side.
  Eigen::Vector3d normal_map = Eigen::Vector3d::UnitZ();
  double offset_m = 0.0;
  /// Bounds in the map.
  Box3d box_map;
  /// Where no triangles are known: the box, or the cut of plane and box where the plane lies
  /// across it.
  std::vector<Convex> shapes;
};

StructureFacts FactsOf(const Node& structure);

/// Whether a triangle is part of a structure: all corners within 10 cm of its plane and box, facing
/// it, and of no other class. `label` 0 = unknown.
bool LiesOn(const StructureFacts& structure, const Convex& triangle, uint32_t label);

using StructureTable = std::unordered_map<NodeId, StructureFacts>;

absl::StatusOr<std::shared_ptr<const StructureTable>> ReadStructures(const Snapshot& snapshot,
                                                                     const StopCheck& stop);

/// A node that owns triangles by an instance id.
struct MeshOwner {
  NodeId id;
  bool is_object = true;
  Interval valid;
};

struct OwnerTable {
  /// Of several nodes of one instance the one with the lowest id.
  std::unordered_map<uint32_t, MeshOwner> by_instance;
  std::unordered_map<NodeId, uint32_t> instance_of;
};

absl::StatusOr<std::shared_ptr<const OwnerTable>> ReadOwners(const Snapshot& snapshot,
                                                             const StopCheck& stop);

/// The triangles of one mesh block.
struct MeshPiece {
  TriangleTree tree;
  /// Of each face of the tree, where its three corners agree, else 0; empty if all are 0.
  std::vector<uint32_t> instances;
  std::vector<uint32_t> labels;

  uint32_t instance(int face) const {
    return instances.empty() ? 0 : instances[static_cast<size_t>(face)];
  }
  uint32_t label(int face) const { return labels.empty() ? 0 : labels[static_cast<size_t>(face)]; }
  size_t memory_bytes() const;
};

/// Of the usable faces.
MeshPiece MakePiece(const MeshBlock& block);

/// What is known of one revision of a map.
///
/// Threads: safe from many threads.
class RevisionFacts {
 public:
  explicit RevisionFacts(uint64_t map_key) : map_key_(map_key) {}

  /// Of all revisions of one open map the same.
  uint64_t map_key() const { return map_key_; }
  absl::StatusOr<std::shared_ptr<const StructureTable>> Structures(const Snapshot& snapshot,
                                                                   const StopCheck& stop);
  absl::StatusOr<std::shared_ptr<const OwnerTable>> Owners(const Snapshot& snapshot,
                                                           const StopCheck& stop);
  /// Whether the mesh has triangles of a node; `look` is asked once a node.
  absl::StatusOr<bool> HasTriangles(NodeId node, const std::function<absl::StatusOr<bool>()>& look);

 private:
  friend class CollisionCache;

  const uint64_t map_key_;
  MakeOnce<const BlockTable> blocks_;
  MakeOnce<const StructureTable> structures_;
  MakeOnce<const OwnerTable> owners_;
  std::mutex mutex_;
  std::unordered_map<NodeId, bool> has_triangles_;
};

/// What collision questions derive from maps.
///
/// Threads: safe from many threads.
class CollisionCache {
 public:
  /// Of trees; facts and tables live as long as the views that they belong to.
  explicit CollisionCache(size_t bytes_max = size_t{256} << 20)
      : bytes_max_(bytes_max), pieces_(bytes_max) {}

  std::shared_ptr<RevisionFacts> FactsOf(const std::shared_ptr<const GraphView>& view);
  /// Where the triangles of each block are.
  /// Errors: what `stop` returned (asked at each block; what was read until then is kept), as
  /// Snapshot::ReadMeshBlock. Cost: the first time all blocks of the map are read, then those that
  /// were written since.
  absl::StatusOr<std::shared_ptr<const BlockTable>> Blocks(RevisionFacts* facts,
                                                           const Snapshot& snapshot,
                                                           const StopCheck& stop);
  /// The block as `written` wrote it. Errors: as Snapshot::ReadMeshBlock.
  absl::StatusOr<std::shared_ptr<const MeshPiece>> Piece(const RevisionFacts& facts,
                                                         const Snapshot& snapshot, BlockIndex block,
                                                         Revision written);

  struct Stats {
    size_t bytes = 0;
    int64_t piece_count = 0;
    /// Of pieces.
    int64_t read_count = 0;
    /// Of blocks that were read for their bounds.
    int64_t measured_count = 0;
    int64_t revision_count = 0;
  };
  Stats stats() const;

 private:
  struct Key {
    uint64_t map_key = 0;
    BlockIndex block;
    Revision written = 0;
    bool operator==(const Key&) const = default;
    template <typename H>
    friend H AbslHashValue(H hash, const Key& key) {
      const BlockIndex& block = key.block;
      return H::combine(std::move(hash), key.map_key, block.x, block.y, block.z, key.written);
    }
  };
  struct KnownView {
    std::weak_ptr<const GraphView> view;
    std::shared_ptr<RevisionFacts> facts;
  };

  using KnownBounds = std::shared_ptr<const std::vector<BlockBounds>>;

  absl::StatusOr<std::shared_ptr<const BlockTable>> ReadBlocks(uint64_t map_key,
                                                               const Snapshot& snapshot,
                                                               const StopCheck& stop);
  KnownBounds FindBounds(uint64_t map_key) const;
  void KeepBounds(uint64_t map_key, std::vector<BlockBounds> bounds, int64_t measured_count);

  const size_t bytes_max_;
  Cache<Key, std::shared_ptr<const MeshPiece>> pieces_;
  std::atomic<int64_t> read_count_ = 0;
  mutable std::mutex mutex_;
  int64_t measured_count_ = 0;
  // Of each map that has a view, as of the revision that was asked for last. Ascending.
  std::unordered_map<uint64_t, KnownBounds> bounds_;
  std::vector<KnownView> views_;
  uint64_t next_map_key_ = 1;
};

}  // namespace dsg::query
