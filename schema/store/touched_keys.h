// SPDX-License-Identifier: Apache-2.0
// The keys that one commit touched, which it leaves as a list: so what lies between two revisions
// is found at the cost of the difference. The list does not say how a thing changed: its rows do.
#pragma once

#include <compare>
#include <string>
#include <string_view>
#include <vector>

#include "schema/model/ids.h"
#include "schema/model/mesh.h"

namespace dsg {

/// An edge by the number of its relation; see EdgeRow.
struct EdgeRowKey {
  NodeId source;
  int64_t relation = 0;
  NodeId target;
  auto operator<=>(const EdgeRowKey&) const = default;
};

/// Keys in any order and as often as they come; Normalize makes them sets.
struct TouchedKeys {
  std::vector<NodeId> nodes;
  std::vector<EdgeRowKey> edges;
  std::vector<NodeId> tracks;
  std::vector<BlockIndex> mesh_blocks;
  bool layers_or_labels = false;

  /// Appends those of `other`.
  void Add(const TouchedKeys& other);
  /// Sorts each list and leaves one of each.
  void Normalize();
};

/// `keys` must be normalized.
std::string EncodeTouched(const TouchedKeys& keys);
/// Appends to `keys`. False if the bytes are not encoded keys.
bool DecodeTouched(std::string_view bytes, TouchedKeys* keys);

}  // namespace dsg
