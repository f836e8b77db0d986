// SPDX-License-Identifier: Apache-2.0
// How objects lie to one another: on, in, near, larger than, seen together.
// Refuses to compare objects that are far apart.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ingest/objects/object_tracker.h"

namespace dsg::ingest {

/// Of a first object to a second.
struct ObjectRelation {
  int64_t first = -1;
  /// relations::kOn, kIn, kNear, kLargerThan.
  std::string relation;
  int64_t second = -1;
  /// Metres between the boxes for NEAR; ratio of volumes for LARGER_THAN; 1 otherwise.
  double weight = 1.0;
};

/// ON and IN of boxes, at most one of both for an object: what lies in a box is IN it, but ON it
/// when the points show that nothing covers or encloses it. What nothing carries so, well above the
/// floor, is ON what it touches the upper edge of. NEAR below a distance of the
/// boxes along the axes, low id first; LARGER_THAN of near pairs by more than a ratio.
/// Order: ascending by first, relation, second. Cost: n log n by a grid.
std::vector<ObjectRelation> FindRelations(const std::vector<TrackedObject>& objects,
                                          const RelationOptions& options = {});

/// The object that carries one which FindRelations found no support for and which hangs on nothing:
/// nothing floats, so it is on what has its top at its underside a little beside it, of which more
/// was not seen. Requires: it is well above the floor. Cost: linear.
std::optional<int64_t> CarrierBeside(const TrackedObject& object,
                                     const std::vector<TrackedObject>& objects,
                                     const RelationOptions& options);

/// Pairs (object, object) that were in one picture; counts pictures. Input of CO_VISIBLE.
/// Ids below are of ObjectTracker; `visible`: objects in one picture, ascending.
///
/// Memory: at most kPairCountMax pairs; then the rarest are forgotten.
/// Threads: one caller at a time.
class CoVisibility {
 public:
  static constexpr size_t kPairCountMax = 1 << 19;

  void Observe(const std::vector<int64_t>& visible);
  struct Pair {
    int64_t first;
    int64_t second;
    int64_t picture_count;
  };
  /// `from` has become one with `to`: its pairs count as those of `to`.
  void Merge(int64_t from, int64_t to);
  /// Drops all pairs of an object that is gone.
  void Forget(int64_t id);
  /// Pairs of at least `picture_count_min`; of each object the `partner_count_max` most frequent.
  /// Ascending.
  std::vector<Pair> Pairs(int64_t picture_count_min, int partner_count_max) const;

 private:
  void ForgetRarest();

  /// Ascending.
  std::vector<Pair> pairs_;
};

}  // namespace dsg::ingest
