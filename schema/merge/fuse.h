// SPDX-License-Identifier: Apache-2.0
// Fuses two nodes that stand for one thing. Geometry is not averaged: the better observed one wins
// and grows where the other reaches further.
#pragma once

#include <string>

#include "schema/merge/origins.h"
#include "schema/model/node.h"

namespace dsg::merge {

/// Folds `seen`, a node of another map in the frame of `known`, into `known`, a node of the map
/// `into`, which keeps its id, name and what it knows better. Doing it again changes nothing.
/// `origin` says what `seen` is there; `is_known`: it has been taken into `known` before.
///
/// Objects: the box of the better observed, united where the other reaches out of it; regions and
/// structures: united; places and agents: as they are. First and last observed widen, confidence is
/// the larger. Observations add up, each map's own ones once: what `seen` had from others, `into`
/// among them, is told by its origins.
/// Requires: `seen.object->mesh_instance_id`, if any, is one of this map.
void FuseNode(const std::string& into, Origin origin, bool is_known, const Node& seen, Node* known);

/// Replaces `known`, copied from this origin before and changed by nobody else, by a later revision
/// of it. What only this map knows stays: its id, its name, the end of its validity unless it was
/// seen again later.
void RefreshCopy(Origin origin, const Node& seen, Node* known);

/// Numbers at most a micrometre apart count as the same.
bool IsSameGeometry(const Node& a, const Node& b);

}  // namespace dsg::merge
