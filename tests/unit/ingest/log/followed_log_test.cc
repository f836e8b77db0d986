// SPDX-License-Identifier: Apache-2.0
// Logs that are read while they are written: the same as when they are finished, in whatever pieces
// they come.
#include "ingest/log/followed_log.h"

#include <zlib.h>

#include <algorithm>
#include <atomic>
#include <random>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/follow_test_util.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

using std::chrono::milliseconds;

struct TableCase {
  std::string format;
  std::string text;
};

// Some 40 instants of every format, agents of one instant not in the order of their names.
std::vector<TableCase> Tables() {
  std::vector<TableCase> tables = {
      {"obsmat", ""},
      {"trajnet", ""},
      {"trajnet-ndjson", ""},
      {"tum", "# timestamp tx ty tz qx qy qz qw\n"},
      {"euroc",
       "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
       "q_RS_z []\n"},
      {"csv", "time,id,x,y,mood\n"},
      {"dsg-tracks", "time_ns,agent,kind,x,y,z,qx,qy,qz,qw\n"}};
  for (int i = 0; i < 40; ++i) {
    const double x = 0.125 * i;
    const int64_t t = kT0 + int64_t{i} * 100'000'000;
    absl::StrAppend(&tables[3].text, 1'600'000'000 + i, ".5 ", x, " 2 0 0 0 0 1\n");
    absl::StrAppend(&tables[4].text, t, ",", x, ",2,0,1,0,0,0\n");
    for (const int person : {12, 7, 3}) {
      if (person == 3 && i < 20) continue;
      const int frame = 780 + 6 * i;
      absl::StrAppend(&tables[0].text, frame, " ", person, " ", x, " 0 2 0 0 0\n");
      absl::StrAppend(&tables[1].text, frame, " ", person, " ", x, " 2\n");
      absl::StrAppend(&tables[2].text, "{\"track\": {\"f\": ", frame, ", \"p\": ", person,
                      ", \"x\": ", x, ", \"y\": 2}}\n");
      absl::StrAppend(&tables[5].text, 0.25 * i, ",p", person, ",", x, ",2,calm\n");
      absl::StrAppend(&tables[6].text, i * 100, ",p", person, ",human,", x, ",2,0,,,,\n");
    }
  }
  return tables;
}

TEST(FollowedTable, GivesWhatTheFinishedFileGives) {
  for (const TableCase& table : Tables()) {
    SCOPED_TRACE(table.format);
    const TempFolder folder;
    const auto whole = ReadAll(folder.Write("whole.txt", table.text));
    ASSERT_TRUE(whole.ok()) << whole.status();
    ASSERT_EQ(whole->info.format, table.format);
    // From an empty file on, and as a file that has been written.
    for (const bool is_there : {false, true}) {
      const std::string path = folder.Write("log.txt", is_there ? table.text : "");
      const SlowWriter writer(path, is_there ? "" : table.text, 120);
      const auto followed = ReadAll(path, Following(milliseconds(is_there ? 0 : 400)));
      ASSERT_TRUE(followed.ok()) << followed.status();
      EXPECT_EQ(followed->info.format, table.format);
      EXPECT_EQ(followed->info.has_clock, whole->info.has_clock);
      EXPECT_EQ(followed->info.clock, whole->info.clock);
      EXPECT_EQ(followed->info.first_ns, whole->info.first_ns);
      ExpectSamePoses(*followed, *whole);
    }
  }
}

TEST(FollowedTable, IsTheSameLogHoweverMuchWasThere) {
  for (const TableCase& table : Tables()) {
    SCOPED_TRACE(table.format);
    const TempFolder folder;
    const auto identity = [&](const std::string& text) {
      const auto log = OpenLog(folder.Write("log.txt", text), Following(milliseconds(0)));
      EXPECT_TRUE(log.ok()) << log.status();
      return log.ok() ? (*log)->info().content_sha256 : "";
    };
    const std::string all = identity(table.text);
    for (const double part : {0.4, 0.7}) {
      EXPECT_EQ(identity(table.text.substr(
                    0, static_cast<size_t>(part * static_cast<double>(table.text.size())))),
                all);
    }
    const bool has_header = table.text[0] == '#' || table.text[0] == 't';
    const size_t first_row = table.text.find('0', has_header ? table.text.find('\n') : 0);
    // Another first row alone: with the others the order of time would be lost.
    std::string other = table.text.substr(0, table.text.find('\n', first_row) + 1);
    other[first_row] = '1';
    EXPECT_NE(identity(other), all);
  }
}

constexpr char kRow1[] = "1.5 1 2 3 0 0 0 1\n";
constexpr char kRow2[] = "2.5 1 2 3 0 0 0 1\n";

TEST(FollowedTable, LeavesAHalfLineAlone) {
  const TempFolder folder;
  const std::string path = folder.Write("log.txt", absl::StrCat(kRow1, "2.0 1 2 3 0 0 0 0.99999"));
  const auto log = ReadAll(path, Following(milliseconds(50)));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 1u);
  const auto opened = OpenLog(path, Following(milliseconds(50)));
  ASSERT_TRUE(opened.ok());
  while (true) {
    const auto next = (*opened)->Next();
    ASSERT_TRUE(next.ok());
    if (!next->has_value()) break;
  }
  EXPECT_TRUE(HasNote((*opened)->info(), "the last line has no end and was not read"));
}

