// SPDX-License-Identifier: Apache-2.0
#include "query/engine/ancestry.h"

#include <algorithm>

#include "schema/base/status.h"

namespace dsg::query {
namespace {

absl::StatusOr<std::vector<NodeId>> FindIds(const Snapshot& snapshot, const Stay& stay) {
  std::vector<NodeId> ids;
  if (!stay.place.empty()) {
    DSG_ASSIGN_OR_RETURN(ids, snapshot.Ancestors(stay.place));
  }
  if (stay.room.empty() || std::find(ids.begin(), ids.end(), stay.room) != ids.end()) return ids;
  DSG_ASSIGN_OR_RETURN(ids, snapshot.Ancestors(stay.room));
  if (!stay.place.empty()) ids.insert(ids.begin(), stay.room);
  return ids;
}

absl::StatusOr<std::shared_ptr<const Ancestry>> Read(const Snapshot& snapshot, const Stay& stay) {
  DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> ids, FindIds(snapshot, stay));
  auto ancestry = std::make_shared<Ancestry>();
  for (const NodeId id : ids) {
    ancestry->ids.push_back(ToString(id));
    if (!ancestry->building_id.empty()) continue;
    DSG_ASSIGN_OR_RETURN(const Node node, snapshot.GetNode(id));
    if (node.kind == kinds::kBuilding) ancestry->building_id = ancestry->ids.back();
  }
  return std::shared_ptr<const Ancestry>(std::move(ancestry));
}

}  // namespace

size_t AncestryCache::KeyHash::operator()(const Key& key) const noexcept {
  const std::hash<NodeId> node_hash;
  size_t hash = key.opening * 31 + static_cast<size_t>(key.revision);
  hash = hash * 31 + node_hash(key.place);
  return hash * 31 + node_hash(key.room);
}

absl::StatusOr<std::shared_ptr<const Ancestry>> AncestryCache::Find(const Snapshot& snapshot,
                                                                    const Stay& stay) {
  const Key key{snapshot.opening(), snapshot.revision(), stay.place, stay.room};
  if (auto known = entries_.Find(key)) return *std::move(known);
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Ancestry> read, Read(snapshot, stay));
  entries_.Insert(key, read);
  return read;
}

}  // namespace dsg::query
