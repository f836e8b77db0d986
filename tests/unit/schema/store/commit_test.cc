// SPDX-License-Identifier: Apache-2.0
// Commits: whole or not at all, once, in order.
#include <gtest/gtest.h>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

GraphDelta ObjectDelta(const std::string& session, int64_t sequence, uint64_t index) {
  GraphDelta delta = DeltaOfNodes({MakeObject(index, "cup", BoxOf(0, 0, 0, 1, 1, 1))});
  delta.map = kMap;
  delta.session_id = session;
  delta.sequence = sequence;
  return delta;
}

class Commit : public OnEveryBackend {};
class FailedCommit : public OnEveryBackend {};
class Revisions : public OnEveryBackend {};
class HeldSnapshot : public OnEveryBackend {};
DSG_ON_EVERY_BACKEND(Commit);
DSG_ON_EVERY_BACKEND(FailedCommit);
DSG_ON_EVERY_BACKEND(Revisions);
DSG_ON_EVERY_BACKEND(HeldSnapshot);

TEST_P(Commit, BeginsAtRevisionOneOfAnEmptyMap) {
  TestMap map(GetParam());
  EXPECT_EQ(OrDie(map.reader().Head()).revision, 0);
  EXPECT_EQ(map.Latest()->revision(), 0);
  EXPECT_EQ(OrDie(map.Latest()->Layers()).size(), DefaultLayers().size());
  EXPECT_EQ(map.MustCommit(ObjectDelta("s", 1, 1)), 1);
  EXPECT_EQ(OrDie(map.reader().Head()).revision, 1);
}

TEST_P(Commit, RefusesADeltaThatIsForAnotherMap) {
  TestMap map(GetParam());
  GraphDelta delta = ObjectDelta("s", 1, 1);
  delta.map = "elsewhere";
  const auto result = map.writer().Commit(delta);
  EXPECT_EQ(ReasonOf(result.status()), Reason::kDeltaInvalid);
  EXPECT_TRUE(absl::StrContains(result.status().message(), "elsewhere")) << result.status();
  EXPECT_EQ(OrDie(map.reader().Head()).revision, 0);
}

TEST_P(Commit, RecordsWhoAndWhatAndHowMany) {
  TestMap map(GetParam());
  GraphDelta delta = DeltaOfStream({}, 1);
  delta.author = "a robot";
  delta.message = "first look";
  delta.config_digest = "c0ffee";
  const size_t node_count = delta.nodes.size();
  const int64_t edge_count = static_cast<int64_t>(delta.edges.size());
  ASSERT_EQ(OrDie(map.writer().Commit(delta)).revision, 1);
  const RevisionInfo info = OrDie(map.reader().Head());
  EXPECT_EQ(info.author, "a robot");
  EXPECT_EQ(info.message, "first look");
  EXPECT_EQ(info.session_id, "stream 1");
  EXPECT_EQ(info.sequence, 1);
  EXPECT_EQ(info.config_digest, "c0ffee");
  EXPECT_GT(info.committed_ns, 0);
  EXPECT_EQ(info.node_count, static_cast<int64_t>(node_count));
  EXPECT_EQ(info.edge_count, edge_count);
  EXPECT_EQ(info.agent_count, 5);
  EXPECT_EQ(info.pose_count, 100);
  EXPECT_EQ(info.stay_count, 10);
}

TEST_P(Commit, OfASequenceAgainIsAnsweredAndChangesNothing) {
  TestMap map(GetParam());
  ASSERT_EQ(OrDie(map.writer().Commit(ObjectDelta("s", 1, 1))).revision, 1);
  ASSERT_EQ(OrDie(map.writer().Commit(ObjectDelta("s", 2, 2))).revision, 2);
  const Sha256 digest = OrDie(map.reader().Head()).digest;
  const CommitResult again = OrDie(map.writer().Commit(ObjectDelta("s", 1, 1)));
  EXPECT_TRUE(again.replayed);
  EXPECT_EQ(again.revision, 1);
  EXPECT_EQ(OrDie(map.reader().Head()).revision, 2);
  EXPECT_EQ(OrDie(map.reader().Head()).digest, digest);
}