TEST(FollowedTable, EndsWhenItIsStopped) {
  const TempFolder folder;
  const std::string path = folder.Write("log.txt", kRow1);
  std::atomic<bool> stop = false;
  int idle_count = 0;
  LogOptions options;
  options.follow = FollowOptions{.timeout = {}, .stop = &stop};
  const auto log = OpenLog(path, options);
  ASSERT_TRUE(log.ok()) << log.status();
  (*log)->SetIdle([&] {
    stop = ++idle_count == 3;
    return absl::OkStatus();
  });
  ASSERT_TRUE((*log)->Next()->has_value());
  const auto end = (*log)->Next();
  ASSERT_TRUE(end.ok()) << end.status();
  EXPECT_FALSE(end->has_value());
  EXPECT_EQ(idle_count, 3);
}

TEST(FollowedTable, RefusesAFileThatIsNoLongerTheSame) {
  const auto change = [](const std::function<void(const std::string&)>& how,
                         const std::string& words) {
    const TempFolder folder;
    const std::string path = folder.Write("log.txt", absl::StrCat(kRow1, kRow2));
    const auto log = OpenLog(path, Following(milliseconds(2000)));
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_TRUE((*log)->Next()->has_value());
    EXPECT_TRUE((*log)->Next()->has_value());
    how(path);
    ExpectMalformedFile((*log)->Next().status(), {"log.txt", words, "while it was followed"});
  };
  change([](const std::string& path) { std::filesystem::resize_file(path, 20); },
         "has shrunk from 36 to 20 bytes");
  change([](const std::string& path) { std::filesystem::remove(path); }, "was removed");
  change(
      [](const std::string& path) {
        std::ofstream(path + ".new") << kRow1 << kRow2 << "3.0 1 2 3 0 0 0 1\n";
        std::filesystem::rename(path + ".new", path);
      },
      "replaced by another file");
  change(
      [](const std::string& path) {
        // In one step, as somebody who looks twice a second sees it.
        std::fstream(path) << "7.0 1 2 3 0 0 0 1\n8.0 1 2 3 0 0 0 1\n9.0 1 2 3 0 0 0 1\n";
      },
      "written anew");
}

TEST(FollowedTable, RefusesWrongRowsWithTheirLines) {
  const TempFolder folder;
  const auto append = [&](const std::string& rows, const std::vector<std::string>& words) {
    const std::string path = folder.Write("log.txt", absl::StrCat("\n", kRow1, kRow2));
    const auto log = OpenLog(path, Following(milliseconds(2000)));
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_TRUE((*log)->Next()->has_value());
    EXPECT_TRUE((*log)->Next()->has_value());
    Append(path, rows);
    absl::StatusOr<std::optional<Measurement>> next = (*log)->Next();
    while (next.ok() && next->has_value()) next = (*log)->Next();
    ExpectMalformedFile(next.status(), words);
  };
  append("3.0 1 2 3 0 0 0 1\n2.7 1 2 3 0 0 0 1\n", {"log.txt:5", "in the order of time"});
  append("3.0 nan 2 3 0 0 0 1\n", {"log.txt:4", "nan"});
  append("3.0 1 2\n", {"log.txt:4", "3"});
  append(std::string((1 << 20) + 1, '1'), {"a line of more than 1048576 bytes"});
}

TEST(FollowedTable, PassesOverRareRepeats) {
  const TempFolder folder;
  const std::string path = folder.Write("log.txt", absl::StrCat(kRow1, kRow1, kRow2));
  const auto log = ReadAll(path, Following(milliseconds(0)));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 2u);
  LogOptions strict = Following(milliseconds(0));
  strict.is_strict = true;
  ExpectMalformedFile(ReadAll(path, strict).status(), {"log.txt:2", "told of twice"});
  std::string rows;
  for (int i = 0; i < 1200; ++i) absl::StrAppend(&rows, i / 2, ".5 1 2 3 0 0 0 1\n");
  ExpectMalformedFile(ReadAll(folder.Write("many.txt", rows), Following(milliseconds(0))).status(),
                      {"many.txt:1000", "told of twice"});
}

