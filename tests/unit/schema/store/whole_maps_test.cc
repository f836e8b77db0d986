// SPDX-License-Identifier: Apache-2.0
// Maps that are dropped and renamed.
#include <gtest/gtest.h>

#include "absl/strings/match.h"
#include "absl/strings/str_replace.h"
#include "schema/codec/checksum.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr int64_t kLength = 6;

// A store with the maps "office", of some revisions and a tag, and "zoo", which is empty.
class WholeMaps : public OnEveryBackend {
 protected:
  WholeMaps() : store_(Open("whole-maps")) {
    OrDie(store_->CreateMap(Spec(TrajectoryCodec::kQuantized)));
    MapSpec zoo;
    zoo.name = "zoo";
    OrDie(store_->CreateMap(zoo));
    const auto writer = OrDie(store_->OpenWriter(kMap));
    for (int64_t i = 1; i <= kLength; ++i) OrDie(writer->Commit(DeltaOfStream({}, i)));
    OrDie(writer->SetTag("moved-in", 3, "desks"));
  }

  std::unique_ptr<GraphStore> Open(const std::string& program) const {
    return OrDie(
        OpenStore(UriOf(GetParam(), folder_.path()), {.create = true, .program = program}));
  }

  std::vector<std::string> Digests(const std::string& map) {
    std::vector<std::string> digests;
    const auto reader = OrDie(store_->OpenMap(map));
    for (const RevisionInfo& info : OrDie(reader->ListRevisions(0, 100))) {
      digests.push_back(ToHex(info.digest));
    }
    return digests;
  }

  std::string DumpOf(const std::string& map) {
    return OrDie(Dump(*OrDie(OrDie(store_->OpenMap(map))->Latest())));
  }

  std::vector<std::string> Names() { return OrDie(store_->MapNames()); }
  Reason DropFails(const std::string& map, const MapCondition& condition) {
    return ReasonOf(store_->DropMap(map, condition).status());
  }
  // Of the map "office", if it is what it was made.
  bool IsThere() { return Digests(kMap).size() == kLength; }

  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
};
DSG_ON_EVERY_BACKEND(WholeMaps);

TEST_P(WholeMaps, AreGoneOnceDropped) {
  const DropReport report = OrDie(store_->DropMap(kMap, {}));
  EXPECT_EQ(report.head, kLength);
  EXPECT_EQ(Names(), std::vector<std::string>{"zoo"});
  EXPECT_EQ(ReasonOf(store_->OpenMap(kMap).status()), Reason::kMapUnknown);
  EXPECT_EQ(ReasonOf(store_->OpenWriter(kMap).status()), Reason::kMapUnknown);
  EXPECT_EQ(DropFails(kMap, {}), Reason::kMapUnknown);
  EXPECT_TRUE(store_->OpenMap("zoo").ok());
}

TEST_P(WholeMaps, LeaveTheirNameToAnotherWhenDropped) {
  const std::string before = OrDie(store_->OpenMap(kMap))->incarnation();
  OrDie(store_->DropMap(kMap, {}).status());
  MapSpec other = Spec(TrajectoryCodec::kLossless);
  other.epoch_ns = 77;
  OrDie(store_->CreateMap(other));
  const auto map = OrDie(store_->OpenMap(kMap));
  EXPECT_EQ(map->spec().epoch_ns, 77);
  EXPECT_EQ(map->spec().codec, TrajectoryCodec::kLossless);
  EXPECT_EQ(OrDie(map->Head()).revision, 0);
  EXPECT_NE(map->incarnation(), before);
  // Nothing is known of a session of the dropped map.
  OrDie(OrDie(store_->OpenWriter(kMap))->Commit(DeltaOfStream({}, 1)));
  EXPECT_EQ(OrDie(map->Head()).revision, 1);
}

TEST_P(WholeMaps, AreDroppedOnlyAsTheyWereExpected) {
  const std::string incarnation = OrDie(store_->OpenMap(kMap))->incarnation();
  EXPECT_EQ(DropFails(kMap, {.head = kLength - 1}), Reason::kParentRevisionStale);
  EXPECT_EQ(DropFails(kMap, {.head = 0}), Reason::kParentRevisionStale);
  EXPECT_EQ(DropFails(kMap, {.incarnation = incarnation + "x"}), Reason::kMapReplaced);
  EXPECT_EQ(DropFails(kMap, {.head = kLength, .incarnation = "x"}), Reason::kMapReplaced);
  EXPECT_TRUE(IsThere());
  const absl::Status stale = store_->DropMap(kMap, {.head = 2}).status();
  EXPECT_TRUE(absl::StrContains(stale.message(), "is at revision 6")) << stale;
  EXPECT_EQ(OrDie(store_->DropMap(kMap, {.head = kLength, .incarnation = incarnation})).head,
            kLength);
  EXPECT_EQ(OrDie(store_->DropMap("zoo", {.head = 0})).head, 0);
}

TEST_P(WholeMaps, AreNotDroppedOrRenamedUnderAWriter) {
  auto writer = OrDie(Open("robot")->OpenWriter(kMap));
  const absl::Status dropped = store_->DropMap(kMap, {}).status();
  EXPECT_EQ(ReasonOf(dropped), Reason::kWriterLocked);
  EXPECT_TRUE(absl::StrContains(dropped.message(), "robot")) << dropped;
  EXPECT_EQ(ReasonOf(store_->RenameMap(kMap, "attic")), Reason::kWriterLocked);
  OrDie(writer->Commit(DeltaOfStream({}, kLength + 1)));
  writer.reset();
  EXPECT_EQ(Digests(kMap).size(), kLength + 1u);
  OrDie(store_->RenameMap(kMap, "attic"));
}

