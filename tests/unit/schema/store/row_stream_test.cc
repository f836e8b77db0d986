// SPDX-License-Identifier: Apache-2.0
// Maps that go as rows from one backend to another: tracks that were corrected in every way, what
// a robot may ask of the copy, and rows that make no map.
#include "schema/store/row_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "tests/support/random_world.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

void ExpectEqualCopies(TestMap& map, bool answers = true) {
  const auto rows = OrDie(ReadAllRows(&map.reader()));
  for (const std::string& backend : Backends()) {
    SCOPED_TRACE(absl::StrCat("copy in ", backend));
    MapOfRows copy(backend, map.reader().spec(), rows);
    ExpectEqualMaps(&map.reader(), &copy.reader(), answers);
    if (testing::Test::HasFailure()) return;
  }
}

class RowStream : public OnEveryBackend {
 protected:
  RowStream() {
    for (int64_t s = 1; s <= 20; ++s) OrDie(map_.writer().Commit(DeltaOfStream({}, s)));
  }

  // What InstallRows of some backend says, after which there is no map.
  absl::Status Refusal(const std::vector<StreamRow>& rows, const StopCheck& stop = {}) {
    TempFolder folder;
    const auto store = OrDie(OpenStore(UriOf(GetParam(), folder.path()), {.create = true}));
    const std::string scratch = folder.path() + "/.scratch";
    std::filesystem::create_directories(scratch);
    const absl::Status status =
        store->InstallRows(map_.reader().spec(), SourceOf(rows), scratch, false, stop);
    EXPECT_EQ(OrDie(store->MapNames()).empty(), !status.ok());
    return status;
  }

  std::vector<StreamRow> Rows() { return OrDie(ReadAllRows(&map_.reader())); }

  TestMap map_{GetParam()};
};
DSG_ON_EVERY_BACKEND(RowStream);

// The last row of a kind.
StreamRow& LastOf(char kind, std::vector<StreamRow>* rows) {
  const auto found = std::find_if(rows->rbegin(), rows->rend(),
                                  [&](const StreamRow& row) { return row.kind == kind; });
  return *found;
}

TEST_P(RowStream, OfAMapWithoutRevisionsIsOneToo) {
  TestMap empty(GetParam());
  ExpectEqualCopies(empty);
}

TEST_P(RowStream, TheCopyGoesOnAsTheMapDoes) {
  const auto rows = Rows();
  for (const std::string& backend : Backends()) {
    SCOPED_TRACE(backend);
    TestMap map(GetParam());
    for (int64_t s = 1; s <= 20; ++s) OrDie(map.writer().Commit(DeltaOfStream({}, s)));
    MapOfRows copy(backend, map.reader().spec(), rows);
    const CommitResult again = OrDie(copy.writer().Commit(DeltaOfStream({}, 20)));
    EXPECT_TRUE(again.replayed);
    EXPECT_EQ(again.revision, 20);
    GraphDelta other = DeltaOfStream({}, 20);
    other.message = "another";
    other.nodes.front().name = "another";
    EXPECT_EQ(ReasonOf(copy.writer().Commit(other).status()), Reason::kSequenceReused);
    EXPECT_EQ(ReasonOf(copy.writer().Commit(DeltaOfStream({}, 22)).status()), Reason::kSequenceGap);
    for (int64_t s = 21; s <= 60; ++s) {
      OrDie(map.writer().Commit(DeltaOfStream({}, s)));
      OrDie(copy.writer().Commit(DeltaOfStream({}, s)));
      ASSERT_EQ(OrDie(map.reader().Head()).digest, OrDie(copy.reader().Head()).digest) << s;
    }
    EXPECT_EQ(OrDie(copy.reader().Verify({}, {})).problems, std::vector<std::string>());
    EXPECT_EQ(TimelessText(OrDie(ReadAllRows(&map.reader()))),
              TimelessText(OrDie(ReadAllRows(&copy.reader()))));
  }
}

TEST_P(RowStream, AssetsOfSeveralPartsAndOfNoneComeWhole) {
  GraphDelta delta;
  for (const size_t size : {size_t{0}, kAssetPartBytes, 2 * kAssetPartBytes + 7}) {
    Asset asset;
    asset.media_type = "model/ply";
    for (size_t i = 0; i < size; ++i) asset.content.push_back(static_cast<char>(i * i >> 7));
    asset.sha256 = ComputeSha256(asset.content);
    delta.assets.push_back(asset);
  }
  map_.MustCommit(delta);
  const auto rows = Rows();
  for (const std::string& backend : Backends()) {
    MapOfRows copy(backend, map_.reader().spec(), rows);
    ExpectEqualMaps(&map_.reader(), &copy.reader(), false);
    for (const Asset& asset : delta.assets) {
      EXPECT_TRUE(OrDie(OrDie(copy.reader().Latest())->ReadAsset(asset.sha256)).content ==
                  asset.content);
    }
  }
}