TEST(FollowedTable, SaysWhenThereIsNoRow) {
  const TempFolder folder;
  for (const std::string text : {"", "# nothing\n", "time,id,x,y\n", "1.0 1 2"}) {
    ExpectMalformedFile(
        ReadAll(folder.Write("log.txt", text), Following(milliseconds(20))).status(),
        {"ends before its first row"});
  }
  EXPECT_TRUE(absl::IsNotFound(OpenLog(folder.Path("none"), Following(milliseconds(0))).status()));
}

TEST(FollowedLog, SaysWhatCannotBeFollowed) {
  const TempFolder folder;
  const auto refuse = [](const std::string& path, const std::string& words,
                         LogOptions options = Following(milliseconds(50))) {
    const absl::Status refused = OpenLog(path, options).status();
    EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid) << refused;
    EXPECT_NE(refused.message().find(words), std::string::npos) << refused;
  };
  refuse("-", "standard input is read to its end");
  refuse(folder.Path(""), "is a folder");
  refuse(folder.Write("log.gz", "\x1f\x8b\x08 and so on"), "is packed");
  refuse(folder.Write("log.bag", "#ROSBAG V2.0\n"), "only MCAP files can be followed");
  refuse(folder.Write("log.json", "{\"nodes\": []}\n\n\n\n\n"), "cannot be followed");
  LogOptions with_poses = Following(milliseconds(50));
  with_poses.pose_file = "poses.txt";
  refuse(folder.Write("log.txt", kRow1), "does not go with --follow", with_poses);
  LogOptions as_mcap = Following(milliseconds(50));
  as_mcap.format = "mcap";
  ExpectMalformedFile(OpenLog(folder.Path("log.txt"), as_mcap).status(), {"is no mcap"});
}

