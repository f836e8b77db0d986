// SPDX-License-Identifier: Apache-2.0
// Erasures that are cut off: the map knows what is left of them, and the next one does it.
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/erasure.h"
#include "schema/store/sqlite/map_file.h"
#include "schema/store/sqlite/space.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kFirst = 7000;
constexpr int kCount = 8;
const NodeId kAgent('H', 1);

std::string SecretOf(int i) { return absl::StrCat("planted-secret-", 7919 * i); }

// Objects with names that are looked for, retired with an agent as one who forgets them would.
class PendingErasure : public testing::Test {
 protected:
  PendingErasure() : map_(Spec(TrajectoryCodec::kQuantized)) {
    for (int64_t s = 1; s <= 12; ++s) map_.MustCommit(DeltaOfStream({.seed = 5}, s));
    GraphDelta planted;
    GraphDelta gone;
    erasure_ = {.nodes = {kAgent}, .tracks = {{NodeId('H', 2), 0, 5 * kSecond}}, .assets = true};
    for (int i = 0; i < kCount; ++i) {
      const NodeId id('O', kFirst + static_cast<uint64_t>(i));
      planted.nodes.push_back(MakeObject(id.index(), SecretOf(i), BoxOf(1, 1, 0, 2, 2, 1)));
      erasure_.nodes.push_back(id);
    }
    for (const NodeId id : erasure_.nodes) gone.retirements.push_back({id, std::nullopt});
    map_.MustCommit(planted);
    map_.MustCommit(gone);
    map_.Close();
  }

  // Of the base, erased from until `stop_count` questions were answered; false if it came to its
  // end before.
  bool CutOff(const std::string& folder, int stop_count) {
    fs::copy(map_.folder(), folder, fs::copy_options::recursive);
    const auto db = OrDie(sqlite::OpenMapFile(folder, kMap, sqlite::Database::Mode::kWrite));
    EraseReport report;
    int left = stop_count;
    const absl::Status status = sqlite::EraseFromMap(
        *db, Spec(TrajectoryCodec::kQuantized), erasure_,
        [&] { return left-- > 0 ? absl::OkStatus() : absl::CancelledError("cut off"); }, {},
        &report, {.rows = 1});
    EXPECT_TRUE(status.ok() || absl::IsCancelled(status)) << status;
    return !status.ok();
  }

  static int HitCount(const std::string& folder) {
    const std::string bytes = ReadFolder(folder);
    int count = 0;
    for (int i = 0; i < kCount; ++i) count += absl::StrContains(bytes, SecretOf(i)) ? 1 : 0;
    return count;
  }

  static void ExpectSound(GraphStore& store, bool is_pending) {
    const auto map = OrDie(store.OpenMap(kMap));
    EXPECT_EQ(OrDie(map->GetPendingErasure()).has_value(), is_pending);
    const VerifyReport report = OrDie(map->Verify({}, {}));
    EXPECT_TRUE(report.problems.empty()) << report.problems.front();
    EXPECT_EQ(report.notes.size(), is_pending ? 1u : 0u);
  }

  TestMap map_;
  Erasure erasure_;
};

