// SPDX-License-Identifier: Apache-2.0
// Recorded people (ETH/UCY, L-CAS, THOR-MAGNI), turned into detections without names and tracked
// back: noise of 0.15 m in x and y, one detection in ten missing, 0.2 false ones per image anywhere
// in the area, shuffled, positions only: no joints, no shape, no heading.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "ingest/log/log_source.h"
#include "tests/unit/ingest/agents/tracking/nearest_neighbour.h"
#include "tests/unit/ingest/agents/tracking/people_util.h"

namespace dsg::ingest {
namespace {

constexpr uint64_t kSeed = 1;
constexpr double kReplaySigmaM = 0.15;
constexpr double kMissRate = 0.1;
constexpr double kFalsePerImage = 0.2;
constexpr double kTorsoM = 0.95;

using Paths = std::map<TimeNs, std::map<std::string, Eigen::Vector3d>>;

std::filesystem::path DataFolder() {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

// Tracklets of one helmet ("Helmet_3/17") overlap; they are one person.
std::string PersonOf(const std::string& agent) { return agent.substr(0, agent.find('/')); }

Paths ReadPaths(const std::string& path) {
  Paths paths;
  const auto log = OpenLog(path, {});
  EXPECT_TRUE(log.ok()) << log.status();
  while (log.ok()) {
    const auto next = (*log)->Next();
    EXPECT_TRUE(next.ok()) << next.status();
    if (!next.ok() || !next->has_value()) break;
    const auto* const pose = std::get_if<PoseMeasurement>(&**next);
    if (pose == nullptr || pose->agent_kind != kinds::kHuman) continue;
    const Eigen::Vector3d& at = pose->pose.map_T_agent.position;
    paths[pose->pose.time_ns][PersonOf(pose->agent_name)] = {at.x(), at.y(), kTorsoM};
  }
  return paths;
}

PersonObservation Noisy(const Eigen::Vector3d& torso, Random* random) {
  const Eigen::Vector3d noise(kReplaySigmaM * random->Normal(), kReplaySigmaM * random->Normal(),
                              0.0);
  return ObservationAt(torso + noise, kReplaySigmaM);
}

Box3d Area(const Paths& paths) {
  Box3d area;
  for (const auto& [time_ns, people] : paths) {
    for (const auto& [name, at] : people) area.extend(at);
  }
  return area;
}

PeopleLog MakeDetections(const Paths& paths) {
  Random random(kSeed, 0);
  const Box3d area = Area(paths);
  std::map<std::string, int> human_of;
  PeopleLog log;
  for (const auto& [time_ns, people] : paths) {
    log.images[time_ns];
    for (const auto& [name, torso] : people) {
      const int human = human_of.emplace(name, static_cast<int>(human_of.size())).first->second;
      if (random.Chance(kMissRate)) continue;
      AddDetection(time_ns, human, torso, Noisy(torso, &random), &log);
    }
    if (random.Chance(kFalsePerImage)) {
      const Eigen::Vector3d at(random.Uniform(area.min().x(), area.max().x()),
                               random.Uniform(area.min().y(), area.max().y()), kTorsoM);
      AddDetection(time_ns, -1, at, ObservationAt(at, kReplaySigmaM), &log);
    }
    // Ids in the order of the table would be half an identity.
    std::vector<PersonObservation>& image = log.images[time_ns];
    for (size_t i = image.size(); i > 1; --i) {
      const auto j = static_cast<size_t>(random.Index(static_cast<int>(i)));
      std::swap(image[i - 1], image[j]);
      std::swap(image[i - 1].detection_id, image[j].detection_id);
    }
  }
  return log;
}

void Print(const char* scene, const char* who, const evaluation::HumanResult& result) {
  std::printf(
      "%-14s %-8s IDF1 %.3f  MOTA %.3f  switches %5d  error %.3f m (raw %.3f)  tracks/human %.2f "
      " false poses %d\n",
      scene, who, result.idf1.value_or(-1.0), result.mota.value_or(-1.0),
      static_cast<int>(result.id_switch_count), result.tracked_m.value_or(-1.0),
      result.raw_m.value_or(-1.0), result.tracks_per_human.value_or(-1.0),
      static_cast<int>(result.unexplained_pose_count));
}

struct Scene {
  const char* name;
  const char* path;
};

class PeopleReplay : public testing::TestWithParam<Scene> {};

TEST_P(PeopleReplay, BeatsNearestNeighbours) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  const Paths paths = ReadPaths((DataFolder() / GetParam().path).string());
  const PeopleLog log = MakeDetections(paths);
  std::printf("%s: %zu images, %zu detections, seed %d\n", GetParam().name, log.images.size(),
              log.truth.size(), static_cast<int>(kSeed));
  const evaluation::HumanResult nearest = ScoreNearestNeighbour(log, {});
  TrackerOptions options;
  // The noise is white.
  options.torso.lasting_share = 0.0;
  const evaluation::HumanResult ours = TrackAndScore(log, options);
  Print(GetParam().name, "nearest", nearest);
  Print(GetParam().name, "ours", ours);
  ASSERT_TRUE(ours.idf1.has_value() && nearest.idf1.has_value());
  EXPECT_GT(*ours.idf1, *nearest.idf1);
  EXPECT_LT(*ours.tracked_m, *ours.raw_m);
}

INSTANTIATE_TEST_SUITE_P(
    Data, PeopleReplay,
    testing::Values(Scene{"eth", "people-eth-ucy/eth/obsmat.txt"},
                    Scene{"zara01", "people-eth-ucy/zara01/obsmat.txt"},
                    Scene{"zara03", "people-eth-ucy/zara03/crowds_zara03.txt"},
                    Scene{"students003", "people-eth-ucy/students003/students003.txt"},
                    Scene{"lcas", "people-lcas/lcas.ndjson"},
                    Scene{"thor_magni", "people-thor-magni/Scenario_5.csv"}),
    [](const testing::TestParamInfo<Scene>& scene) { return std::string(scene.param.name); });

}  // namespace
}  // namespace dsg::ingest
