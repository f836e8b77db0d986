// SPDX-License-Identifier: Apache-2.0
// Loop closures while the recording is written: each is told once both its stamps have been read.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "ingest/log/loop_file.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/follow_test_util.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

using std::chrono::milliseconds;

constexpr char kTopic[] = "/dsg/loop_closures";

std::string LoopLine(TimeNs from_ns, TimeNs to_ns) {
  return absl::StrCat("{\"from_ns\": ", from_ns, ", \"to_ns\": ", to_ns,
                      ", \"translation\": [1, 0, 0], \"rotation\": [0, 0, 0, 1], "
                      "\"sigma_m\": 0.1, \"sigma_rad\": 0.01}");
}

// Seconds after the begin.
std::string LoopLineAt(double from_s, double to_s) {
  return LoopLine(kT0 + static_cast<TimeNs>(from_s * 1e9), kT0 + static_cast<TimeNs>(to_s * 1e9));
}

class FollowedLoops : public testing::Test {
 protected:
  // Ten seconds of sensors at 20 Hz.
  FollowedLoops() : recording_(SmallRecording(CdrWriter(), 200)) {}

  void Record(double at_s, const std::string& line, const std::string& topic = kTopic) {
    const TimeNs time_ns = kT0 + static_cast<TimeNs>(at_s * 1e9);
    const auto at = std::find_if(recording_.begin(), recording_.end(),
                                 [&](const RecordedMessage& any) { return any.time_ns > time_ns; });
    recording_.insert(at, {topic, "std_msgs/String", time_ns, StringFields(CdrWriter(), line)});
  }
  absl::StatusOr<WholeLog> Finished(const LogOptions& options = {}) {
    return ReadAll(folder_.Write("whole/log.mcap", WriteMcap(recording_)), options);
  }
  absl::StatusOr<WholeLog> Followed(LogOptions options = {}) {
    options.follow = Following(milliseconds(0)).follow;
    return ReadAllWithEnd(folder_.Write("log.mcap", WriteMcap(recording_)), options);
  }

  TempFolder folder_;
  Recording recording_;
};

// What comes behind a loop closure is later than both its stamps.
void ExpectAfterTheirStamps(const WholeLog& log) {
  TimeNs next_ns = kTimeMax;
  size_t loop = log.loops.size();
  for (size_t i = log.order.size(); i-- > 0;) {
    if (log.order[i].first != "loops0") {
      next_ns = log.order[i].second;
      continue;
    }
    const LoopMeasurement& closure = log.loops[--loop];
    EXPECT_GT(next_ns, std::max(closure.from_ns, closure.time_ns)) << closure.origin;
  }
  EXPECT_EQ(loop, 0u);
}

TEST_F(FollowedLoops, OfATopicThatComesLateAreThoseOfTheFinishedFile) {
  Record(4.5, LoopLineAt(1.0, 4.0));
  Record(6.3, LoopLineAt(0.5, 6.0));
  Record(6.4, LoopLineAt(0.25, 6.0));
  Record(8.0, LoopLineAt(2.0, 7.513));
  const auto whole = Finished();
  const auto followed = Followed();
  ASSERT_TRUE(whole.ok() && followed.ok()) << whole.status() << followed.status();
  ASSERT_EQ(followed->loops.size(), 4u);
  EXPECT_EQ(followed->order, whole->order);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(followed->loops[i].from_ns, whole->loops[i].from_ns);
    EXPECT_EQ(followed->loops[i].origin, whole->loops[i].origin);
    EXPECT_EQ(followed->loops[i].from_T_to.position, Eigen::Vector3d(1, 0, 0));
  }
  ExpectAfterTheirStamps(*followed);
  EXPECT_FALSE(HasNote(followed->info, "were not read: /dsg"));
}

TEST_F(FollowedLoops, ThatAreFoundLateAreToldWhenTheyCome) {
  Record(9.5, LoopLineAt(1.0, 4.0));
  Record(5.0, LoopLineAt(8.0, 2.0));
  const auto log = Followed();
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->loops.size(), 2u);
  ExpectAfterTheirStamps(*log);
  // The one waited for its later stamp; of the other both were read long before.
  EXPECT_EQ(log->loops[0].from_ns, kT0 + 8000 * kMillisecond);
  const auto second =
      std::find(log->order.begin(), log->order.end(),
                std::pair<std::string, TimeNs>("loops0", kT0 + 4000 * kMillisecond));
  ASSERT_NE(second, log->order.end());
  EXPECT_LT(std::prev(second)->second, kT0 + 9500 * kMillisecond);
}

TEST_F(FollowedLoops, OfAFileAreToldWhenTheirStampsHaveBeenRead) {
  LogOptions options;
  options.loop_file = folder_.Write(
      "loops.jsonl", absl::StrCat(LoopLineAt(0.5, 6.0), "\n", LoopLineAt(1.0, 4.0), "\n",
                                  LoopLineAt(2.0, 7.513), "\n", LoopLineAt(0.1, 6.0), "\n"));
  // In their place, those of the topic do not count.
  Record(2.0, LoopLineAt(0.0, 1.0));
  Record(5.0, LoopLineAt(0.0, 1.0));
  const auto whole = Finished(options);
  const auto followed = Followed(options);
  ASSERT_TRUE(whole.ok() && followed.ok()) << whole.status() << followed.status();
  ASSERT_EQ(followed->loops.size(), 4u);
  EXPECT_EQ(followed->order, whole->order);
  ExpectAfterTheirStamps(*followed);
  EXPECT_EQ(followed->info.channel_counts.at("loops0"), 4);
  // They are part of the log's identity.
  const std::string identity = followed->info.content_sha256;
  EXPECT_EQ(Followed(options)->info.content_sha256, identity);
  options.loop_file = folder_.Write("other.jsonl", LoopLineAt(0.5, 6.0));
  EXPECT_NE(Followed(options)->info.content_sha256, identity);
}