TEST(FollowedBag, GivesWhatTheFinishedFileGives) {
  for (const std::string compression : {"zstd", "plain"}) {
    for (const bool has_index : {true, false}) {
      SCOPED_TRACE(absl::StrCat(compression, has_index ? " with" : " without", " index"));
      const TempFolder folder;
      const std::string bytes =
          WriteMcap(TenSeconds(),
                    {.compression = compression, .has_index = has_index, .messages_per_chunk = 37});
      const auto whole = ReadAll(folder.Write("whole.mcap", bytes));
      ASSERT_TRUE(whole.ok()) << whole.status();
      const std::string path = folder.Write("log.mcap", "");
      const SlowWriter writer(path, bytes, 4000);
      // It ends by its own end, long before the timeout.
      const auto followed = ReadAll(path, Following(milliseconds(60'000)));
      ASSERT_TRUE(followed.ok()) << followed.status();
      EXPECT_EQ(followed->order, whole->order);
      EXPECT_EQ(followed->info.first_ns, whole->info.first_ns);
      EXPECT_EQ(followed->info.rig.cameras.size(), whole->info.rig.cameras.size());
      ExpectSamePoses(*followed, *whole);
      ASSERT_EQ(followed->images.size(), whole->images.size());
      for (size_t i = 0; i < whole->images.size(); ++i) {
        EXPECT_EQ(followed->images[i].load()->bytes, whole->images[i].load()->bytes);
      }
    }
  }
}

TEST(FollowedBag, IsTheSameLogHoweverMuchWasThere) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(TenSeconds());
  const auto identity = [&](const std::string& some) {
    const auto log = OpenLog(folder.Write("log.mcap", some), Following(milliseconds(0)));
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? (*log)->info().content_sha256 : "";
  };
  const std::string all = identity(bytes);
  for (const double part : {0.4, 0.7, 0.99}) {
    EXPECT_EQ(
        identity(bytes.substr(0, static_cast<size_t>(part * static_cast<double>(bytes.size())))),
        all);
  }
  Recording other = TenSeconds();
  other[19].data[8] = static_cast<char>(other[19].data[8] ^ 1);
  EXPECT_NE(identity(WriteMcap(other)), all);
  // The same recording, taken when it is finished, is another session.
  EXPECT_NE(ReadAll(folder.Write("log.mcap", bytes))->info.content_sha256, all);
}

TEST(FollowedBag, EndsAfterATimeWithoutGrowth) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(TenSeconds());
  const std::string path = folder.Write("log.mcap", bytes.substr(0, bytes.size() / 2));
  const auto log = ReadAll(path, Following(milliseconds(50)));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_GT(log->poses.size(), 60u);
  EXPECT_LT(log->poses.size(), 140u);
}

TEST(FollowedBag, HoldsBackWhatMayBeOvertaken) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(TenSeconds());
  const std::string path = folder.Write("log.mcap", bytes.substr(0, bytes.size() / 2));
  const auto newest_ns = [&](TimeNs late_ns) {
    LogOptions options = Following(milliseconds(60'000));
    options.follow->late_ns = late_ns;
    const auto log = OpenLog(path, options);
    EXPECT_TRUE(log.ok()) << log.status();
    (*log)->SetIdle([] { return absl::CancelledError("it waits"); });
    TimeNs time_ns = 0;
    auto next = (*log)->Next();
    for (; next.ok() && next->has_value(); next = (*log)->Next()) time_ns = StampOf(**next);
    EXPECT_TRUE(absl::IsCancelled(next.status())) << next.status();
    return static_cast<double>(time_ns);
  };
  // Twenty of each topic in a second.
  EXPECT_NEAR(newest_ns(200'000'000) - newest_ns(kNsPerSecond), 8e8, 6e7);
}

TEST(FollowedBag, RefusesWhatComesLaterThanTold) {
  const TempFolder folder;
  Recording recording = TenSeconds();
  for (RecordedMessage& message : recording) {
    if (message.topic == "/tesse/odom") message.time_ns += 300'000'000;
  }
  std::stable_sort(recording.begin(), recording.end(),
                   [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
  const std::string path = folder.Write("log.mcap", WriteMcap(recording));
  LogOptions options = Following(milliseconds(0));
  EXPECT_TRUE(ReadAll(path, options).ok());
  options.follow->late_ns = 200'000'000;
  ExpectMalformedFile(ReadAll(path, options).status(), {"/tesse/odom", "more than 0.2 s before"});
}

TEST(FollowedBag, NeedsItsFirstSecondsOrItsEnd) {
  const TempFolder folder;
  const Recording two_seconds = SmallRecording(CdrWriter(), 40);
  const std::string bytes = WriteMcap(two_seconds);
  const auto closed = ReadAll(folder.Write("log.mcap", bytes), Following(milliseconds(0)));
  ASSERT_TRUE(closed.ok()) << closed.status();
  EXPECT_EQ(closed->poses.size(), 40u);
  const std::string open = bytes.substr(0, bytes.size() / 2);
  ExpectMalformedFile(ReadAll(folder.Write("log.mcap", open), Following(milliseconds(20))).status(),
                      {"log.mcap", "within the first 3 s"});
  ExpectMalformedFile(
      ReadAll(folder.Write("log.mcap", bytes.substr(0, 9)), Following(milliseconds(20))).status(),
      {"log.mcap", "within the first 3 s"});
}

TEST(FollowedBag, SaysWhichTopicsCameTooLate) {
  const TempFolder folder;
  Recording recording = TenSeconds();
  recording.push_back({"/late", "std_msgs/String", recording.back().time_ns + 1,
                       StringFields(CdrWriter(), "hello")});
  const auto opened =
      OpenLog(folder.Write("log.mcap", WriteMcap(recording)), Following(milliseconds(0)));
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_FALSE(HasNote((*opened)->info(), "/late"));
  while (true) {
    const auto next = (*opened)->Next();
    ASSERT_TRUE(next.ok()) << next.status();
    if (!next->has_value()) break;
  }
  EXPECT_TRUE(HasNote((*opened)->info(), "were not read: /late"));
}

TEST(FollowedBag, RefusesDamage) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(TenSeconds(), {.compression = "lz4"});
  constexpr unsigned kSeed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  int refused_count = 0;
  for (int i = 0; i < 200; ++i) {
    std::string damaged = bytes;
    damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    const auto log = ReadAll(folder.Write("log.mcap", damaged), Following(milliseconds(0)));
    if (log.ok()) continue;
    ++refused_count;
    EXPECT_NE(log.status().message().find("log.mcap"), std::string::npos) << log.status();
  }
  EXPECT_GT(refused_count, 100);
  std::string endless = bytes;
  const size_t first_record = 8;
  endless[first_record + 1 + 6] = '\x7f';
  ExpectMalformedFile(
      ReadAll(folder.Write("log.mcap", endless), Following(milliseconds(0))).status(),
      {"byte 8", "a record claims"});
}

}  // namespace
}  // namespace dsg::ingest
