// SPDX-License-Identifier: Apache-2.0
// The same random deltas into every backend: equal digests at each revision and equal answers to
// every question, also after revisions were compacted and things erased.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "schema/codec/checksum.h"
#include "tests/support/random_world.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

// When a commit was made differs from store to store, and nothing else may.
std::string DumpOf(const Snapshot& snapshot) {
  const std::string committed = absl::StrCat(OrDie(snapshot.Stats()).at.committed_ns);
  return absl::StrReplaceAll(OrDie(Dump(snapshot)), {{committed, "T"}});
}

// One map in each backend, to which the same is done. The first is what others are compared with.
class Twins {
 public:
  explicit Twins(TrajectoryCodec codec) {
    for (const std::string& backend : Backends()) {
      maps_.push_back(std::make_unique<TestMap>(backend, Spec(codec)));
    }
  }

  template <typename Act>
  void Do(const Act& act) {
    for (const auto& map : maps_) act(*map);
  }

  void Commit(const GraphDelta& delta) {
    std::set<std::string> digests;
    Do([&](TestMap& map) {
      map.MustCommit(delta);
      digests.insert(ToHex(OrDie(map.reader().Head()).digest));
    });
    ASSERT_EQ(digests.size(), 1u) << "revision " << newest();
  }

  Revision newest() const { return OrDie(maps_[0]->reader().Head()).revision; }
  TestMap& first() { return *maps_[0]; }

  void ExpectEqual() {
    TestMap& one = first();
    for (size_t i = 1; i < maps_.size(); ++i) {
      SCOPED_TRACE(Backends()[i]);
      ExpectEqualRecords(one, *maps_[i]);
      for (Revision revision = 0; revision <= newest(); ++revision) {
        const auto at = one.reader().At(revision);
        const auto other = maps_[i]->reader().At(revision);
        ASSERT_EQ(at.status(), other.status()) << revision;
        if (at.ok()) ExpectEqualAnswers(**at, **other);
        if (testing::Test::HasFailure()) return;
      }
    }
    Do([](TestMap& map) { EXPECT_EQ(map.Problems(), ""); });
  }

  // Of each map its rows in each backend: the same rows again, the same digests and answers.
  void ExpectEqualCopies() {
    std::vector<std::string> texts;
    Do([&](TestMap& map) {
      const auto rows = OrDie(ReadAllRows(&map.reader()));
      texts.push_back(TimelessText(rows));
      for (const std::string& backend : Backends()) {
        if (testing::Test::HasFailure()) return;
        SCOPED_TRACE(absl::StrCat("copy in ", backend));
        MapOfRows copy(backend, map.reader().spec(), rows);
        ExpectEqualMaps(&map.reader(), &copy.reader());
      }
    });
    for (const std::string& text : texts) EXPECT_EQ(text, texts[0]);
  }

  void ExpectEqualTouched(RandomWorld* dice) {
    const Revision oldest = OrDie(first().reader().OldestRevision());
    for (int i = 0; i < 40; ++i) {
      const Revision after = dice->Int(oldest, newest());
      const Revision until = dice->Int(after, newest());
      const Touched said = OrDie(first().reader().TouchedBetween(after, until, {}));
      for (size_t k = 1; k < maps_.size(); ++k) {
        SCOPED_TRACE(absl::StrCat(Backends()[k], " ", after, " to ", until));
        const Touched other = OrDie(maps_[k]->reader().TouchedBetween(after, until, {}));
        EXPECT_EQ(said.nodes, other.nodes);
        EXPECT_EQ(said.edges, other.edges);
        EXPECT_EQ(said.tracks, other.tracks);
        EXPECT_EQ(said.mesh_blocks, other.mesh_blocks);
        EXPECT_EQ(said.layers_or_labels, other.layers_or_labels);
        // A backend may name tracks of which nothing changed, as the first does that keeps poses by
        // the hundred.
        EXPECT_TRUE(std::includes(said.corrected_tracks.begin(), said.corrected_tracks.end(),
                                  other.corrected_tracks.begin(), other.corrected_tracks.end()));
      }
    }
  }

