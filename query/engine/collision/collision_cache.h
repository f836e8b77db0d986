// SPDX-License-Identifier: Apache-2.0
// What collision questions make of a map and would make again: trees over the triangles of mesh
// blocks, where these are, and who owns them. Refuses to keep files open: it knows maps by their
// views alone.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/collision/block_table.h"
#include "query/engine/collision/mesh_owners.h"
#include "query/engine/collision/triangle_tree.h"
#include "query/view/graph_view.h"
#include "schema/model/mesh.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

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

/// A value that is read when it is first wanted. Two who want it at once may both read it.
///
/// Threads: safe from many threads.
template <typename T>
class ReadOnce {
 public:
  template <typename Read>
  absl::StatusOr<std::shared_ptr<const T>> Get(Read&& read) {
    {
      std::lock_guard lock(mutex_);
      if (value_ != nullptr) return value_;
    }
    absl::StatusOr<std::shared_ptr<const T>> value = std::forward<Read>(read)();
    if (!value.ok()) return value;
    std::lock_guard lock(mutex_);
    if (value_ == nullptr) value_ = *std::move(value);
    return value_;
  }

 private:
  std::mutex mutex_;
  std::shared_ptr<const T> value_;
};

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
  ReadOnce<BlockTable> blocks_;
  ReadOnce<StructureTable> structures_;
  ReadOnce<OwnerTable> owners_;
  std::mutex mutex_;
  std::unordered_map<NodeId, bool> has_triangles_;
};

/// Threads: safe from many threads.
class CollisionCache {
 public:
  /// Of trees; facts and tables live as long as the views that they belong to.
  explicit CollisionCache(size_t bytes_max = size_t{256} << 20) : bytes_max_(bytes_max) {}

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
  };
  struct KeyHash {
    size_t operator()(const Key& key) const noexcept;
  };
  struct Entry {
    Key key;
    std::shared_ptr<const MeshPiece> piece;
    size_t bytes = 0;
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
  std::shared_ptr<const MeshPiece> Find(const Key& key);
  void Insert(const Key& key, std::shared_ptr<const MeshPiece> piece);

  const size_t bytes_max_;
  mutable std::mutex mutex_;
  // The last used first.
  std::list<Entry> entries_;
  std::unordered_map<Key, std::list<Entry>::iterator, KeyHash> by_key_;
  size_t bytes_ = 0;
  int64_t read_count_ = 0;
  int64_t measured_count_ = 0;
  // Of each map that has a view, as of the revision that was asked for last. Ascending.
  std::unordered_map<uint64_t, KnownBounds> bounds_;
  std::vector<KnownView> views_;
  uint64_t next_map_key_ = 1;
};

}  // namespace dsg::query