TEST_P(Commit, OfASequenceAgainWithOtherContentIsRefused) {
  TestMap map(GetParam());
  ASSERT_EQ(OrDie(map.writer().Commit(ObjectDelta("s", 1, 1))).revision, 1);
  ASSERT_EQ(OrDie(map.writer().Commit(ObjectDelta("s", 2, 2))).revision, 2);
  const Sha256 digest = OrDie(map.reader().Head()).digest;
  GraphDelta renamed = ObjectDelta("s", 2, 2);
  renamed.nodes.front().name = "another";
  GraphDelta unsaid = ObjectDelta("s", 2, 2);
  unsaid.message = "what was done";
  for (const GraphDelta& other : {ObjectDelta("s", 1, 77), renamed, unsaid}) {
    const auto refused = map.writer().Commit(other);
    EXPECT_EQ(ReasonOf(refused.status()), Reason::kSequenceReused) << refused.status();
    EXPECT_EQ(MetadataOf(refused.status())["revision"], absl::StrCat(other.sequence));
  }
  EXPECT_EQ(OrDie(map.reader().Head()).digest, digest);
  // Whether it is conditional does not count: the answer to the first try was lost, say.
  GraphDelta conditional = ObjectDelta("s", 2, 2);
  conditional.parent_revision = 1;
  EXPECT_TRUE(OrDie(map.writer().Commit(conditional)).replayed);
}

TEST_P(Commit, KnowsTheContentOfASessionsLastDeltaAfterCompaction) {
  TestMap map(GetParam());
  ASSERT_TRUE(map.writer().Commit(ObjectDelta("s", 1, 1)).ok());
  ASSERT_TRUE(map.writer().Commit(ObjectDelta("s", 2, 2)).ok());
  ASSERT_TRUE(map.writer().Commit(ObjectDelta("t", 1, 3)).ok());
  ASSERT_TRUE(map.writer().Compact(3, {}, {}).ok());
  EXPECT_TRUE(OrDie(map.writer().Commit(ObjectDelta("s", 2, 2))).replayed);
  EXPECT_EQ(ReasonOf(map.writer().Commit(ObjectDelta("s", 2, 77)).status()),
            Reason::kSequenceReused);
  // What came before it is believed: nothing is left of it.
  EXPECT_TRUE(OrDie(map.writer().Commit(ObjectDelta("s", 1, 77))).replayed);
}

TEST_P(Commit, OfASequenceAgainIsAnsweredByALaterWriter) {
  TestMap map(GetParam());
  ASSERT_TRUE(map.writer().Commit(ObjectDelta("s", 1, 1)).ok());
  map.Close();
  map.Reopen();
  const CommitResult again = OrDie(map.writer().Commit(ObjectDelta("s", 1, 1)));
  EXPECT_TRUE(again.replayed);
  EXPECT_EQ(again.revision, 1);
}

TEST_P(Commit, OfTheSameSequenceInAnotherSessionIsAnotherCommit) {
  TestMap map(GetParam());
  ASSERT_EQ(OrDie(map.writer().Commit(ObjectDelta("s", 1, 1))).revision, 1);
  const CommitResult other = OrDie(map.writer().Commit(ObjectDelta("t", 1, 2)));
  EXPECT_FALSE(other.replayed);
  EXPECT_EQ(other.revision, 2);
}

TEST_P(Commit, RefusesAGapInTheSequenceOfASession) {
  TestMap map(GetParam());
  ASSERT_TRUE(map.writer().Commit(ObjectDelta("s", 1, 1)).ok());
  const auto skipped = map.writer().Commit(ObjectDelta("s", 3, 3));
  EXPECT_EQ(ReasonOf(skipped.status()), Reason::kSequenceGap) << skipped.status();
  EXPECT_EQ(OrDie(map.reader().Head()).revision, 1);
}

TEST_P(Commit, RefusesASessionThatDoesNotBeginAtOne) {
  TestMap map(GetParam());
  EXPECT_EQ(ReasonOf(map.writer().Commit(ObjectDelta("s", 2, 1)).status()), Reason::kSequenceGap);
}