TEST_P(RowStream, TagsAndCompactionGoOnInTheCopy) {
  OrDie(map_.writer().SetTag("summer", 7, "warm"));
  OrDie(map_.writer().Compact(12, {}, {}));
  const auto rows = Rows();
  for (const std::string& backend : Backends()) {
    MapOfRows copy(backend, map_.reader().spec(), rows);
    OrDie(copy.writer().RemoveTag("summer"));
    OrDie(copy.writer().Compact(15, {}, {}));
    TestMap map(GetParam());
    for (int64_t s = 1; s <= 20; ++s) OrDie(map.writer().Commit(DeltaOfStream({}, s)));
    OrDie(map.writer().Compact(15, {}, {}));
    EXPECT_EQ(OrDie(copy.reader().Verify({}, {})).problems, std::vector<std::string>());
    for (Revision r = 15; r <= 20; ++r) {
      EXPECT_EQ(OrDie(map.At(r)->Stats()).at.digest,
                OrDie(OrDie(copy.reader().At(r))->Stats()).at.digest);
    }
  }
}

TEST_P(RowStream, ThatIsStoppedLeavesNoMap) {
  const auto rows = Rows();
  for (const int last : {0, 1, 50, 200}) {
    int asked = 0;
    const StopCheck stop = [&] {
      return asked++ < last ? absl::OkStatus() : absl::CancelledError("enough");
    };
    EXPECT_TRUE(absl::IsCancelled(Refusal(rows, stop))) << last;
    asked = 0;
    const absl::Status read =
        map_.reader().ReadRows([](const StreamRow&) { return absl::OkStatus(); }, stop);
    EXPECT_TRUE(absl::IsCancelled(read)) << last << " " << read;
  }
  const absl::Status full = map_.reader().ReadRows(
      [](const StreamRow&) { return absl::ResourceExhaustedError("no space"); }, {});
  EXPECT_TRUE(absl::IsResourceExhausted(full));
}

TEST_P(RowStream, AMapThatIsThereIsReplacedOnlyWhenItMayBe) {
  const auto rows = Rows();
  TempFolder folder;
  const auto store = OrDie(OpenStore(UriOf(GetParam(), folder.path()), {.create = true}));
  OrDie(store->CreateMap(map_.reader().spec()));
  const auto install = [&](bool replace) {
    const std::string scratch = folder.path() + "/.scratch";
    std::filesystem::remove_all(scratch);
    std::filesystem::create_directories(scratch);
    return store->InstallRows(map_.reader().spec(), SourceOf(rows), scratch, replace, {});
  };
  const auto old = OrDie(store->OpenMap(kMap));
  EXPECT_EQ(ReasonOf(install(false)), Reason::kMapExists);
  {
    const auto writer = OrDie(store->OpenWriter(kMap));
    EXPECT_EQ(ReasonOf(install(true)), Reason::kWriterLocked);
  }
  EXPECT_TRUE(old->IsCurrent());
  OrDie(install(true));
  EXPECT_FALSE(old->IsCurrent());
  EXPECT_EQ(OrDie(OrDie(store->OpenMap(kMap))->Head()).revision, 20);
}

