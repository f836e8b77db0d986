// SPDX-License-Identifier: Apache-2.0
// Keeps the identity of objects from one look at the mesh to the next.
// Refuses to forget an object only because nobody looked at it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "ingest/objects/object_cluster.h"
#include "ingest/trajectory/trajectory_change.h"
#include "schema/base/time.h"

namespace dsg::ingest {

struct TrackedObject {
  /// Never given twice in a run.
  int64_t id = -1;
  ObjectCluster cluster;
  /// Of the first update that had it, or of its first picture.
  TimeNs first_observed_ns = 0;
  /// Of the last update that brought other points, or of its last picture.
  TimeNs last_observed_ns = 0;
  /// Updates in which it changed, or pictures that showed it.
  int64_t observation_count = 0;
};

/// How an object moves when the path that it was seen from does: new map frame from old map frame.
Pose3d MoveOf(const TrackedObject& object, const TrajectoryChange& change);
void MoveCluster(const Pose3d& new_T_old, ObjectCluster* cluster);

/// What an update did, by id.
struct ObjectChanges {
  std::vector<int64_t> added;
  std::vector<int64_t> changed;
  /// Parts of one thing that turned out to be one: `first` goes on as `second`.
  std::vector<std::pair<int64_t, int64_t>> merged;
  /// No longer there: its space has been seen through.
  std::vector<int64_t> gone;
  /// Pieces of a surface that comes apart in another way now; of trackers that forget the lost, and
  /// after BeginAgain.
  std::vector<int64_t> forgotten;
};

/// Threads: one caller at a time.
class ObjectTracker {
 public:
  /// `forgets_lost`: clusters are all that the whole surface is taken for, so that an object
  /// without one was a wrong piece of it, and never there.
  explicit ObjectTracker(bool forgets_lost = false, const MatchOptions& options = {})
      : forgets_lost_(forgets_lost), options_(options) {}

  /// Matches clusters with the known objects by instance, class and overlap of boxes. An object
  /// without a cluster is gone if `is_seen_through(point)` holds for most of its points, and
  /// stays as it is otherwise. Too small a change of pose or box is no change. An object whose
  /// points a cluster of another object has taken over is merged into that one.
  /// Cost: known objects times clusters, in boxes.
  ObjectChanges Update(std::vector<ObjectCluster> clusters, TimeNs time_ns,
                       const std::function<bool(const Eigen::Vector3f&)>& is_seen_through);

  /// The path that objects were seen from has moved: each moves by when it was seen.
  void Move(const TrajectoryChange& change);

  /// The surface was made anew of all that was seen: an object without a cluster in the next update
  /// was never there, whatever is seen through.
  void BeginAgain() { is_surface_new_ = true; }

  /// Forgets an object that is known to be gone.
  void Remove(int64_t id);

  /// Ascending by id.
  const std::vector<TrackedObject>& objects() const { return objects_; }

 private:
  struct Assignment;
  Assignment Assign(std::vector<ObjectCluster> clusters, TimeNs time_ns, ObjectChanges* changes);
  void Refresh(size_t object, ObjectCluster cluster, TimeNs time_ns, ObjectChanges* changes);
  void Retire(const Assignment& assignment,
              const std::function<bool(const Eigen::Vector3f&)>& is_seen_through,
              ObjectChanges* changes);

  bool forgets_lost_ = false;
  bool is_surface_new_ = false;
  MatchOptions options_;
  std::vector<TrackedObject> objects_;
  /// By id: which points the latest cluster had.
  std::map<int64_t, uint64_t> digests_;
  int64_t next_id_ = 0;
};

}  // namespace dsg::ingest