TEST_P(Commit, TellsHowFarASessionGot) {
  TestMap map(GetParam());
  EXPECT_EQ(OrDie(map.writer().GetSession("s")).last_sequence, 0);
  ASSERT_TRUE(map.writer().Commit(ObjectDelta("s", 1, 1)).ok());
  ASSERT_TRUE(map.writer().Commit(ObjectDelta("t", 1, 2)).ok());
  ASSERT_TRUE(map.writer().Commit(ObjectDelta("s", 2, 3)).ok());
  for (const SessionState& state :
       {OrDie(map.writer().GetSession("s")), OrDie(map.reader().GetSession("s"))}) {
    EXPECT_EQ(state.last_sequence, 2);
    EXPECT_EQ(state.last_revision, 3);
  }
  EXPECT_EQ(OrDie(map.reader().GetSession("t")).last_revision, 2);
}

TEST_P(Commit, WithAStaleParentIsRefusedNamingTheHead) {
  TestMap map(GetParam());
  map.MustCommit(ObjectDelta("", 0, 1));
  map.MustCommit(ObjectDelta("", 0, 2));
  GraphDelta delta = ObjectDelta("s", 1, 3);
  delta.parent_revision = 1;
  const auto refused = map.writer().Commit(delta);
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kParentRevisionStale);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(MetadataOf(refused.status())["head"], "2");
  delta.parent_revision = 2;
  EXPECT_EQ(OrDie(map.writer().Commit(delta)).revision, 3);
}

TEST_P(Commit, WithTheEmptyMapAsItsParentIsTakenOnce) {
  TestMap map(GetParam());
  GraphDelta delta = ObjectDelta("s", 1, 1);
  delta.parent_revision = 0;
  EXPECT_TRUE(map.writer().Commit(delta).ok());
  // The same again is a replay, though its parent is old by now.
  EXPECT_TRUE(OrDie(map.writer().Commit(delta)).replayed);
}

