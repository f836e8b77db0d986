// SPDX-License-Identifier: Apache-2.0
// Encounters of people, and hands near things, as edges of the scene graph.
// Refuses to say what came of them.
#pragma once

#include <vector>

#include "ingest/agents/contacts/contacts.h"
#include "ingest/pipeline/people_told.h"
#include "schema/model/edge.h"

namespace dsg::ingest {

/// One NEAR edge for each pair of people that met, from the lower to the higher id, and for each
/// person and thing that a hand came near. Valid from the first contact to the last; weight = least
/// distance, metres; attributes: "contact" ("encounter" or "hand"), "count", "total_s",
/// "closest_ns", "intervals_ns" ("from..to", comma between, the first ones), and of hands "hand"
/// ("left", "right") and "hand_x", "hand_y", "hand_z" at the closest instant, map frame.
std::vector<Edge> FindContactEdges(const PersonTracker& tracker, const PeopleTold& told,
                                   const std::vector<ThingBox>& things,
                                   const ContactOptions& options);

/// The same of paths, whoever made them.
std::vector<Edge> FindContactEdges(const std::vector<AgentPath>& paths,
                                   const std::vector<ThingBox>& things,
                                   const ContactOptions& options);

}  // namespace dsg::ingest
