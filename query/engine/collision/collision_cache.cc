// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/collision_cache.h"

#include <algorithm>

#include "schema/base/status.h"

namespace dsg::query {
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
  return structures_.Get([&] { return ReadStructures(snapshot, stop); });
}

absl::StatusOr<std::shared_ptr<const OwnerTable>> RevisionFacts::Owners(const Snapshot& snapshot,
                                                                        const StopCheck& stop) {
  return owners_.Get([&] { return ReadOwners(snapshot, stop); });
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

size_t CollisionCache::KeyHash::operator()(const Key& key) const noexcept {
  size_t hash = static_cast<size_t>(key.map_key);
  for (const int64_t part :
       {int64_t{key.block.x}, int64_t{key.block.y}, int64_t{key.block.z}, key.written}) {
    hash = (hash ^ static_cast<size_t>(part)) * 0x9e3779b97f4a7c15ull;
    hash ^= hash >> 32;
  }
  return hash;
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
  return facts->blocks_.Get([&] { return ReadBlocks(facts->map_key(), snapshot, stop); });
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

std::shared_ptr<const MeshPiece> CollisionCache::Find(const Key& key) {
  std::lock_guard lock(mutex_);
  const auto found = by_key_.find(key);
  if (found == by_key_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->piece;
}

void CollisionCache::Insert(const Key& key, std::shared_ptr<const MeshPiece> piece) {
  const size_t bytes = piece->memory_bytes() + sizeof(Entry) + sizeof(Key);
  std::lock_guard lock(mutex_);
  ++read_count_;
  if (bytes > bytes_max_ || by_key_.contains(key)) return;
  entries_.push_front({key, std::move(piece), bytes});
  by_key_.emplace(key, entries_.begin());
  bytes_ += bytes;
  while (bytes_ > bytes_max_) {
    bytes_ -= entries_.back().bytes;
    by_key_.erase(entries_.back().key);
    entries_.pop_back();
  }
}

absl::StatusOr<std::shared_ptr<const MeshPiece>> CollisionCache::Piece(const RevisionFacts& facts,
                                                                       const Snapshot& snapshot,
                                                                       BlockIndex block,
                                                                       Revision written) {
  const Key key{facts.map_key(), block, written};
  if (std::shared_ptr<const MeshPiece> known = Find(key)) return known;
  DSG_ASSIGN_OR_RETURN(const MeshBlock read, snapshot.ReadMeshBlock(block));
  auto piece = std::make_shared<const MeshPiece>(MakePiece(read));
  Insert(key, piece);
  return piece;
}

CollisionCache::Stats CollisionCache::stats() const {
  std::lock_guard lock(mutex_);
  return {bytes_, static_cast<int64_t>(entries_.size()), read_count_, measured_count_,
          static_cast<int64_t>(views_.size())};
}

}  // namespace dsg::query
