// SPDX-License-Identifier: Apache-2.0
// The keys that one commit touched, as they stand in its row of table `touched`.
// Refuses to say how a thing changed: its rows do.
#pragma once

#include <compare>
#include <string>
#include <string_view>
#include <vector>

#include "schema/model/ids.h"
#include "schema/model/mesh.h"

namespace dsg::sqlite {

/// An edge by the id of its relation.
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

  /// Sorts each list and leaves one of each.
  void Normalize();
};

/// One row a key and revision that began or ended a row of that key, whatever the number of rows:
/// kind (N, E, M, T, L), three numbers of its key, revision.
inline constexpr char kTouchedRows[] =
    "SELECT 'N', key, 0, 0, rev_from FROM node"
    " UNION SELECT 'N', key, 0, 0, rev_from FROM node_history"
    " UNION SELECT 'N', key, 0, 0, rev_to FROM node_history"
    " UNION SELECT 'E', source, relation, target, rev_from FROM edge"
    " UNION SELECT 'E', source, relation, target, rev_from FROM edge_history"
    " UNION SELECT 'E', source, relation, target, rev_to FROM edge_history"
    " UNION SELECT 'M', x, y, z, rev_from FROM mesh_block"
    " UNION SELECT 'M', x, y, z, rev_from FROM mesh_block_history"
    " UNION SELECT 'M', x, y, z, rev_to FROM mesh_block_history"
    " UNION SELECT 'T', agent, 0, 0, revision FROM track_mark JOIN track USING (slot)"
    " UNION SELECT 'L', 0, 0, 0, rev_from FROM layer WHERE rev_from > 0"
    " UNION SELECT 'L', 0, 0, 0, rev_from FROM label";

/// `keys` must be normalized.
std::string EncodeTouched(const TouchedKeys& keys);
/// Appends to `keys`. False if the bytes are not encoded keys.
bool DecodeTouched(std::string_view bytes, TouchedKeys* keys);

}  // namespace dsg::sqlite
