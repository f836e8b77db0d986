// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/collision_duel.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "schema/base/status.h"

namespace dsg::bench {
namespace {

using query::CollisionHit;
using query::CollisionScope;
using query::CollisionWorld;

// Ours and FCL take turns after so many questions.
constexpr size_t kTurn = 100;

}  // namespace

Duel::Duel(const OpenMap& open, const CollisionScope& scope, FclRival* rival)
    : open_(open), scope_(scope), touch_scope_(scope), rival_(rival) {
  // Hit or not is all that is asked for: what is further away than nearly nothing is left alone.
  touch_scope_.clearance_m_max = 1e-9;
}

absl::Status Duel::AskOurs(const Eigen::Vector3d& center) {
  CollisionHit hit;
  CollisionHit touch;
  DSG_ASSIGN_OR_RETURN(const int64_t ns, Check(center, scope_, &hit));
  DSG_ASSIGN_OR_RETURN(const int64_t touch_ns, Check(center, touch_scope_, &touch));
  asked_.ours.Add(ns);
  asked_.ours_touch.Add(touch_ns);
  asked_.clearances_m.push_back(hit.clearance_m);
  asked_.hit_count += hit.hit ? 1 : 0;
  return absl::OkStatus();
}

void Duel::AskFcl(const Eigen::Vector3d& center) {
  double clearance_m = 0.0;
  bool touches = false;
  asked_.fcl.Add(NanosecondsOf(
      [&] { clearance_m = rival_->Clearance(center, kSphereRadiusM, scope_.clearance_m_max); }));
  asked_.fcl_touch.Add(NanosecondsOf([&] { touches = rival_->Touches(center, kSphereRadiusM); }));
  asked_.fcl_clearances_m.push_back(clearance_m);
  asked_.other_hit_count += touches ? 1 : 0;
}

absl::StatusOr<Asked> Duel::AskBoth(const std::vector<Eigen::Vector3d>& centers) {
  // The first round reads what is missing.
  for (int round = 0; round < 2; ++round) {
    asked_ = Asked();
    for (size_t first = 0; first < centers.size(); first += kTurn) {
      const size_t end = std::min(first + kTurn, centers.size());
      for (size_t i = first; i < end; ++i) DSG_RETURN_IF_ERROR(AskOurs(centers[i]));
      for (size_t i = first; i < end; ++i) AskFcl(centers[i]);
    }
  }
  return std::exchange(asked_, Asked());
}

absl::StatusOr<int64_t> Duel::Check(const Eigen::Vector3d& center, const CollisionScope& scope,
                                    CollisionHit* hit) {
  const query::Body body = query::SweptSphere(kSphereRadiusM, {center});
  absl::StatusOr<CollisionHit> answer;
  const int64_t ns = NanosecondsOf([&] {
    CollisionWorld world =
        CollisionWorld::Create(open_.view, open_.snapshot, std::nullopt, &cache_);
    answer = world.Check(body, scope, StopCheck());
  });
  DSG_RETURN_IF_ERROR(answer.status());
  *hit = *answer;
  return ns;
}

}  // namespace dsg::bench
