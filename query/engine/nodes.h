// SPDX-License-Identifier: Apache-2.0
// Nodes and edges of the store, one by one and as lists; a reply carries as much of a node as the
// view of the request asks for. The .cc file answers GetNode, ListNodes and ListEdges.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// The CONTAINS edges that lead down from a node.
EdgeFilter ChildrenOf(NodeId parent);

/// `view` is a number of v1.NodeView. Errors: FIELD_INVALID for one that is not.
absl::Status CheckNodeView(int view);

/// Fills `out` with the parts of `node` that the view shows.
void FillNode(const Node& node, const LayerTable& layers, int view, v1::Node* out);

absl::StatusOr<LayerTable> LayersOf(const Snapshot& snapshot);

/// Nodes or edges with keys that are known beforehand: read from the store many at a time, handed
/// out one by one. Reads no more than one batch ahead.
///
/// `Key` is NodeId or EdgeKey. The keys must outlive this.
///
/// Threads: one caller at a time.
template <typename Key>
class InTurn {
 public:
  using Value = std::conditional_t<std::is_same_v<Key, NodeId>, Node, Edge>;

  InTurn() = default;
  // A read transaction costs as much as a few rows, so that larger batches would gain little.
  explicit InTurn(std::span<const Key> keys, size_t batch_max = 64)
      : keys_(keys), batch_max_(batch_max) {}

  bool done() const { return next_ == keys_.size(); }
  /// Of what Next gives. Requires: not done.
  const Key& key() const { return keys_[next_]; }
  /// nullopt where the snapshot, the same in all calls, has no such thing. Requires: not done.
  absl::StatusOr<std::optional<Value>> Next(const Snapshot& snapshot, const StopCheck& stop) {
    if (next_ == read_end_) DSG_RETURN_IF_ERROR(ReadOn(snapshot, stop));
    return std::move(read_[read_.size() - (read_end_ - next_++)]);
  }

 private:
  absl::Status ReadOn(const Snapshot& snapshot, const StopCheck& stop) {
    const size_t count = std::min(batch_max_, keys_.size() - next_);
    const std::span<const Key> part = keys_.subspan(next_, count);
    const std::vector<Key> batch(part.begin(), part.end());
    if constexpr (std::is_same_v<Key, NodeId>) {
      DSG_ASSIGN_OR_RETURN(read_, snapshot.FindNodes(batch, stop));
    } else {
      DSG_ASSIGN_OR_RETURN(read_, snapshot.FindEdges(batch, stop));
    }
    read_end_ = next_ + count;
    return absl::OkStatus();
  }

  std::span<const Key> keys_;
  size_t batch_max_ = 1;
  size_t next_ = 0;
  // The keys before `read_end_` that come last are those of `read_`.
  size_t read_end_ = 0;
  std::vector<std::optional<Value>> read_;
};

}  // namespace dsg::query
