// SPDX-License-Identifier: Apache-2.0
// Stores and their maps: made, found, opened by many for reading and by one for writing.
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/match.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

class Stores : public OnEveryBackend {
 protected:
  std::string uri() const { return UriOf(GetParam(), folder_.path()); }
  std::unique_ptr<GraphStore> Open() const {
    return OrDie(OpenStore(uri(), {.create = true, .program = "store-test"}));
  }
  static MapSpec Named(const std::string& name) {
    MapSpec spec;
    spec.name = name;
    return spec;
  }

  TempFolder folder_;
};
class Verify : public OnEveryBackend {};
DSG_ON_EVERY_BACKEND(Stores);
DSG_ON_EVERY_BACKEND(Verify);

TEST_P(Stores, AreNotMadeUnlessAsked) {
  const std::string none = UriOf(GetParam(), folder_.path() + "/none");
  EXPECT_EQ(ReasonOf(OpenStore(none, {}).status()), Reason::kMapUnknown);
  EXPECT_TRUE(OpenStore(none, {.create = true}).ok());
}

TEST_P(Stores, InAFolderOfTheirOwnAreForTheirUserAlone) {
  namespace fs = std::filesystem;
  const std::string folder = folder_.path() + "/own";
  const auto store = OrDie(OpenStore(UriOf(GetParam(), folder), {.create = true}));
  OrDie(store->CreateMap(Named("lab")));
  const auto writer = OrDie(store->OpenWriter("lab"));
  std::error_code error;
  // The other backend has no files.
  if (!fs::exists(folder, error)) return;
  constexpr fs::perms kOthers = fs::perms::group_all | fs::perms::others_all;
  EXPECT_EQ(fs::status(folder).permissions() & kOthers, fs::perms::none);
  int count = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    EXPECT_EQ(entry.status().permissions() & kOthers, fs::perms::none) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 4);
}

TEST_P(Stores, ListTheirMapsByName) {
  const auto store = Open();
  EXPECT_TRUE(OrDie(store->ListMaps()).empty());
  for (const char* name : {"zoo", "attic", "lab"}) OrDie(store->CreateMap(Named(name)));
  const auto maps = OrDie(store->ListMaps());
  ASSERT_EQ(maps.size(), 3u);
  EXPECT_EQ(maps[0].name, "attic");
  EXPECT_EQ(maps[1].name, "lab");
  EXPECT_EQ(maps[2].name, "zoo");
}

TEST_P(Stores, KeepTheSpecOfAMap) {
  const auto store = Open();
  MapSpec spec = Named("lab");
  spec.frame = "hall";
  spec.epoch_ns = 1'700'000'000 * kSecond;
  spec.clock = Clock::kUnix;
  spec.codec = TrajectoryCodec::kLossless;
  spec.gap_ns_max = kSecond / 3;
  spec.mesh_block_size_m = 0.7;
  OrDie(store->CreateMap(spec));
  const MapSpec kept = OrDie(store->OpenMap("lab"))->spec();
  EXPECT_EQ(kept.frame, spec.frame);
  EXPECT_EQ(kept.epoch_ns, spec.epoch_ns);
  EXPECT_EQ(kept.clock, spec.clock);
  EXPECT_EQ(kept.codec, spec.codec);
  EXPECT_EQ(kept.gap_ns_max, spec.gap_ns_max);
  EXPECT_EQ(kept.mesh_block_size_m, spec.mesh_block_size_m);
}

TEST_P(Stores, RefuseWhatIsNoMapAndASecondOfOneName) {
  const auto store = Open();
  OrDie(store->CreateMap(Named("lab")));
  EXPECT_EQ(ReasonOf(store->CreateMap(Named("lab"))), Reason::kMapExists);
  EXPECT_EQ(ReasonOf(store->CreateMap(Named("../lab"))), Reason::kMapNameInvalid);
  EXPECT_EQ(ReasonOf(store->OpenMap("zoo").status()), Reason::kMapUnknown);
  EXPECT_EQ(ReasonOf(store->OpenWriter("zoo").status()), Reason::kMapUnknown);
  EXPECT_EQ(ReasonOf(store->OpenMap("../lab").status()), Reason::kMapNameInvalid);
  MapSpec absurd = Named("absurd");
  absurd.gap_ns_max = 0;
  EXPECT_FALSE(store->CreateMap(absurd).ok());
}

TEST_P(Stores, AreOneForAllWhoOpenThem) {
  const auto one = Open();
  OrDie(one->CreateMap(Named("lab")));
  const auto other = OrDie(OpenStore(uri(), {}));
  const auto reader = OrDie(other->OpenMap("lab"));
  GraphDelta delta = DeltaOfNodes({MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1))});
  delta.session_id = "s";
  delta.sequence = 1;
  OrDie(OrDie(one->OpenWriter("lab"))->Commit(delta));
  EXPECT_EQ(OrDie(reader->Head()).revision, 1);
  EXPECT_EQ(OrDie(OrDie(reader->Latest())->GetNode(NodeId('O', 1))).name, "cup");
}

