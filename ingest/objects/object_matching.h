// SPDX-License-Identifier: Apache-2.0
// Which cluster is which known object, and when a difference counts.
// Refuses to match one to two; what is left over is the tracker's business.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/objects/object_tracker.h"

namespace dsg::ingest {

/// The smallest box along the axes that holds the cluster's box.
Box3d AxisAlignedBox(const ObjectCluster& cluster);

/// For each cluster the index of its object, -1 = none. The same instance first, then the same
/// class by overlap, then another class in the same place.
std::vector<int> MatchClusters(const std::vector<TrackedObject>& objects,
                               const std::vector<ObjectCluster>& clusters,
                               const MatchOptions& options = {});

/// Another class or instance, or more of the centre, an edge or the yaw than counts.
bool IsChanged(const ObjectCluster& before, const ObjectCluster& after,
               const MatchOptions& options = {});

/// The cluster that has taken over most of the object's points, -1 = none.
int AbsorbingCluster(const ObjectCluster& object, const std::vector<ObjectCluster>& clusters,
                     const MatchOptions& options = {});

/// Equal for equal points, different for others but for a chance of 2^-64.
uint64_t DigestOf(const ObjectCluster& cluster);

}  // namespace dsg::ingest