TEST_F(FollowedLoops, OutsideOfTheLogComeAtItsEnd) {
  Record(5.0, LoopLine(kT0, kT0 + 1'000'000 * kMillisecond));
  Record(5.0, LoopLine(INT64_MAX - 1, kT0));
  Record(5.0, LoopLine(1, 2));
  for (const auto& log : {Finished(), Followed()}) {
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->loops.size(), 3u);
    EXPECT_EQ(log->images.size(), 600u);
    EXPECT_EQ(log->info.first_ns, kT0) << "a stray stamp is no begin of a map";
  }
  const auto followed = Followed();
  ASSERT_TRUE(followed.ok());
  EXPECT_EQ(followed->order.back().first, "loops0");
  EXPECT_EQ(followed->loops[0].time_ns, 2) << "both stamps lie before all that was read";
}

TEST_F(FollowedLoops, RefuseTheSameLinesAsOfAFinishedFile) {
  Record(4.0, LoopLineAt(1.0, 2.0));
  Record(5.0, "{\"from_ns\": 1");
  const auto whole = Finished();
  const auto followed = Followed();
  for (const absl::Status& status : {whole.status(), followed.status()}) {
    ExpectMalformedFile(status, {"/dsg/loop_closures message 2", "is no JSON object"});
  }
  LogOptions options;
  options.loop_file = folder_.Write("loops.jsonl", LoopLineAt(1.0, 1.0));
  ExpectMalformedFile(Followed(options).status(), {"loops.jsonl:1", "joins two instants"});
  options.loop_file = folder_.Path("none.jsonl");
  EXPECT_TRUE(absl::IsNotFound(Followed(options).status()));
}

TEST_F(FollowedLoops, CanBeNamedAndLeftOut) {
  Record(5.0, LoopLineAt(1.0, 4.0), "/places");
  LogOptions options;
  EXPECT_TRUE(Followed()->loops.empty());
  EXPECT_TRUE(HasNote(Followed()->info, "were not read: /places"));
  options.topics["loops0"] = "/places";
  const auto named = Followed(options);
  ASSERT_TRUE(named.ok()) << named.status();
  EXPECT_EQ(named->loops.size(), 1u);
  Record(6.0, LoopLineAt(1.0, 4.0));
  EXPECT_EQ(Followed(options)->loops.size(), 1u);
  options.topics["loops0"] = kNoTopic;
  EXPECT_TRUE(Followed(options)->loops.empty());
  EXPECT_FALSE(Followed(options)->info.channel_counts.contains("loops0"));
}

TEST_F(FollowedLoops, OfARecordingWithoutEyesMustBeNamedOrThere) {
  std::erase_if(recording_, [](const RecordedMessage& message) {
    return message.topic != "/tesse/odom" && message.topic != "/chatter";
  });
  Record(5.0, LoopLineAt(1.0, 4.0));
  const auto log = Followed();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_FALSE(log->info.channel_counts.contains("loops0"));
  EXPECT_TRUE(log->loops.empty());
  EXPECT_TRUE(HasNote(log->info, "were not read: /dsg/loop_closures"));
  LogOptions options;
  options.topics["loops0"] = kTopic;
  EXPECT_EQ(Followed(options)->loops.size(), 1u);
  Record(1.0, LoopLineAt(0.0, 0.5));
  EXPECT_EQ(Followed()->loops.size(), 2u);
}

TEST(LoopQueue, GivesThemByTheirLaterStamp) {
  LoopQueue queue;
  const auto add = [&queue](TimeNs from_ns, TimeNs to_ns) {
    LoopMeasurement loop;
    loop.from_ns = from_ns;
    loop.time_ns = to_ns;
    loop.origin = absl::StrCat(from_ns, " ", to_ns);
    queue.Add(std::move(loop));
  };
  add(9, 2);
  add(1, 8);
  add(0, 8);
  add(3, 4);
  EXPECT_EQ(queue.first_ns(), 4);
  std::string order;
  while (!queue.empty()) absl::StrAppend(&order, queue.Take().origin, ", ");
  EXPECT_EQ(order, "3 4, 0 8, 1 8, 9 2, ");
}

TEST(FollowedLoop, DoesNotGoWithATable) {
  const TempFolder folder;
  LogOptions options = Following(milliseconds(0));
  options.loop_file = folder.Write("loops.jsonl", LoopLineAt(1.0, 2.0));
  const absl::Status refused =
      OpenLog(folder.Write("log.txt", "1.5 1 2 3 0 0 0 1\n"), options).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid) << refused;
  EXPECT_NE(refused.message().find("takes no loop closures"), std::string::npos) << refused;
}

}  // namespace
}  // namespace dsg::ingest
