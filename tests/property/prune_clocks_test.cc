// SPDX-License-Identifier: Apache-2.0
// Whatever the clocks say, no policy by age takes what is younger than its age: agents years ahead
// and behind, poses that leap ahead once, a robot that is ahead with the people around it, and a
// wall clock that jumps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "schema/base/random.h"
#include "schema/retention/graph_index.h"
#include "schema/retention/past.h"
#include "schema/retention/plan.h"
#include "schema/retention/policy.h"
#include "tests/property/revision_log.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

// 2024-01-01.
constexpr TimeNs kEpochNs = 1'704'067'200 * kNsPerSecond;
constexpr int kClockWorldCount = 60;
constexpr int kRoundCount = 25;
constexpr uint64_t kThing = 1;

TimeNs Days(double days) { return static_cast<TimeNs>(days * static_cast<double>(kNsPerDay)); }

double InDays(TimeNs ns) { return static_cast<double>(ns) / static_cast<double>(kNsPerDay); }

struct Actor {
  NodeId id;
  /// What its clock says too much.
  TimeNs offset_ns = 0;
  bool is_here = true;
  /// When its poses were taken, and what its clock said.
  std::vector<TimeNs> true_ns;
  std::vector<TimeNs> said_ns;
};

// Some months of a map, in which everybody has a clock.
class ClockWorld {
 public:
  ClockWorld(uint64_t seed, bool are_right)
      : random_(seed, 17), are_right_(are_right), map_(SpecOf(&random_)) {
    MakeActors();
    for (int round = 0; round < kRoundCount; ++round) Commit(round);
  }

  TestMap& map() { return map_; }
  const std::vector<Actor>& actors() const { return actors_; }
  TimeNs true_now_ns() const { return now_ns_; }
  Random& random() { return random_; }

  // Two clocks that are wrong alike would be believed.
  TimeNs WallNow() {
    if (are_right_ || has_group_ || random_.Chance(0.4)) return now_ns_;
    return now_ns_ + Days(random_.Uniform(-2000, 2000));
  }

 private:
  static MapSpec SpecOf(Random* random) {
    MapSpec spec = Spec(TrajectoryCodec::kLossless);
    spec.clock = random->Chance(0.5) ? Clock::kUnix : Clock::kMonotonic;
    spec.epoch_ns = kEpochNs;
    return spec;
  }

  void MakeActors() {
    has_group_ = !are_right_ && map_.reader().spec().clock == Clock::kUnix && random_.Chance(0.5);
    for (uint64_t i = 1; i <= 7; ++i) actors_.push_back({NodeId('H', i)});
    if (are_right_) return;
    // The first is right; what is ahead is so by numbers of days that differ by more than all of
    // this lasts, or a robot and whom it sees by the same.
    double ahead_days = 400;
    for (size_t i = 1; i < actors_.size(); ++i) {
      const double what = random_.Uniform();
      if (what < 0.3) actors_[i].offset_ns = -Days(random_.Uniform(30, 1800));
      if (what < 0.7) continue;
      actors_[i].offset_ns = Days(ahead_days);
      if (!has_group_) ahead_days += 400;
    }
  }

  void Say(Actor* actor, TimeNs said_ns, TrajectoryAppend* append) {
    if (!actor->said_ns.empty() && said_ns <= actor->said_ns.back()) return;
    append->poses.push_back(PoseAt(said_ns, 1, 2, 0));
    actor->true_ns.push_back(now_ns_);
    actor->said_ns.push_back(said_ns);
  }

  void Commit(int round) {
    const bool is_pause = round == pause_round_;
    now_ns_ += Days(is_pause ? random_.Uniform(8, 50) : random_.Uniform(0.1, 3.0));
    GraphDelta delta;
    Node thing = MakeObject(kThing, "thing", BoxOf(0, 0, 0, 1, 1, 1));
    thing.last_observed_ns = now_ns_;
    delta.nodes.push_back(thing);
    for (size_t i = 0; i < actors_.size(); ++i) {
      Actor& actor = actors_[i];
      const bool begins = i == 0 || round > 0;
      if (!begins || !actor.is_here || (i > 0 && random_.Chance(0.3))) continue;
      if (actor.said_ns.empty()) {
        delta.nodes.push_back(MakeHuman(actor.id.index(), ToString(actor.id)));
      }
      TrajectoryAppend append{actor.id, {}};
      for (int pose = 0; pose < 3; ++pose) {
        Say(&actor, now_ns_ + actor.offset_ns + pose * kSecond, &append);
      }
      if (i > 0) MayLeave(&actor, &append);
      if (!append.poses.empty()) delta.appends.push_back(std::move(append));
    }
    map_.MustCommit(std::move(delta));
  }

  // For ever; some with a pose that is years ahead, after which a track cannot go on.
  void MayLeave(Actor* actor, TrajectoryAppend* append) {
    if (!random_.Chance(0.08)) return;
    actor->is_here = false;
    const bool leaps = !are_right_ && actor->offset_ns <= 0 && stray_days_ < 2000;
    if (!leaps || !random_.Chance(0.5)) return;
    Say(actor, now_ns_ + Days(stray_days_), append);
    stray_days_ += 400;
  }

  Random random_;
  const bool are_right_;
  TestMap map_;
  const int pause_round_ = random_.Integer(5, 60);
  bool has_group_ = false;
  double stray_days_ = 600;
  TimeNs now_ns_ = kEpochNs;
  std::vector<Actor> actors_;
};