TEST_P(RowStream, ThatWasAlteredIsRefused) {
  const auto rows = Rows();
  ASSERT_TRUE(Refusal(rows).ok());
  using Rows = std::vector<StreamRow>;
  const std::pair<const char*, std::function<void(Rows*)>> harms[] = {
      {"a node gone",
       [](Rows* all) { std::erase(*all, StreamRow(LastOf(row_kinds::kNode, all))); }},
      {"a node twice", [](Rows* all) { all->push_back(StreamRow(LastOf(row_kinds::kNode, all))); }},
      {"a node that is none", [](Rows* all) { LastOf(row_kinds::kNode, all).texts[0] = "?"; }},
      {"a node of later", [](Rows* all) { ++LastOf(row_kinds::kNode, all).numbers[1]; }},
      {"an edge of no relation", [](Rows* all) { LastOf(row_kinds::kEdge, all).numbers[1] = 99; }},
      {"an edge to nothing", [](Rows* all) { LastOf(row_kinds::kEdge, all).numbers[2] = 77; }},
      {"a stay gone",
       [](Rows* all) { std::erase(*all, StreamRow(LastOf(row_kinds::kStay, all))); }},
      {"a stay that ends before", [](Rows* all) { LastOf(row_kinds::kStay, all).numbers[6] = 1; }},
      {"a block gone",
       [](Rows* all) { std::erase(*all, StreamRow(LastOf(row_kinds::kMeshBlock, all))); }},
      {"poses gone",
       [](Rows* all) { std::erase(*all, StreamRow(LastOf(row_kinds::kPoses, all))); }},
      {"poses that are none", [](Rows* all) { LastOf(row_kinds::kPoses, all).texts[0] = "?"; }},
      {"poses cut", [](Rows* all) { LastOf(row_kinds::kPoses, all).texts[0].resize(40); }},
      {"poses of another", [](Rows* all) { LastOf(row_kinds::kPoses, all).numbers[0] = 77; }},
      {"poses twice", [](Rows* all) { all->push_back(StreamRow(LastOf(row_kinds::kPoses, all))); }},
      {"factors gone",
       [](Rows* all) { std::erase(*all, StreamRow(LastOf(row_kinds::kFactors, all))); }},
      {"shapes gone",
       [](Rows* all) { std::erase(*all, StreamRow(LastOf(row_kinds::kShapes, all))); }},
      {"an asset gone",
       [](Rows* all) { std::erase(*all, StreamRow(LastOf(row_kinds::kAsset, all))); }},
      {"a revision gone",
       [](Rows* all) { std::erase(*all, StreamRow(LastOf(row_kinds::kRevision, all))); }},
      {"no digest", [](Rows* all) { LastOf(row_kinds::kRevision, all).texts[0] = "?"; }},
      {"another digest", [](Rows* all) { LastOf(row_kinds::kRevision, all).texts[0][3] ^= 1; }},
      {"another count", [](Rows* all) { ++LastOf(row_kinds::kRevision, all).numbers[4]; }},
      {"another author", [](Rows* all) { LastOf(row_kinds::kRevision, all).texts[3] = "me"; }},
  };
  for (const auto& [what, harm] : harms) {
    Rows harmed = rows;
    harm(&harmed);
    const absl::Status status = Refusal(harmed);
    EXPECT_FALSE(status.ok()) << what;
    EXPECT_FALSE(status.message().empty()) << what;
  }
}

// Times down to a nanosecond apart, corrections that insert, replace, cut and empty, rotations of
// either sign, commits of one pose, gaps: pieces and segments end where they must.
class RowStreamOfTracks : public testing::TestWithParam<std::tuple<std::string, TrajectoryCodec>> {
 protected:
  bool is_lossless() const { return std::get<1>(GetParam()) == TrajectoryCodec::kLossless; }

  TimedPose Pose(TimeNs time_ns) {
    TimedPose pose = PoseAt(time_ns, dice_.Real(-50, 50), dice_.Real(-50, 50), dice_.Real(0, 2));
    const Eigen::Vector4d q(dice_.Real(-1, 1), dice_.Real(-1, 1), dice_.Real(-1, 1),
                            dice_.Real(-1, 1));
    if (dice_.Int(0, 3) > 0) pose.map_T_agent.orientation.coeffs() = q.normalized();
    if (dice_.Int(0, 9) == 0) {
      auto covariance = std::make_shared<Covariance6>();
      covariance->fill(static_cast<float>(dice_.Real(0, 1)));
      pose.covariance = covariance;
    }
    pose.flags = static_cast<uint32_t>(dice_.Int(0, 2));
    return pose;
  }

  std::vector<TimedPose> Poses(TimeNs from_ns, TimeNs to_ns, int64_t count) {
    std::set<TimeNs> times;
    for (int64_t i = 0; i < count && to_ns > from_ns; ++i) {
      times.insert(dice_.Int(from_ns, to_ns - 1));
    }
    std::vector<TimedPose> poses;
    for (const TimeNs time_ns : times) poses.push_back(Pose(time_ns));
    return poses;
  }

