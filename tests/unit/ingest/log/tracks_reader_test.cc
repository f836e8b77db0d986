// SPDX-License-Identifier: Apache-2.0
// The log that dsg-simulate writes: a world and tracks, times from the map's epoch.
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

constexpr char kTracks[] =
    "time_ns,agent,kind,x,y,z,qx,qy,qz,qw\n"
    "0,anna,human,1,2,0,,,,\n"
    "100,r2,robot,0.5,0,0.2,0,0,0.70710678,0.70710678\n"
    "200,anna,human,1.5,2,0,,,,\n";

GraphDelta World() {
  GraphDelta world;
  Node room;
  room.id = NodeId('R', 1);
  room.layer = layers::kRooms;
  room.kind = kinds::kRoom;
  room.valid.from_ns = 50;
  world.nodes.push_back(room);
  return world;
}

TEST(TracksReader, YieldsTheWorldFirstAndShiftsTimesByTheEpoch) {
  const TempFolder folder;
  folder.Write("map.json", DeltaToJson(World()));
  folder.Write("tracks.csv", kTracks);
  LogOptions options;
  options.epoch_ns = 1000;
  options.agent_prefix = "x-";
  const auto log = ReadAll(folder.Path(""), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "dsg-tracks");
  EXPECT_FALSE(log->info.has_clock);
  EXPECT_EQ(log->info.measurement_count, 4);
  ASSERT_EQ(log->graphs.size(), 1u);
  const Node& room = log->graphs[0].delta.nodes.at(0);
  EXPECT_EQ(room.valid, (Interval{1050, kTimeMax}));
  ASSERT_EQ(log->poses.size(), 3u);
  EXPECT_EQ(log->poses[0].agent_name, "x-anna");
  EXPECT_EQ(log->poses[0].pose.time_ns, 1000);
  EXPECT_EQ(log->poses[0].pose.flags, pose_flags::kNoOrientation);
  EXPECT_EQ(log->poses[1].agent_kind, kinds::kRobot);
  EXPECT_EQ(log->poses[1].pose.flags, 0u);
  EXPECT_NEAR(log->poses[1].pose.map_T_agent.orientation.norm(), 1.0, 1e-12);
  EXPECT_EQ(log->poses[2].pose.map_T_agent.position, Eigen::Vector3d(1.5, 2, 0));
}

TEST(TracksReader, ReadsTracksWithoutAWorldAndSaysSo) {
  const TempFolder folder;
  folder.Write("tracks.csv", kTracks);
  const auto log = ReadAll(folder.Path(""));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(log->graphs.empty());
  EXPECT_EQ(log->info.notes.size(), 1u);
}

TEST(TracksReader, IdentityCoversTheWorld) {
  const TempFolder with;
  with.Write("map.json", DeltaToJson(World()));
  with.Write("tracks.csv", kTracks);
  const TempFolder without;
  without.Write("tracks.csv", kTracks);
  EXPECT_NE(ReadAll(with.Path(""))->info.content_sha256,
            ReadAll(without.Path(""))->info.content_sha256);
}

TEST(TracksReader, RefusesAWorldThatIsNoDelta) {
  const TempFolder folder;
  folder.Write("map.json", "{\"nodes\": 7}");
  folder.Write("tracks.csv", kTracks);
  const absl::Status status = ReadAll(folder.Path("")).status();
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
  EXPECT_NE(std::string(status.message()).find("map.json"), std::string::npos) << status;
}

}  // namespace
}  // namespace dsg::ingest
