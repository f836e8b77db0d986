// SPDX-License-Identifier: Apache-2.0
// Fuses two nodes that stand for one thing. Geometry is not averaged: the better observed one wins
// and grows where the other reaches further.
#pragma once

#include <string>

#include "schema/merge/origins.h"
#include "schema/model/node.h"

namespace dsg::merge {

/// Fuses `seen`, a node of another map in the frame of `into`, into `known`, a node of `into`.
/// `known` keeps its id, its name and what it knows better. Idempotent. `origin`: what `seen` is in
/// its map; `is_known`: an earlier merge fused it into `known` already.
/// Objects take the box of the better observed node, extended where the other reaches out of it.
/// Regions and structures are united. Places and agents stay. The observed span widens; confidence
/// is the larger one. Observations add up, those of each map once: the origins of `seen` tell what
/// it had from other maps, `into` among them.
/// Requires: `seen.object->mesh_instance_id`, if any, is one of this map.
void FuseNode(const std::string& into, Origin origin, bool is_known, const Node& seen, Node* known);

/// Replaces `known`, an unchanged copy from this origin, by a later revision of its origin. The id
/// and name stay, and so does the end of validity unless the node was seen again later.
void RefreshCopy(Origin origin, const Node& seen, Node* known);

/// Numbers at most a micrometre (or microradian) apart count as equal.
bool IsSameGeometry(const Node& a, const Node& b);

}  // namespace dsg::merge