 private:
  static void ExpectEqualRecords(TestMap& one, TestMap& other) {
    const auto said = OrDie(one.reader().ListRevisions(0, 10'000));
    const auto told = OrDie(other.reader().ListRevisions(0, 10'000));
    ASSERT_EQ(said.size(), told.size());
    for (size_t i = 0; i < said.size(); ++i) {
      EXPECT_EQ(said[i].revision, told[i].revision);
      EXPECT_EQ(ToHex(said[i].digest), ToHex(told[i].digest)) << said[i].revision;
      EXPECT_EQ(said[i].session_id, told[i].session_id);
      const SessionState a = OrDie(one.reader().GetSession(said[i].session_id));
      const SessionState b = OrDie(other.reader().GetSession(said[i].session_id));
      EXPECT_EQ(a.last_sequence, b.last_sequence);
      EXPECT_EQ(a.first_revision, b.first_revision);
    }
  }

  static void ExpectEqualAnswers(const Snapshot& one, const Snapshot& other) {
    ASSERT_EQ(DumpOf(one), DumpOf(other)) << "revision " << one.revision();
    for (const TrackInfo& track : OrDie(one.Tracks())) {
      for (int i = 0; i < 5 && track.pose_count > 0; ++i) {
        const TimeNs from_ns = track.first_ns + (track.last_ns - track.first_ns) / 5 * i;
        EXPECT_EQ(OrDie(one.CountObservedAgents(from_ns, from_ns + kSecond, {})),
                  OrDie(other.CountObservedAgents(from_ns, from_ns + kSecond, {})));
        EXPECT_EQ(OrDie(one.StayAt(track.agent, from_ns)),
                  OrDie(other.StayAt(track.agent, from_ns)));
      }
    }
  }

  std::vector<std::unique_ptr<TestMap>> maps_;
};

class BackendsAgree : public testing::TestWithParam<TrajectoryCodec> {
 protected:
  Twins twins_{GetParam()};
};

INSTANTIATE_TEST_SUITE_P(BothCodecs, BackendsAgree,
                         testing::Values(TrajectoryCodec::kLossless, TrajectoryCodec::kQuantized),
                         [](const auto& codec) {
                           return codec.param == TrajectoryCodec::kLossless ? "Lossless"
                                                                            : "Quantized";
                         });

TEST_P(BackendsAgree, OnTheStreamThatUsesEveryPartOfTheModel) {
  const uint64_t seed = RecordSeed();
  for (int64_t s = 1; s <= 60; ++s) twins_.Commit(DeltaOfStream({.seed = seed}, s));
  twins_.ExpectEqual();
  twins_.ExpectEqualCopies();
  RandomWorld dice(seed);
  twins_.ExpectEqualTouched(&dice);
}

TEST_P(BackendsAgree, OnRandomWorlds) {
  const uint64_t seed = RecordSeed();
  RandomWorld world(seed);
  NaiveMap naive;
  for (int i = 0; i < 60; ++i) {
    const GraphDelta delta = i == 0 ? world.First() : world.Next(naive);
    naive.Apply(delta);
    twins_.Commit(delta);
    if (HasFailure()) return;
  }
  twins_.ExpectEqual();
  twins_.ExpectEqualCopies();
  twins_.ExpectEqualTouched(&world);
}

// Shapes that hide one another, and parts of batches that end.
TEST_P(BackendsAgree, OnBatchesThatOverlapAndEndInPart) {
  RandomWorld dice(RecordSeed());
  twins_.Commit(DeltaOfNodes({MakeHuman(1, "ann"), MakeHuman(2, "bob")}));
  for (int round = 0; round < 60; ++round) {
    const NodeId agent('H', static_cast<uint64_t>(dice.Int(1, 2)));
    GraphDelta delta;
    std::set<TimeNs> times;
    for (int i = 0; i < 45; ++i) times.insert(dice.Int(0, 400) * kSecond);
    const TimeNs from_ns = dice.Int(0, 400) * kSecond;
    const TrackSpan span{agent, from_ns, from_ns + dice.Int(1, 200) * kSecond};
    if (round % 3 == 1) delta.shape_removals = {span};
    if (round % 4 == 1) delta.factor_removals = {span};
    ShapeAppend shapes{agent, std::nullopt, {}};
    FactorAppend factors{agent, {}};
    for (const TimeNs time_ns : times) {
      BodyShape shape;
      shape.time_ns = time_ns;
      shape.joints = {static_cast<float>(dice.Real(-1, 1)), 0.0f, 0.0f};
      shapes.shapes.push_back(shape);
      PoseFactor factor;
      factor.type = "odometry";
      factor.from_ns = time_ns;
      factor.to_ns = time_ns + dice.Int(1, 50) * kSecond;
      factors.factors.push_back(factor);
    }
    if (round % 2 == 0) delta.shapes = {shapes};
    if (round % 5 != 0) delta.factors = {factors};
    twins_.Commit(delta);
    if (HasFailure()) return;
  }
  twins_.ExpectEqual();
  twins_.ExpectEqualCopies();
}

TEST_P(BackendsAgree, AfterCompactionAndWhatIsWrittenThen) {
  const uint64_t seed = RecordSeed();
  RandomWorld dice(seed);
  for (int64_t s = 1; s <= 50; ++s) twins_.Commit(DeltaOfStream({.seed = seed}, s));
  const Revision tagged = dice.Int(2, 25);
  const Revision keep_from = dice.Int(26, 50);
  twins_.Do([&](TestMap& map) {
    OrDie(map.writer().SetTag("summer", tagged, "when it was warm"));
    OrDie(map.writer().Compact(keep_from, {}, {}));
  });
  twins_.ExpectEqual();
  twins_.ExpectEqualCopies();
  twins_.ExpectEqualTouched(&dice);
  for (int64_t s = 51; s <= 60; ++s) twins_.Commit(DeltaOfStream({.seed = seed}, s));
  twins_.Do([&](TestMap& map) {
    OrDie(map.writer().RemoveTag("summer"));
    OrDie(map.writer().Compact(55, {}, {}));
  });
  twins_.ExpectEqual();
  twins_.ExpectEqualCopies();
  twins_.ExpectEqualTouched(&dice);
}

TEST_P(BackendsAgree, AfterErasuresOfEachKind) {
  const uint64_t seed = RecordSeed();
  RandomWorld dice(seed);
  for (int64_t s = 1; s <= 45; ++s) twins_.Commit(DeltaOfStream({.seed = seed}, s));
  if (dice.Int(0, 1) == 0) {
    twins_.Do([&](TestMap& map) {
      OrDie(map.writer().SetTag("summer", 12, ""));
      OrDie(map.writer().Compact(20, {}, {}));
    });
  }
  // An agent that is gone, one of whom a stretch is gone, a place, objects that stay and go.
  const TrackSpan span{NodeId('H', 2), 20 * kSecond, 50 * kSecond};
  GraphDelta delta;
  for (const NodeId id : {NodeId('O', 5), NodeId('H', 3)}) {
    delta.retirements.push_back({id, std::nullopt});
  }
  delta.corrections.push_back({span.agent, span.from_ns, span.to_ns, {}});
  delta.shape_removals = {span};
  delta.factor_removals = {span};
  for (const Stay& stay :
       OrDie(twins_.first().Latest()->StaysOfAgent(span.agent, span.from_ns, span.to_ns))) {
    delta.stay_removals.push_back({span.agent, stay.enter_ns});
  }
  twins_.Commit(delta);
  const Erasure erasure{.nodes = {NodeId('O', 5), NodeId('O', 7), NodeId('H', 3), NodeId('R', 1)},
                        .edges = {{NodeId('p', 1), relations::kTraversable, NodeId('p', 2)}},
                        .mesh_blocks = {{4, 0, 0}, {8, 0, 0}},
                        .tracks = {span},
                        .assets = true};
  std::vector<EraseReport> reports;
  twins_.Do([&](TestMap& map) {
    reports.push_back(OrDie(map.writer().Erase(erasure, {}, {})));
    EXPECT_FALSE(map.reader().IsCurrent());
    map.Close();
    map.Reopen();
  });
  for (const EraseReport& report : reports) {
    EXPECT_EQ(report.asset_count, reports[0].asset_count);
    EXPECT_GT(report.row_count, 0);
  }
  twins_.ExpectEqual();
  twins_.ExpectEqualCopies();
  twins_.ExpectEqualTouched(&dice);
  for (int64_t s = 46; s <= 48; ++s) {
    GraphDelta next = DeltaOfStream({.seed = seed}, s);
    const auto is_gone = [](NodeId id) { return id == NodeId('H', 3); };
    std::erase_if(next.appends, [&](const auto& item) { return is_gone(item.agent); });
    std::erase_if(next.stays, [&](const auto& item) { return is_gone(item.agent); });
    std::erase_if(next.factors, [&](const auto& item) { return is_gone(item.agent); });
    std::erase_if(next.shapes, [&](const auto& item) { return is_gone(item.agent); });
    std::erase_if(next.corrections, [&](const auto& item) { return is_gone(item.agent); });
    twins_.Commit(next);
  }
  twins_.ExpectEqual();
  twins_.ExpectEqualCopies();
}

TEST_P(BackendsAgree, OnErasuresThatWereNotedAndEndedLater) {
  const uint64_t seed = RecordSeed();
  for (int64_t s = 1; s <= 20; ++s) twins_.Commit(DeltaOfStream({.seed = seed}, s));
  const Erasure noted{.nodes = {NodeId('O', 3), NodeId('O', 4), NodeId('H', 1)}};
  twins_.Do([&](TestMap& map) { OrDie(map.writer().NoteErasure(noted, 20)); });
  GraphDelta delta;
  delta.retirements.push_back({NodeId('O', 3), std::nullopt});
  delta.retirements.push_back({NodeId('H', 1), std::nullopt});
  twins_.Commit(delta);
  std::vector<EraseReport> reports;
  twins_.Do([&](TestMap& map) {
    const auto before = OrDie(map.reader().GetPendingErasure());
    ASSERT_TRUE(before.has_value());
    EXPECT_EQ(before->node_count, 3);
    const EraseReport report = OrDie(map.writer().Erase({}, {}, {}));
    EXPECT_TRUE(report.was_pending);
    // O4 is believed still.
    EXPECT_TRUE(report.is_pending);
    map.Close();
    map.Reopen();
    EXPECT_EQ(OrDie(map.reader().GetPendingErasure())->node_count, 1);
  });
  twins_.ExpectEqual();
  // What is left of the erasure must not be copied.
  twins_.Do([](TestMap& map) {
    EXPECT_EQ(ReadAllRows(&map.reader()).status().code(), absl::StatusCode::kFailedPrecondition);
  });
  GraphDelta last;
  last.retirements.push_back({NodeId('O', 4), std::nullopt});
  twins_.Commit(last);
  twins_.Do([&](TestMap& map) {
    EXPECT_FALSE(OrDie(map.writer().Erase({}, {}, {})).is_pending);
    map.Close();
    map.Reopen();
  });
  twins_.ExpectEqual();
  twins_.ExpectEqualCopies();
}

}  // namespace
}  // namespace dsg::test
