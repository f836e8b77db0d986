// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/human_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ingest/simulator/body/life_planner.h"
#include "ingest/simulator/world/walker.h"
#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

constexpr uint64_t kShapeStream = uint64_t{1} << 33;
constexpr uint64_t kErrandStream = (uint64_t{1} << 33) + (uint64_t{1} << 31);
constexpr double kShapeMax = 2.5;
/// One errand for so many seconds of somebody's life, and no more than so many a second.
constexpr double kPersonSecondsPerErrand = 45.0;
constexpr double kErrandsPerSecond = 18.0 / 300.0;
/// Errands begin early enough to be finished within the log.
constexpr double kLastErrandShare = 0.82;

ShapeCoefficients DrawShape(uint64_t seed, int person) {
  Random random(seed, kShapeStream + static_cast<uint64_t>(person));
  ShapeCoefficients shape;
  for (double& value : shape) value = std::clamp(random.Normal(), -kShapeMax, kShapeMax);
  return shape;
}

std::vector<std::string> PeopleNames(int count) {
  std::vector<AgentSpec> crowd = MakeCrowd(count);
  std::sort(crowd.begin(), crowd.end(),
            [](const AgentSpec& a, const AgentSpec& b) { return a.index < b.index; });
  std::vector<std::string> names;
  for (const AgentSpec& agent : crowd) {
    if (!agent.is_robot) names.push_back(agent.name);
  }
  return names;
}

// Ascending times of each person's errands. Some come to nothing, so there are a few more than
// wanted.
std::vector<std::vector<double>> DrawErrandTimes(const CrowdMotionOptions& options, uint64_t seed) {
  std::vector<std::vector<double>> times(static_cast<size_t>(options.people_count));
  if (times.empty()) return times;
  const double by_people = options.people_count * options.duration_s / kPersonSecondsPerErrand;
  const double by_time = std::max(2.0, kErrandsPerSecond * options.duration_s);
  const int count = static_cast<int>(std::ceil(std::min(by_people, by_time)));
  Random random(seed, kErrandStream);
  const int first = random.Index(options.people_count);
  // In a short log an errand must begin at once to end within it.
  const double last_s = kLastErrandShare * std::max(0.0, options.duration_s - 25.0) + 2.0;
  for (int i = 0; i < count; ++i) {
    const double time_s = 0.5 + last_s * (i + random.Uniform()) / count;
    times[static_cast<size_t>((first + i) % options.people_count)].push_back(time_s);
  }
  return times;
}

struct Person {
  std::string name;
  BodyModel body;
  Life life;
};

class PlannedCrowd final : public CrowdMotion {
 public:
  PlannedCrowd(const World* world, std::vector<Person> people, std::vector<PickEvent> picks)
      : world_(*world), people_(std::move(people)), picks_(std::move(picks)) {
    std::sort(picks_.begin(), picks_.end(), [](const PickEvent& a, const PickEvent& b) {
      return std::pair(a.pick_ns, a.object) < std::pair(b.pick_ns, b.object);
    });
    for (PickEvent& pick : picks_) {
      movable_.push_back(pick.object);
      if (pick.place_ns != kTimeMax) {
        pick.map_T_object_after.orientation = HeldAt(pick, pick.place_ns).orientation;
      }
    }
    std::sort(movable_.begin(), movable_.end());
  }

  int count() const override { return static_cast<int>(people_.size()); }
  const std::string& name(int person) const override { return At(person).name; }
  const BodyModel& body(int person) const override { return At(person).body; }
  const std::vector<PickEvent>& picks() const override { return picks_; }
  const std::vector<int>& movable() const override { return movable_; }

  BodyState StateAt(int person, TimeNs time_ns) const override {
    const Person& at = At(person);
    BodyState state;
    state.map_T_torso = at.life.TorsoAt(at.body, time_ns);
    state.pose = at.life.PostureAt(at.body, time_ns);
    state.joints_map = at.body.Joints(state.pose);
    for (Eigen::Vector3d& joint : state.joints_map) joint = state.map_T_torso * joint;
    return state;
  }

  Pose3d ObjectPoseAt(int object, TimeNs time_ns) const override {
    for (const PickEvent& pick : picks_) {
      if (pick.object != object || time_ns < pick.pick_ns) continue;
      return time_ns < pick.place_ns ? HeldAt(pick, time_ns) : pick.map_T_object_after;
    }
    return InitialPose(world_.furniture[object]);
  }

 private:
  const Person& At(int person) const { return people_[static_cast<size_t>(person)]; }

  // In the hand, turning with the body and never tilting.
  Pose3d HeldAt(const PickEvent& pick, TimeNs time_ns) const {
    const Person& at = At(pick.person);
    const Pose3d map_T_torso = at.life.TorsoAt(at.body, time_ns);
    const Eigen::Quaterniond taken_from = at.life.TorsoAt(at.body, pick.pick_ns).orientation;
    const Eigen::Vector3d hand =
        at.body.Joints(at.life.PostureAt(at.body, time_ns))[pick.hand_joint];
    const Pose3d initial = InitialPose(world_.furniture[pick.object]);
    return {map_T_torso * hand,
            map_T_torso.orientation * taken_from.conjugate() * initial.orientation};
  }

  const World& world_;
  std::vector<Person> people_;
  std::vector<PickEvent> picks_;
  std::vector<int> movable_;
};

}  // namespace

std::unique_ptr<CrowdMotion> CrowdMotion::Make(const World* world,
                                               const CrowdMotionOptions& options, uint64_t seed) {
  DSG_CHECK(options.people_count >= 0 && options.duration_s > 0.0);
  const Planner planner(world);
  ErrandBoard board(world);
  Traffic traffic(options.duration_s);
  if (options.robot_at) traffic.Add(options.robot_at);
  const std::vector<std::vector<double>> errand_times = DrawErrandTimes(options, seed);
  const std::vector<std::string> names = PeopleNames(options.people_count);
  const LifeStage stage = {.world = world,
                           .planner = &planner,
                           .board = &board,
                           .traffic = &traffic,
                           .robot_at = options.robot_at,
                           .meet_share = options.meet_share,
                           .duration_s = options.duration_s,
                           .seed = seed};
  std::vector<Person> people;
  std::vector<PickEvent> picks;
  for (int i = 0; i < options.people_count; ++i) {
    Person person = {names[static_cast<size_t>(i)], BodyModel(DrawShape(seed, i)), Life()};
    std::vector<double> times = errand_times[static_cast<size_t>(i)];
    const int left = options.pick_count_max - static_cast<int>(picks.size());
    if (options.pick_count_max > 0 && std::ssize(times) > left) {
      times.resize(static_cast<size_t>(std::max(left, 0)));
    }
    PlannedLife planned = LifePlanner(stage, i, &person.body).Plan(times);
    person.life = std::move(planned.life);
    traffic.Add(person.life);
    people.push_back(std::move(person));
    picks.insert(picks.end(), planned.picks.begin(), planned.picks.end());
  }
  return std::make_unique<PlannedCrowd>(world, std::move(people), std::move(picks));
}

}  // namespace dsg::simulator