TEST_F(PendingErasure, IsEndedByTheNextOneWhateverThatNames) {
  const Erasure others[] = {
      {}, {.nodes = {NodeId('O', 999'999)}}, {.tracks = {{NodeId('H', 3), 0, 1}}}};
  bool has_had_more = false;
  for (int stop_count = 0;; ++stop_count) {
    SCOPED_TRACE(absl::StrCat("stopped after ", stop_count));
    const TempFolder folder;
    const std::string path = folder.path() + "/store";
    const bool was_cut_off = CutOff(path, stop_count);
    has_had_more = has_had_more || (HitCount(path) > 0 && HitCount(path) < kCount);
    const auto store = OrDie(GraphStore::Open(path, {}));
    ExpectSound(*store, was_cut_off);
    {
      const auto writer = OrDie(store->OpenWriter(kMap));
      // Nothing but the list knows then what is left.
      if (stop_count % 2 == 0)
        OrDie(writer->Compact(OrDie(store->OpenMap(kMap))->Head()->revision, {}, {}));
      const EraseReport report = OrDie(writer->Erase(others[stop_count % 3], {}, {}));
      EXPECT_EQ(report.was_pending, was_cut_off);
      EXPECT_TRUE(report.is_clean);
      EXPECT_TRUE(report.left_agents.empty());
    }
    EXPECT_EQ(HitCount(path), 0);
    ExpectSound(*store, false);
    if (!was_cut_off) break;
    ASSERT_LT(stop_count, 200);
  }
  EXPECT_TRUE(has_had_more) << "no cut fell between two rows";
}

TEST_F(PendingErasure, GoesWithACopyOfTheMap) {
  const TempFolder folder;
  const std::string path = folder.path() + "/store";
  ASSERT_TRUE(CutOff(path, 6));
  const auto store = OrDie(GraphStore::Open(path, {}));
  const std::string copy = folder.path() + "/copy";
  OrDie(OrDie(store->OpenMap(kMap))->CopyTo(copy, {}, {}));
  OrDie(store->InstallMap(kMap, copy, true));
  ExpectSound(*store, true);
  EXPECT_GT(HitCount(path), 0);
  OrDie(OrDie(store->OpenWriter(kMap))->Erase({}, {}, {}));
  EXPECT_EQ(HitCount(path), 0);
  ExpectSound(*store, false);
}

TEST_F(PendingErasure, OfACopyOfWhichAllRowsAreGoneIsOver) {
  const TempFolder folder;
  const std::string path = folder.path() + "/store";
  int stop_count = 0;
  for (; CutOff(path, stop_count); ++stop_count) fs::remove_all(path);
  fs::remove_all(path);
  ASSERT_TRUE(CutOff(path, stop_count - 1));
  const auto store = OrDie(GraphStore::Open(path, {}));
  ExpectSound(*store, true);
  OrDie(OrDie(store->OpenMap(kMap))->CopyTo(folder.path() + "/copy", {}, {}));
  OrDie(store->InstallMap(kMap, folder.path() + "/copy", true));
  ExpectSound(*store, false);
}

TEST_F(PendingErasure, LeavesAndNamesAgentsThatAreBack) {
  const TempFolder folder;
  const std::string path = folder.path() + "/store";
  ASSERT_TRUE(CutOff(path, 1));
  const auto store = OrDie(GraphStore::Open(path, {}));
  {
    const auto writer = OrDie(store->OpenWriter(kMap));
    GraphDelta back = DeltaOfNodes({MakeHuman(kAgent.index(), "back")});
    back.map = kMap;
    back.session_id = "back";
    back.sequence = 1;
    OrDie(writer->Commit(back));
    const EraseReport report = OrDie(writer->Erase({}, {}, {}));
    EXPECT_EQ(report.left_agents, std::vector<NodeId>{kAgent});
    EXPECT_TRUE(report.is_clean);
  }
  EXPECT_TRUE(OrDie(OrDie(store->OpenMap(kMap))->Latest())->GetNode(kAgent).ok());
  EXPECT_EQ(HitCount(path), 0);
  ExpectSound(*store, false);
}

TEST_F(PendingErasure, IsWrittenOnceForAllSlicesAndJoinsWithAnother) {
  const TempFolder folder;
  const std::string path = folder.path() + "/store";
  ASSERT_TRUE(CutOff(path, 2));
  const auto db = OrDie(sqlite::OpenMapFile(path, kMap, sqlite::Database::Mode::kWrite));
  const auto write = [&](const EraseList& list) {
    OrDie(sqlite::InTransaction(*db, [&] { return sqlite::WritePendingErasure(*db, list); }));
  };
  EraseList list = OrDie(sqlite::ReadPendingErasure(*db));
  EXPECT_EQ(list.size(), erasure_.nodes.size() + 1);
  const int64_t changes = OrDie(db->QueryInt("SELECT total_changes()"));
  write(list);
  EXPECT_EQ(OrDie(db->QueryInt("SELECT total_changes()")), changes);
  const Erasure more{.nodes = {NodeId('O', 3), kAgent},
                     .edges = {{NodeId('p', 1), "NEVER", NodeId('p', 9)},
                               {NodeId('p', 1), relations::kTraversable, NodeId('p', 2)}},
                     .mesh_blocks = {{-1, 2, -3}},
                     .tracks = {{NodeId('H', 2), 5 * kSecond, 9 * kSecond}}};
  list.Add(OrDie(sqlite::ListIn(*db, more)));
  write(list);
  const EraseList joined = OrDie(sqlite::ReadPendingErasure(*db));
  EXPECT_EQ(joined.keys.nodes.size(), erasure_.nodes.size() + 1);
  EXPECT_EQ(joined.keys.edges.size(), 1u);
  EXPECT_EQ(joined.keys.mesh_blocks, (std::vector<BlockIndex>{{-1, 2, -3}}));
  ASSERT_EQ(joined.spans.size(), 1u);
  EXPECT_EQ(joined.spans[0].from_ns, 0);
  EXPECT_EQ(joined.spans[0].to_ns, 9 * kSecond);
  EXPECT_TRUE(joined.assets);
}

TEST_F(PendingErasure, ThatIsDamagedIsFoundAndNotTakenForNone) {
  const TempFolder folder;
  const std::string path = folder.path() + "/store";
  ASSERT_TRUE(CutOff(path, 2));
  {
    const auto db = OrDie(sqlite::OpenMapFile(path, kMap, sqlite::Database::Mode::kWrite));
    OrDie(db->Execute("UPDATE pending_erasure SET assets = 0"));
  }
  const auto store = OrDie(GraphStore::Open(path, {}));
  const VerifyReport report = OrDie(OrDie(store->OpenMap(kMap))->Verify({}, {}));
  ASSERT_EQ(report.problems.size(), 1u);
  EXPECT_TRUE(absl::StrContains(report.problems[0], "pending_erasure")) << report.problems[0];
  const auto erased = OrDie(store->OpenWriter(kMap))->Erase({}, {}, {});
  EXPECT_EQ(ReasonOf(erased.status()), Reason::kStoreCorrupt);
}

}  // namespace
}  // namespace dsg::test