TEST_P(Commit, OfAnEmptyDeltaIsARevisionThatChangesNothing) {
  TestMap map(GetParam());
  map.MustCommit(ObjectDelta("", 0, 1));
  const std::string before = OrDie(map.Latest()->GetNode(NodeId('O', 1))).name;
  EXPECT_EQ(map.MustCommit({}), 2);
  EXPECT_EQ(OrDie(map.Latest()->GetNode(NodeId('O', 1))).name, before);
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(Commit, OfWhatIsKnownWritesNoNewVersion) {
  TestMap map(GetParam());
  map.MustCommit(ObjectDelta("", 0, 1));
  map.MustCommit(ObjectDelta("", 0, 1));
  EXPECT_EQ(OrDie(map.Latest()->GetNode(NodeId('O', 1))).revision, 1);
}

// What no failed delta may change.
struct Untouched {
  explicit Untouched(TestMap* checked)
      : map(*checked),
        dump(OrDie(Dump(*map.Latest()))),
        digest(OrDie(map.reader().Head()).digest) {}
  void Check() {
    EXPECT_EQ(OrDie(map.reader().Head()).digest, digest);
    EXPECT_EQ(OrDie(Dump(*map.Latest())), dump);
    EXPECT_EQ(map.Problems(), "");
  }
  TestMap& map;
  std::string dump;
  Sha256 digest;
};

TEST_P(FailedCommit, LeavesNothingAndLetsTheNextOneThrough) {
  TestMap map(GetParam());
  for (int64_t s = 1; s <= 8; ++s) ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
  Untouched untouched(&map);
  GraphDelta bad = DeltaOfStream({}, 9);
  bad.edges.push_back(MakeEdge(NodeId('O', 1), relations::kOn, NodeId('O', 999'999)));
  const auto refused = map.writer().Commit(bad);
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kDeltaInvalid);
  EXPECT_TRUE(absl::StrContains(refused.status().message(), "O999999")) << refused.status();
  untouched.Check();
  EXPECT_EQ(OrDie(map.writer().Commit(DeltaOfStream({}, 9))).revision, 9);
  EXPECT_EQ(map.Problems(), "");
}

// This one is found out last, after all the rest has been looked at.
TEST_P(FailedCommit, ByTheLastOfItsPosesLeavesNothing) {
  TestMap map(GetParam());
  for (int64_t s = 1; s <= 8; ++s) ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
  Untouched untouched(&map);
  GraphDelta bad = DeltaOfStream({}, 9);
  const TimeNs late_ns = 80LL * 365 * 86400 * kSecond;
  bad.nodes.push_back(MakeHuman(50, "late"));
  bad.appends.push_back({NodeId('H', 50), {PoseAt(late_ns, 0, 0, 0)}});
  const auto refused = map.writer().Commit(bad);
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kTimeImplausible);
  EXPECT_EQ(MetadataOf(refused.status())["time_ns"], absl::StrCat(late_ns));
  untouched.Check();
  for (int64_t s = 9; s <= 16; ++s) ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(FailedCommit, DoesNotShowInTheDigestsOfThoseAfter) {
  TestMap clean(GetParam());
  TestMap disturbed(GetParam());
  for (int64_t s = 1; s <= 12; ++s) {
    ASSERT_TRUE(clean.writer().Commit(DeltaOfStream({}, s)).ok());
    GraphDelta bad = DeltaOfStream({}, s);
    bad.nodes.push_back(MakeHuman(50, "late"));
    bad.appends.push_back({NodeId('H', 50), {PoseAt(kTimeMax, 0, 0, 0)}});
    ASSERT_FALSE(disturbed.writer().Commit(bad).ok());
    ASSERT_TRUE(disturbed.writer().Commit(DeltaOfStream({}, s)).ok());
  }
  EXPECT_EQ(OrDie(clean.reader().Head()).digest, OrDie(disturbed.reader().Head()).digest);
}

TEST_P(FailedCommit, NamesTheAgentWhosePosesReachBack) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  map.MustCommit(DeltaOfPoses(NodeId('H', 1), {PoseAt(5 * kSecond, 0, 0, 0)}));
  const auto refused = map.Commit(DeltaOfPoses(NodeId('H', 1), {PoseAt(5 * kSecond, 1, 0, 0)}));
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kTrackConflict);
  EXPECT_EQ(MetadataOf(refused.status())["agent"], "H1");
  EXPECT_EQ(MetadataOf(refused.status())["stored_end_ns"], absl::StrCat(5 * kSecond));
}

TEST_P(Revisions, AreDenseAndListedNewestFirst) {
  TestMap map(GetParam());
  for (int64_t s = 1; s <= 9; ++s) ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
  const auto all = OrDie(map.reader().ListRevisions(0, 100));
  ASSERT_EQ(all.size(), 9u);
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].revision, 9 - static_cast<Revision>(i));
  }
  const auto page = OrDie(map.reader().ListRevisions(5, 2));
  ASSERT_EQ(page.size(), 2u);
  EXPECT_EQ(page[0].revision, 4);
  EXPECT_EQ(page[1].revision, 3);
}

TEST_P(Revisions, OfOneNodeAreItsVersions) {
  TestMap map(GetParam());
  const NodeId cup('O', 1);
  for (const char* name : {"cup", "mug", "mug", "glass"}) {
    map.MustCommit(DeltaOfNodes({MakeObject(1, name, Box3d())}));
  }
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  const auto all = OrDie(map.reader().NodeVersions(cup, 0, 10));
  std::vector<std::string> said;
  for (const NodeVersion& version : all) {
    const std::string to =
        version.to == kRevisionMax ? std::string("now") : absl::StrCat(version.to);
    said.push_back(absl::StrCat(version.node.name, " ", version.from, " to ", to));
    EXPECT_EQ(version.node.id, cup);
  }
  // What is written again as it is may be a version of its own, or none.
  ASSERT_GE(said.size(), 3u);
  EXPECT_EQ(said.front(), "glass 4 to now");
  EXPECT_EQ(said.back(), "cup 1 to 2");
  for (size_t i = 1; i < all.size(); ++i) EXPECT_EQ(all[i].to, all[i - 1].from);
  const auto page = OrDie(map.reader().NodeVersions(cup, 4, 1));
  ASSERT_EQ(page.size(), 1u);
  EXPECT_EQ(page[0].node.name, "mug");
  EXPECT_EQ(page[0].from, all[1].from);
  EXPECT_TRUE(OrDie(map.reader().NodeVersions(NodeId('O', 2), 0, 10)).empty());
}