TEST_P(WholeMaps, AreLookedUpByValidNames) {
  EXPECT_EQ(DropFails("attic", {}), Reason::kMapUnknown);
  EXPECT_EQ(DropFails("../office", {}), Reason::kMapNameInvalid);
  EXPECT_EQ(DropFails("", {}), Reason::kMapNameInvalid);
  EXPECT_EQ(ReasonOf(store_->RenameMap("attic", "lab")), Reason::kMapUnknown);
  EXPECT_EQ(ReasonOf(store_->RenameMap("../office", "lab")), Reason::kMapNameInvalid);
  EXPECT_EQ(ReasonOf(store_->RenameMap(kMap, "../lab")), Reason::kMapNameInvalid);
  EXPECT_EQ(ReasonOf(store_->RenameMap(kMap, "")), Reason::kMapNameInvalid);
  EXPECT_TRUE(IsThere());
  EXPECT_EQ(Names(), (std::vector<std::string>{"office", "zoo"}));
}

TEST_P(WholeMaps, AreNotCurrentToTheirReadersWhenDropped) {
  const auto reader = OrDie(store_->OpenMap(kMap));
  const auto other = OrDie(Open("other")->OpenMap(kMap));
  EXPECT_TRUE(reader->IsCurrent());
  OrDie(store_->DropMap(kMap, {}).status());
  EXPECT_FALSE(reader->IsCurrent());
  EXPECT_FALSE(other->IsCurrent());
  OrDie(store_->CreateMap(Spec(TrajectoryCodec::kQuantized)));
  EXPECT_FALSE(reader->IsCurrent());
  EXPECT_TRUE(OrDie(store_->OpenMap(kMap))->IsCurrent());
}

TEST_P(WholeMaps, KeepTheirHistoryWhenRenamed) {
  const std::vector<std::string> digests = Digests(kMap);
  const std::string content = DumpOf(kMap);
  const std::string incarnation = OrDie(store_->OpenMap(kMap))->incarnation();
  OrDie(store_->RenameMap(kMap, "attic"));
  EXPECT_EQ(Names(), (std::vector<std::string>{"attic", "zoo"}));
  EXPECT_EQ(ReasonOf(store_->OpenMap(kMap).status()), Reason::kMapUnknown);
  EXPECT_EQ(ReasonOf(store_->OpenWriter(kMap).status()), Reason::kMapUnknown);
  EXPECT_EQ(Digests("attic"), digests);
  EXPECT_EQ(absl::StrReplaceAll(DumpOf("attic"), {{"spec:\nattic ", "spec:\noffice "}}), content);
  const auto map = OrDie(store_->OpenMap("attic"));
  EXPECT_EQ(map->spec().name, "attic");
  EXPECT_EQ(map->incarnation(), incarnation);
  EXPECT_TRUE(OrDie(map->Verify({}, {})).problems.empty());
  ASSERT_EQ(OrDie(map->Tags()).size(), 1u);
  EXPECT_EQ(OrDie(map->Tags())[0].revision, 3);
  OrDie(OrDie(map->At(2))->Stats());
}

TEST_P(WholeMaps, AreWrittenOnUnderTheirNewName) {
  OrDie(store_->RenameMap(kMap, "attic"));
  const auto writer = OrDie(store_->OpenWriter("attic"));
  GraphDelta again = DeltaOfStream({}, kLength);
  again.map = "attic";
  EXPECT_TRUE(OrDie(writer->Commit(again)).replayed);
  GraphDelta next = DeltaOfStream({}, kLength + 1);
  next.map = "attic";
  EXPECT_EQ(OrDie(writer->Commit(next)).revision, kLength + 1);
}

TEST_P(WholeMaps, AreNotCurrentToTheirReadersWhenRenamed) {
  const auto reader = OrDie(store_->OpenMap(kMap));
  OrDie(store_->RenameMap(kMap, "attic"));
  EXPECT_FALSE(reader->IsCurrent());
  // The old name is free, and another map of it is another one.
  OrDie(store_->CreateMap(Spec(TrajectoryCodec::kQuantized)));
  EXPECT_FALSE(reader->IsCurrent());
  EXPECT_EQ(OrDie(OrDie(store_->OpenMap(kMap))->Head()).revision, 0);
  EXPECT_EQ(OrDie(OrDie(store_->OpenMap("attic"))->Head()).revision, kLength);
}

TEST_P(WholeMaps, AreNotRenamedToAMapThatIsThere) {
  EXPECT_EQ(ReasonOf(store_->RenameMap(kMap, "zoo")), Reason::kMapExists);
  EXPECT_EQ(ReasonOf(store_->RenameMap(kMap, kMap)), Reason::kMapExists);
  EXPECT_TRUE(IsThere());
  EXPECT_EQ(OrDie(OrDie(store_->OpenMap("zoo"))->Head()).revision, 0);
}

TEST_P(WholeMaps, AreRenamedToAndFro) {
  const std::string content = DumpOf(kMap);
  OrDie(store_->RenameMap(kMap, "attic"));
  OrDie(store_->RenameMap("zoo", kMap));
  OrDie(store_->RenameMap(kMap, "zoo"));
  OrDie(store_->RenameMap("attic", kMap));
  EXPECT_EQ(DumpOf(kMap), content);
  EXPECT_TRUE(OrDie(OrDie(store_->OpenMap(kMap))->Verify({}, {})).problems.empty());
}

}  // namespace
}  // namespace dsg::test
