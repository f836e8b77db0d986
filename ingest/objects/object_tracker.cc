// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/object_tracker.h"

#include <algorithm>
#include <utility>

#include "ingest/objects/object_matching.h"

namespace dsg::ingest {

/// What became of each object and cluster of an update.
struct ObjectTracker::Assignment {
  /// By object as before the update: it has a cluster.
  std::vector<bool> is_matched;
  std::vector<ObjectCluster> clusters;
  /// By cluster.
  std::vector<int64_t> id_of;
};

void ObjectTracker::Refresh(size_t object, ObjectCluster cluster, TimeNs time_ns,
                            ObjectChanges* changes) {
  TrackedObject& known = objects_[object];
  uint64_t& digest = digests_[known.id];
  const uint64_t new_digest = DigestOf(cluster);
  if (cluster.last_seen_ns != kTimeMin) {
    known.last_observed_ns = std::max(known.last_observed_ns, cluster.last_seen_ns);
    known.observation_count = std::max(known.observation_count, cluster.seen_count);
  } else if (digest != new_digest) {
    known.last_observed_ns = time_ns;
  }
  digest = new_digest;
  if (!IsChanged(known.cluster, cluster, options_)) return;
  known.cluster = std::move(cluster);
  ++known.observation_count;
  changes->changed.push_back(known.id);
}

ObjectTracker::Assignment ObjectTracker::Assign(std::vector<ObjectCluster> clusters, TimeNs time_ns,
                                                ObjectChanges* changes) {
  Assignment result;
  result.is_matched.assign(objects_.size(), false);
  const std::vector<int> object_of = MatchClusters(objects_, clusters, options_);
  for (size_t i = 0; i < clusters.size(); ++i) {
    if (object_of[i] >= 0) {
      const auto object = static_cast<size_t>(object_of[i]);
      result.is_matched[object] = true;
      result.id_of.push_back(objects_[object].id);
      Refresh(object, clusters[i], time_ns, changes);
      continue;
    }
    TrackedObject added;
    added.id = next_id_++;
    added.cluster = clusters[i];
    added.first_observed_ns = std::min(time_ns, added.cluster.first_seen_ns);
    added.last_observed_ns = std::max(added.first_observed_ns, added.cluster.last_seen_ns);
    if (added.cluster.last_seen_ns == kTimeMin) added.last_observed_ns = time_ns;
    added.observation_count = std::max<int64_t>(1, added.cluster.seen_count);
    digests_[added.id] = DigestOf(added.cluster);
    changes->added.push_back(added.id);
    result.id_of.push_back(added.id);
    objects_.push_back(std::move(added));
  }
  result.clusters = std::move(clusters);
  return result;
}

void ObjectTracker::Retire(const Assignment& assignment,
                           const std::function<bool(const Eigen::Vector3f&)>& is_seen_through,
                           ObjectChanges* changes) {
  for (size_t i = 0; i < assignment.is_matched.size(); ++i) {
    if (assignment.is_matched[i]) continue;
    const TrackedObject& object = objects_[i];
    const int absorber = AbsorbingCluster(object.cluster, assignment.clusters, options_);
    if (absorber >= 0) {
      const int64_t id = assignment.id_of[static_cast<size_t>(absorber)];
      changes->merged.emplace_back(object.id, id);
      const auto into = std::find_if(objects_.begin(), objects_.end(),
                                     [&](const TrackedObject& other) { return other.id == id; });
      into->first_observed_ns = std::min(into->first_observed_ns, object.first_observed_ns);
      continue;
    }
    if (is_surface_new_) {
      changes->forgotten.push_back(object.id);
      continue;
    }
    const std::vector<Eigen::Vector3f>& points = object.cluster.points_map;
    const auto count = std::count_if(points.begin(), points.end(), is_seen_through);
    if (static_cast<double>(count) >
        options_.seen_through_share * static_cast<double>(points.size())) {
      changes->gone.push_back(object.id);
    } else if (forgets_lost_) {
      changes->forgotten.push_back(object.id);
    }
  }
}

void ObjectTracker::Remove(int64_t id) {
  digests_.erase(id);
  std::erase_if(objects_, [id](const TrackedObject& object) { return object.id == id; });
}

ObjectChanges ObjectTracker::Update(
    std::vector<ObjectCluster> clusters, TimeNs time_ns,
    const std::function<bool(const Eigen::Vector3f&)>& is_seen_through) {
  ObjectChanges changes;
  const Assignment assignment = Assign(std::move(clusters), time_ns, &changes);
  Retire(assignment, is_seen_through, &changes);
  is_surface_new_ = false;
  std::vector<int64_t> dropped = changes.gone;
  dropped.insert(dropped.end(), changes.forgotten.begin(), changes.forgotten.end());
  for (const auto& [first, second] : changes.merged) {
    dropped.push_back(first);
    const auto& added = changes.added;
    // Whoever takes over has a new history, if it is not new itself.
    if (std::find(added.begin(), added.end(), second) == added.end()) {
      changes.changed.push_back(second);
    }
  }
  for (const int64_t id : dropped) digests_.erase(id);
  std::erase_if(objects_, [&](const TrackedObject& object) {
    return std::find(dropped.begin(), dropped.end(), object.id) != dropped.end();
  });
  std::sort(changes.changed.begin(), changes.changed.end());
  changes.changed.erase(std::unique(changes.changed.begin(), changes.changed.end()),
                        changes.changed.end());
  return changes;
}

Pose3d MoveOf(const TrackedObject& object, const TrajectoryChange& change) {
  return MoveOf(object.cluster.center_map, object.first_observed_ns, object.last_observed_ns,
                change);
}

void MoveCluster(const Pose3d& new_T_old, ObjectCluster* cluster) {
  for (Eigen::Vector3f& point_map : cluster->points_map) {
    point_map = (new_T_old * point_map.cast<double>().eval()).cast<float>();
  }
  cluster->center_map = new_T_old * cluster->center_map;
  cluster->centroid_map = new_T_old * cluster->centroid_map;
  cluster->map_T_box = new_T_old * cluster->map_T_box;
}

void ObjectTracker::Move(const TrajectoryChange& change) {
  for (TrackedObject& object : objects_) MoveCluster(MoveOf(object, change), &object.cluster);
}

}  // namespace dsg::ingest
