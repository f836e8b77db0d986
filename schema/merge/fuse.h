// SPDX-License-Identifier: Apache-2.0
// What is believed of a thing that two maps have seen.
// Refuses to average: geometry is that of the better look, grown where the other saw more.
#pragma once

#include <string>

#include "schema/model/node.h"

namespace dsg::merge {

/// Folds `seen`, a node of the map `from` in the frame of `known`, into `known`, which keeps its
/// id, name and what it knows better. Doing it again changes nothing.
///
/// Objects: the box of the better observed, united where the other reaches out of it; regions and
/// structures: united; places and agents: as they are. Observations add up (once per origin), first
/// and last widen, confidence is the larger.
/// Requires: `seen.object->mesh_instance_id`, if any, is one of this map.
void FuseNode(const std::string& from, NodeId seen_id, const Node& seen, Node* known);

/// Replaces `known`, copied from this origin before, by a later revision of it. What only this map
/// knows stays: its id, the end of its validity unless it was seen again later.
void RefreshCopy(const std::string& from, NodeId seen_id, const Node& seen, Node* known);

/// Numbers at most a micrometre apart count as the same.
bool IsSameGeometry(const Node& a, const Node& b);

}  // namespace dsg::merge