bool Takes(const PrunePlan& plan, NodeId agent, TimeNs time_ns) {
  const auto goes = [&](const NodePlan& node) { return node.id == agent; };
  if (std::any_of(plan.nodes.begin(), plan.nodes.end(), goes)) return true;
  for (const TrackPlan& track : plan.tracks) {
    if (track.agent != agent) continue;
    return std::any_of(track.forgotten.begin(), track.forgotten.end(),
                       [&](const Interval& span) { return span.Contains(time_ns); });
  }
  return false;
}

template <class What>
PrunePolicy PolicyOf(const What& what) {
  PrunePolicy policy;
  policy.name = "test";
  policy.what.emplace<What>(what);
  return policy;
}

struct Counts {
  int64_t taken = 0;
  int64_t kept_too_long = 0;
};

Counts CheckWorld(ClockWorld* world, TimeNs age_ns, TimeNs wall_now_ns) {
  Counts counts;
  const bool takes_tracks = world->random().Chance(0.7);
  const PrunePolicy policy = takes_tracks ? PolicyOf(PrunePolicy::OlderThan{age_ns})
                                          : PolicyOf(PrunePolicy::UnseenFor{age_ns});
  const PrunePlan plan = OrDie(PlanPrune(&world->map().reader(), *world->map().Latest(), {policy},
                                         {wall_now_ns}, StopCheck()));
  for (const Actor& actor : world->actors()) {
    for (size_t i = 0; i < actor.true_ns.size(); ++i) {
      const TimeNs true_age_ns = world->true_now_ns() - actor.true_ns[i];
      const bool is_taken = Takes(plan, actor.id, actor.said_ns[i]);
      // Three poses of one round are a second apart.
      EXPECT_TRUE(!is_taken || true_age_ns > age_ns - 3 * kSecond)
          << ToString(actor.id) << " with a clock ahead by " << InDays(actor.offset_ns)
          << " days: a pose of age " << InDays(true_age_ns) << " went by an age of "
          << InDays(age_ns) << " days, wall clock ahead by "
          << InDays(wall_now_ns - world->true_now_ns());
      counts.taken += is_taken ? 1 : 0;
      const bool is_due = takes_tracks && true_age_ns > age_ns + 3 * kSecond;
      counts.kept_too_long += is_due && !is_taken ? 1 : 0;
    }
  }
  for (const NodePlan& node : plan.nodes) EXPECT_NE(node.id, NodeId('O', kThing));
  return counts;
}

TEST(PruneClocks, NoAgeTakesWhatIsYoungerByTheTruth) {
  const uint64_t seed = TestSeed(77);
  int64_t taken = 0;
  for (uint64_t i = 0; i < kClockWorldCount; ++i) {
    SCOPED_TRACE(i);
    ClockWorld world(seed + i, /*are_right=*/false);
    for (int ask = 0; ask < 4; ++ask) {
      const TimeNs age_ns = Days(world.random().Uniform(1, 60));
      taken += CheckWorld(&world, age_ns, world.WallNow()).taken;
    }
  }
  std::printf("%lld poses taken\n", static_cast<long long>(taken));
  EXPECT_GT(taken, 1000);
}

TEST(PruneClocks, WhereAllClocksAreRightAgesTakeAllThatTheyName) {
  const uint64_t seed = TestSeed(78);
  int64_t taken = 0;
  for (uint64_t i = 0; i < 20; ++i) {
    SCOPED_TRACE(i);
    ClockWorld world(seed + i, /*are_right=*/true);
    const Counts counts =
        CheckWorld(&world, Days(world.random().Uniform(1, 60)), world.true_now_ns());
    taken += counts.taken;
    EXPECT_EQ(counts.kept_too_long, 0);
  }
  EXPECT_GT(taken, 100);
}

TEST(PruneClocks, NoAgeOfHistoryTakesAYoungerRevision) {
  Random random(TestSeed(79), 3);
  int64_t taken = 0;
  for (int world = 0; world < 500; ++world) {
    RevisionLog log;
    std::vector<TimeNs> true_ns;
    TimeNs now_ns = kEpochNs;
    TimeNs offset_ns = 0;
    const auto pass = [&] {
      now_ns += Days(random.Uniform(0.0, 3.0));
      if (!random.Chance(0.15)) return;
      // By more than a week, or back to the truth.
      const double days = random.Uniform(8, 4000);
      offset_ns = random.Chance(0.4) ? 0 : Days(random.Chance(0.5) ? days : -days);
    };
    for (int i = 0; i < 30; ++i) {
      pass();
      const TimeNs stamp_ns = now_ns + offset_ns;
      // A step of the clock that is smaller than a week is believed.
      if (i > 0 &&
          std::abs(stamp_ns - log.stamps_ns.back() - (now_ns - true_ns.back())) < Days(7)) {
        offset_ns = log.stamps_ns.back() - true_ns.back();
      }
      true_ns.push_back(now_ns);
      log.stamps_ns.push_back(now_ns + offset_ns);
    }
    now_ns += Days(random.Uniform(0.0, 3.0));
    const TimeNs leap_ns = Days(random.Uniform(8, 4000)) * (random.Chance(0.5) ? 1 : -1);
    const TimeNs wall_ns = now_ns + offset_ns + (random.Chance(0.5) ? 0 : leap_ns);
    const TimeNs age_ns = Days(random.Uniform(1, 60));
    const HistoryCut cut = OrDie(FindHistoryCut(
        &log, 30, PolicyOf(PrunePolicy::HistoryOlderThan{age_ns}), wall_ns, StopCheck()));
    for (Revision revision = 1; revision < cut.keep_from; ++revision) {
      EXPECT_GT(now_ns - true_ns[static_cast<size_t>(revision - 1)], age_ns) << world;
      ++taken;
    }
  }
  EXPECT_GT(taken, 500);
}

}  // namespace
}  // namespace dsg::test