TEST_P(Revisions, OfTheFutureAreRefusedNamingWhatIsReadable) {
  TestMap map(GetParam());
  map.MustCommit({});
  for (const Revision revision : {Revision{2}, Revision{-1}}) {
    const auto refused = map.reader().At(revision);
    EXPECT_EQ(ReasonOf(refused.status()), Reason::kRevisionInFuture);
    EXPECT_EQ(MetadataOf(refused.status())["newest"], "1");
    EXPECT_EQ(MetadataOf(refused.status())["oldest"], "0");
  }
}

TEST_P(Revisions, KeepAnsweringWhatTheyAnsweredWhenTheyWereNew) {
  TestMap map(GetParam());
  std::vector<std::string> dumps = {OrDie(Dump(*map.At(0)))};
  for (int64_t s = 1; s <= 40; ++s) {
    ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
    dumps.push_back(OrDie(Dump(*map.Latest())));
  }
  // Once with what this reader remembers, once with a reader that knows nothing.
  for (int round = 0; round < 2; ++round) {
    for (size_t r = 0; r < dumps.size(); ++r) {
      EXPECT_TRUE(OrDie(Dump(*map.At(static_cast<Revision>(r)))) == dumps[r]) << "revision " << r;
    }
    map.Close();
    map.Reopen();
  }
}

TEST_P(Revisions, OfEqualDeltasHaveEqualDigestsWhereverAndHoweverTheyWereWritten) {
  TestMap in_one_go(GetParam());
  TestMap reopened_each_time(GetParam());
  for (int64_t s = 1; s <= 20; ++s) {
    ASSERT_TRUE(in_one_go.writer().Commit(DeltaOfStream({}, s)).ok());
    ASSERT_TRUE(reopened_each_time.writer().Commit(DeltaOfStream({}, s)).ok());
    reopened_each_time.Close();
    reopened_each_time.Reopen();
    ASSERT_EQ(OrDie(in_one_go.reader().Head()).digest,
              OrDie(reopened_each_time.reader().Head()).digest);
  }
}

TEST_P(Revisions, OfOtherDeltasHaveOtherDigests) {
  TestMap one(GetParam());
  TestMap other(GetParam());
  one.MustCommit(DeltaOfNodes({MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1))}));
  other.MustCommit(DeltaOfNodes({MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1.001))}));
  EXPECT_NE(OrDie(one.reader().Head()).digest, OrDie(other.reader().Head()).digest);
}

TEST_P(HeldSnapshot, StaysWhatItIsWhileCommitsGoOn) {
  TestMap map(GetParam());
  for (int64_t s = 1; s <= 6; ++s) ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
  const auto held = map.Latest();
  const std::string before = OrDie(Dump(*held));
  for (int64_t s = 7; s <= 20; ++s) ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
  EXPECT_TRUE(OrDie(Dump(*held)) == before);
}

TEST_P(HeldSnapshot, StopsALongReadWhenTold) {
  TestMap map(GetParam());
  for (int64_t s = 1; s <= 3; ++s) ASSERT_TRUE(map.writer().Commit(DeltaOfStream({}, s)).ok());
  const StopCheck stop = [] { return absl::CancelledError("enough"); };
  const auto snapshot = map.Latest();
  const auto go_on = [](const auto&) { return true; };
  EXPECT_TRUE(absl::IsCancelled(snapshot->ScanNodes({}, NodeId(), stop, go_on)));
  EXPECT_TRUE(absl::IsCancelled(snapshot->ScanEdges({}, std::nullopt, stop, go_on)));
  EXPECT_TRUE(
      absl::IsCancelled(snapshot->ReadPoses(NodeId('H', 1), kTimeMin, kTimeMax, stop, go_on)));
  EXPECT_TRUE(absl::IsCancelled(
      snapshot->VisitsToBox(BoxOf(0, 0, 0, 100, 60, 3), kTimeMin, kTimeMax, stop).status()));
  EXPECT_TRUE(absl::IsCancelled(snapshot->Tracks(stop).status()));
  EXPECT_TRUE(absl::IsCancelled(snapshot->CountObservedAgents(kTimeMin, kTimeMax, stop).status()));
  EXPECT_TRUE(
      absl::IsCancelled(snapshot->StaysInNode(NodeId('R', 0), kTimeMin, kTimeMax, stop).status()));
}

}  // namespace
}  // namespace dsg::test