  GraphDelta NextDelta() {
    GraphDelta delta;
    for (uint64_t agent = 1; agent <= 2; ++agent) {
      const NodeId id('H', agent);
      const TrackInfo track = OrDie(map_.Latest()->GetTrack(id));
      const TimeNs end_ns = track.pose_count == 0 ? 0 : track.last_ns;
      // Steps of nanoseconds, of milliseconds, and across gaps.
      const TimeNs steps[] = {400, 5'000'000, kSecond, 5 * kSecond};
      const TimeNs step = steps[dice_.Int(0, 3)];
      switch (track.pose_count == 0 ? 5 : dice_.Int(0, 5)) {
        case 0: {
          const TimeNs from_ns = dice_.Int(-kSecond, std::max<TimeNs>(end_ns, 1));
          const TimeNs to_ns = std::min(from_ns + dice_.Int(1, 4) * step, end_ns + 1);
          if (to_ns <= from_ns) break;
          delta.corrections.push_back(
              {id, from_ns, to_ns, Poses(from_ns, to_ns, dice_.Int(0, 30))});
          break;
        }
        case 1:
          if (dice_.Int(0, 5) == 0) delta.corrections.push_back({id, kTimeMin, kTimeMax, {}});
          break;
        default: {
          auto poses = Poses(end_ns + 1, end_ns + 1 + step, dice_.Int(1, 3) == 1 ? 120 : 1);
          if (!poses.empty()) delta.appends.push_back({id, std::move(poses)});
        }
      }
    }
    return delta;
  }

  RandomWorld dice_{RecordSeed()};
  TestMap map_{std::get<0>(GetParam()), Spec(std::get<1>(GetParam()))};
};

INSTANTIATE_TEST_SUITE_P(All, RowStreamOfTracks,
                         testing::Combine(testing::ValuesIn(Backends()),
                                          testing::Values(TrajectoryCodec::kLossless,
                                                          TrajectoryCodec::kQuantized)),
                         NameOfBackendAndCodec);

TEST_P(RowStreamOfTracks, AreTheSameTracks) {
  map_.MustCommit(DeltaOfNodes({MakeHuman(1, "ann"), MakeHuman(2, "bob")}));
  for (int round = 0; round < 120; ++round) map_.MustCommit(NextDelta());
  // The sign of a quaternion may be another in a copy where the codec quantises.
  ExpectEqualCopies(map_, is_lossless());
  if (HasFailure()) return;
  OrDie(map_.writer().SetTag("early", dice_.Int(2, 40), ""));
  OrDie(map_.writer().SetTag("later", dice_.Int(41, 60), ""));
  OrDie(map_.writer().Compact(dice_.Int(61, 121), {}, {}));
  ASSERT_EQ(map_.Problems(), "");
  ExpectEqualCopies(map_, is_lossless());
  for (int round = 0; round < 30; ++round) map_.MustCommit(NextDelta());
  ExpectEqualCopies(map_, is_lossless());
}

TEST_P(RowStreamOfTracks, GoOnAsTheyDid) {
  map_.MustCommit(DeltaOfNodes({MakeHuman(1, "ann"), MakeHuman(2, "bob")}));
  for (int round = 0; round < 60; ++round) map_.MustCommit(NextDelta());
  const auto rows = OrDie(ReadAllRows(&map_.reader()));
  std::vector<std::unique_ptr<MapOfRows>> copies;
  for (const std::string& backend : Backends()) {
    copies.push_back(std::make_unique<MapOfRows>(backend, map_.reader().spec(), rows));
  }
  for (int round = 0; round < 60; ++round) {
    GraphDelta delta = NextDelta();
    map_.MustCommit(delta);
    delta.map = kMap;
    delta.session_id = "test";
    for (const auto& copy : copies) {
      delta.sequence = OrDie(copy->writer().GetSession("test")).last_sequence + 1;
      OrDie(copy->writer().Commit(delta));
      ASSERT_EQ(OrDie(copy->reader().Head()).digest, OrDie(map_.reader().Head()).digest) << round;
    }
  }
  for (const auto& copy : copies) {
    EXPECT_EQ(OrDie(copy->reader().Verify({}, {})).problems, std::vector<std::string>());
    EXPECT_EQ(TimelessText(OrDie(ReadAllRows(&map_.reader()))),
              TimelessText(OrDie(ReadAllRows(&copy->reader()))));
  }
}

// A robot that commits pose by pose must not leave a segment a pose.
TEST(RowStreamPieces, HoldPosesOfManyCommits) {
  TestMap map("memory");
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  for (int i = 0; i < 200; ++i) {
    map.MustCommit(DeltaOfPoses(kAnn, {PoseAt(i * kSecond / 10, i, 0, 0)}));
  }
  const auto rows = OrDie(ReadAllRows(&map.reader()));
  const auto count = std::count_if(
      rows.begin(), rows.end(), [](const StreamRow& row) { return row.kind == row_kinds::kPoses; });
  // Lossless segments hold 80.
  EXPECT_EQ(count, 3);
}

}  // namespace
}  // namespace dsg::test
