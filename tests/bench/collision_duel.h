// SPDX-License-Identifier: Apache-2.0
// The same spheres, one after the other, to our collision checks and to FCL.
// Refuses to judge: who asks compares the answers.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/collision/collision_world.h"
#include "tests/bench/fcl_rival.h"
#include "tests/bench/report.h"

namespace dsg::bench {

inline constexpr double kSphereRadiusM = 0.3;

struct OpenMap {
  std::shared_ptr<const Snapshot> snapshot;
  std::shared_ptr<const query::GraphView> view;
};

/// What both sides answered, and how long each took.
struct Asked {
  std::vector<double> clearances_m;
  std::vector<double> fcl_clearances_m;
  Samples ours;
  Samples fcl;
  Samples ours_touch;
  Samples fcl_touch;
  int hit_count = 0;
  int other_hit_count = 0;
};

/// One question of each sort to each of both sides. All arguments outlive it.
class Duel {
 public:
  Duel(const OpenMap& open, const query::CollisionScope& scope, FclRival* rival);

  absl::Status AskOurs(const Eigen::Vector3d& center);
  void AskFcl(const Eigen::Vector3d& center);
  /// Both in turns, once all that they keep is there.
  absl::StatusOr<Asked> AskBoth(const std::vector<Eigen::Vector3d>& centers);

  const query::CollisionCache& cache() const { return cache_; }

 private:
  absl::StatusOr<int64_t> Check(const Eigen::Vector3d& center, const query::CollisionScope& scope,
                                query::CollisionHit* hit);

  const OpenMap& open_;
  const query::CollisionScope& scope_;
  query::CollisionScope touch_scope_;
  FclRival* rival_;
  query::CollisionCache cache_;
  Asked asked_;
};

}  // namespace dsg::bench