TEST_P(Stores, LetOneWriteAMapAtATime) {
  const auto store = Open();
  OrDie(store->CreateMap(Named("lab")));
  OrDie(store->CreateMap(Named("zoo")));
  auto writer = OrDie(store->OpenWriter("lab"));
  const auto second = OrDie(OpenStore(uri(), {}))->OpenWriter("lab");
  EXPECT_EQ(ReasonOf(second.status()), Reason::kWriterLocked);
  EXPECT_TRUE(absl::StrContains(second.status().message(), "store-test")) << second.status();
  EXPECT_TRUE(store->OpenWriter("zoo").ok());
  EXPECT_TRUE(store->OpenMap("lab").ok());
  writer.reset();
  EXPECT_TRUE(store->OpenWriter("lab").ok());
}

TEST_P(Stores, TellTheirMapsApart) {
  const auto store = Open();
  OrDie(store->CreateMap(Named("lab")));
  OrDie(store->CreateMap(Named("zoo")));
  const auto lab = OrDie(store->OpenMap("lab"));
  const auto again = OrDie(store->OpenMap("lab"));
  EXPECT_EQ(lab->incarnation(), again->incarnation());
  EXPECT_NE(lab->incarnation(), OrDie(store->OpenMap("zoo"))->incarnation());
  EXPECT_NE(lab->opening(), again->opening());
}

TEST_P(Stores, SayWhetherTheyKeepFiles) {
  const auto store = Open();
  OrDie(store->CreateMap(Named("lab")));
  const auto map = OrDie(store->OpenMap("lab"));
  const absl::Status copied = map->CopyTo(folder_.path() + "/copy", {}, {});
  if (!store->folder().empty()) {
    EXPECT_TRUE(copied.ok()) << copied;
    return;
  }
  EXPECT_TRUE(absl::IsUnimplemented(copied)) << copied;
  EXPECT_TRUE(absl::IsUnimplemented(store->InstallMap("zoo", folder_.path() + "/copy", false)));
  EXPECT_EQ(OrDie(OrDie(map->Latest())->Stats()).bytes_on_disk, 0);
  EXPECT_EQ(OrDie(store->UpgradeMap("lab")).copy, "");
}

TEST_P(Verify, CountsWhatIsThereAndFindsNothingWrong) {
  TestMap map(GetParam());
  for (int64_t s = 1; s <= 12; ++s) map.MustCommit(DeltaOfStream({}, s));
  const VerifyReport report = OrDie(map.reader().Verify({}, {}));
  EXPECT_TRUE(report.problems.empty());
  EXPECT_TRUE(report.notes.empty());
  EXPECT_EQ(report.revision_count, 12);
  EXPECT_GE(report.row_count, OrDie(map.reader().Head()).node_count);
  EXPECT_GE(report.pose_count, OrDie(map.reader().Head()).pose_count);
}

TEST_P(Verify, NotesAnErasureThatIsUnderWay) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfStream({}, 1));
  OrDie(map.writer().NoteErasure({.nodes = {NodeId('O', 1)}}, 1));
  const VerifyReport report = OrDie(map.reader().Verify({}, {}));
  ASSERT_EQ(report.notes.size(), 1u);
  EXPECT_TRUE(absl::StrContains(report.notes[0], "names 1 nodes")) << report.notes[0];
}

TEST_P(Verify, StopsWhenTold) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfStream({}, 1));
  const auto report = map.reader().Verify([] { return absl::CancelledError("enough"); }, {});
  EXPECT_TRUE(absl::IsCancelled(report.status()));
}

TEST(OpenStore, TakesABarePathForAFolder) {
  const TempFolder folder;
  OrDie(OrDie(OpenStore("file:" + folder.path(), {}))->CreateMap(Spec(TrajectoryCodec::kLossless)));
  const auto store = OrDie(OpenStore(folder.path(), {}));
  EXPECT_EQ(store->folder(), OrDie(OpenStore("file:" + folder.path(), {}))->folder());
  EXPECT_TRUE(store->OpenMap(kMap).ok());
}

TEST(OpenStore, KeepsAStoreInMemoryWhileSomebodyHasItOpen) {
  {
    const auto store = OrDie(OpenStore("memory:short", {.create = true}));
    OrDie(store->CreateMap(Spec(TrajectoryCodec::kLossless)));
    EXPECT_TRUE(OrDie(OpenStore("memory:short", {}))->OpenMap(kMap).ok());
    EXPECT_FALSE(OpenStore("memory:other", {}).ok());
  }
  EXPECT_EQ(ReasonOf(OpenStore("memory:short", {}).status()), Reason::kMapUnknown);
}

}  // namespace
}  // namespace dsg::test
