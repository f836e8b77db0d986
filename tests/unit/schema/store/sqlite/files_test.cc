// SPDX-License-Identifier: Apache-2.0
// What only a store of files promises: damage that is found, bytes that come back, steps of any
// size, bounds of tables.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <map>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "schema/store/sqlite/erasure.h"
#include "schema/store/sqlite/map_file.h"
#include "tests/unit/schema/codec/body_meshes.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr TimeNs kPeriodNs = 200'000'000;
constexpr int kRevisionCount = 60;

GraphDelta DeltaOfShapes(std::vector<BodyShape> shapes) {
  GraphDelta delta;
  delta.shapes = {{kAnn, std::nullopt, std::move(shapes)}};
  return delta;
}

void FillFromStream(TestMap* map) {
  for (Revision r = 1; r <= kRevisionCount; ++r) {
    map->MustCommit(DeltaOfStream({.seed = RecordSeed()}, r));
  }
}

// Through the layer that seals pages, so that only the row is wrong.
void Damage(TestMap* map, const char* sql) {
  map->Close();
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open_v2(map->database_path().c_str(), &db, SQLITE_OPEN_READWRITE, "dsg-sealed"),
            SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
  map->Reopen();
}

TEST(BatchReads, FindRowsThatAreNotWhatWasWritten) {
  TestMap map;
  const Node cup = MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1));
  const Node table = MakeObject(2, "table", BoxOf(0, 0, 0, 2, 2, 1));
  GraphDelta delta = DeltaOfNodes({cup, table});
  delta.edges.push_back(MakeEdge(cup.id, "ON", table.id));
  map.MustCommit(std::move(delta));
  ASSERT_TRUE(map.Latest()->FindNodes({cup.id}, {}).ok());
  Damage(&map, "UPDATE node SET checksum = checksum + 1; UPDATE edge SET weight = 7.0");
  const auto ignore = [](const auto&) {};
  EXPECT_TRUE(absl::IsDataLoss(map.Latest()->FindNodes({cup.id}, {}).status()));
  EXPECT_TRUE(absl::IsDataLoss(map.Latest()->FindEdges({{cup.id, "ON", table.id}}, {}).status()));
  EXPECT_TRUE(absl::IsDataLoss(map.Latest()->ReadAllNodes({}, ignore)));
  EXPECT_TRUE(absl::IsDataLoss(map.Latest()->ReadAllEdges({}, ignore)));
  // What is sound next to it can be read, and the connection is of use again.
  EXPECT_EQ(OrDie(map.Latest()->FindNodes({NodeId('O', 3)}, {})).front(), std::nullopt);
}

// Two ways to the same answer: the lists that commits leave, and the rows themselves.
TEST(TouchedLists, AreCheckedByVerify) {
  TestMap map;
  FillFromStream(&map);
  EXPECT_EQ(map.Problems(), "");
  Damage(&map, "DELETE FROM touched WHERE revision = 5");
  EXPECT_NE(map.Problems().find("touched 5"), std::string::npos) << map.Problems();
  EXPECT_EQ(ReasonOf(map.reader().TouchedBetween(3, 8, {}).status()), Reason::kStoreCorrupt);
  EXPECT_TRUE(map.reader().TouchedBetween(5, 8, {}).ok());
}

TEST(TouchedLists, AreNotBelievedWhenOfAnotherRevision) {
  TestMap map;
  FillFromStream(&map);
  Damage(&map,
         "UPDATE touched SET (payload, checksum) ="
         " (SELECT payload, checksum FROM touched WHERE revision = 6) WHERE revision = 5");
  EXPECT_EQ(ReasonOf(map.reader().TouchedBetween(4, 5, {}).status()), Reason::kStoreCorrupt);
  EXPECT_NE(map.Problems().find("touched"), std::string::npos);
}

// How much the file grows by a body, committed in batches of `batch`.
double BytesPerBody(const std::vector<BodyShape>& bodies, size_t batch) {
  TestMap map(Spec(TrajectoryCodec::kQuantized));
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  const auto size = [&] {
    map.Close();
    map.Reopen();
    return OrDie(map.Latest()->Stats()).bytes_on_disk;
  };
  const int64_t before = size();
  for (size_t i = 0; i < bodies.size(); i += batch) {
    const auto begin = bodies.begin() + static_cast<std::ptrdiff_t>(i);
    const auto count = static_cast<std::ptrdiff_t>(std::min(batch, bodies.size() - i));
    map.MustCommit(DeltaOfShapes({begin, begin + count}));
  }
  const double bytes = static_cast<double>(size() - before) / static_cast<double>(bodies.size());
  std::printf("%zu bodies in batches of %zu: %.0f bytes of the file each\n", bodies.size(), batch,
              bytes);
  EXPECT_EQ(map.Problems(), "");
  return bytes;
}

TEST(ShapesOnDisk, TakeAtMost25KiBABodyOf6890Vertices) {
  std::vector<float> rest = RealBody();
  if (rest.empty()) rest = MadeBody(6890);
  std::vector<BodyShape> bodies(50);
  for (int i = 0; i < 50; ++i) {
    bodies[static_cast<size_t>(i)].time_ns = i * kPeriodNs;
    bodies[static_cast<size_t>(i)].vertices = Walking(rest, i);
  }
  EXPECT_LE(BytesPerBody(bodies, 50), 25 * 1024);
  EXPECT_LE(BytesPerBody(bodies, 1), 25 * 1024);
}

TEST(ShapesOnDisk, TakeAtMost400BytesABodyOfCoefficientsAndJoints) {
  std::vector<BodyShape> bodies;
  for (int i = 0; i < 500; ++i) {
    bodies.push_back(AnyCoefficients(i * kPeriodNs, static_cast<uint64_t>(i)));
  }
  EXPECT_LE(BytesPerBody(bodies, 50), 400);
  // A commit has a row of its own in the table of revisions, whatever else it holds.
  EXPECT_LE(BytesPerBody(bodies, 1), 400 + 300);
}

TEST(ErasureOfFiles, GivesTheSameMapWhateverTheSteps) {
  TestMap map;
  for (int64_t s = 1; s <= 36; ++s) map.MustCommit(DeltaOfStream({.seed = 5}, s));
  GraphDelta delta;
  for (const NodeId id : {NodeId('O', 5), NodeId('H', 1), NodeId('p', 4)}) {
    delta.retirements.push_back({id, std::nullopt});
  }
  const TrackSpan span{NodeId('H', 2), 20 * kSecond, 50 * kSecond};
  delta.corrections.push_back({span.agent, span.from_ns, span.to_ns, {}});
  map.MustCommit(delta);
  map.Close();
  const Erasure erasure{
      .nodes = {NodeId('O', 5), NodeId('R', 1), NodeId('p', 4), NodeId('p', 3), NodeId('H', 1)},
      .edges = {{NodeId('p', 1), relations::kTraversable, NodeId('p', 2)}},
      .mesh_blocks = {{4, 0, 0}, {8, 0, 0}},
      .tracks = {span, {NodeId('H', 4), 0, 10 * kSecond}},
      .assets = true};
  std::map<Revision, std::string> digests;
  for (const int64_t rows : {int64_t{1'000'000}, int64_t{1}, int64_t{5}}) {
    TempFolder folder;
    std::filesystem::copy(map.folder(), folder.path(), std::filesystem::copy_options::recursive);
    EraseReport report;
    {
      const auto db =
          OrDie(sqlite::OpenMapFile(folder.path(), kMap, sqlite::Database::Mode::kWrite));
      OrDie(sqlite::EraseFromMap(*db, Spec(TrajectoryCodec::kLossless), erasure, {}, {}, &report,
                                 {.rows = rows}));
    }
    EXPECT_GT(report.row_count, 50);
    const auto copy = OrDie(OrDie(GraphStore::Open(folder.path(), {}))->OpenMap(kMap));
    const VerifyReport verified = OrDie(copy->Verify({}, {}));
    EXPECT_TRUE(verified.problems.empty()) << verified.problems.front();
    for (const RevisionInfo& info : OrDie(copy->ListRevisions(0, 1000))) {
      const std::string digest = ToHex(info.digest);
      EXPECT_EQ(digests.emplace(info.revision, digest).first->second, digest) << info.revision;
    }
  }
}

TEST(CompactionOfFiles, GivesTheBytesBack) {
  TestMap map;
  FillFromStream(&map);
  const CompactReport report = OrDie(map.writer().Compact(60, {}, {}));
  EXPECT_TRUE(report.is_shrunk);
  EXPECT_LT(report.bytes_after, report.bytes_before / 2);
  EXPECT_EQ(report.bytes_after, OrDie(map.Latest()->Stats()).bytes_on_disk);
  EXPECT_EQ(map.Problems(), "");
}

TEST(CompactionOfFiles, CountsAcrossSlices) {
  const auto whole = [&] {
    TestMap map;
    FillFromStream(&map);
    return OrDie(map.writer().Compact(40, {}, {}));
  }();
  TestMap map;
  FillFromStream(&map);
  absl::StatusOr<CompactReport> report = absl::CancelledError("not yet");
  for (int slice = 0; !report.ok(); ++slice) {
    ASSERT_LT(slice, 1000);
    // A tag changes what is to go, but not what went.
    if (slice == 3) OrDie(map.writer().SetTag("now", kRevisionCount, ""));
    if (slice == 4) OrDie(map.writer().RemoveTag("now"));
    int left = 1;
    report = map.writer().Compact(
        40, [&] { return left-- > 0 ? absl::OkStatus() : absl::CancelledError("enough"); }, {});
  }
  EXPECT_EQ(report->row_count, whole.row_count);
  EXPECT_EQ(report->revision_count, whole.revision_count);
  EXPECT_EQ(report->asset_count, whole.asset_count);
  EXPECT_GT(report->bytes_before, report->bytes_after);
}

// Written past the map's writer: each of its commits waits for the disk.
void AddTags(const std::string& folder, int count, int note_bytes) {
  const auto db = OrDie(sqlite::OpenMapFile(folder, kMap, sqlite::Database::Mode::kWrite));
  OrDie(db->Execute(absl::StrCat("WITH RECURSIVE i(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM i"
                                 " WHERE n < ",
                                 count,
                                 ") INSERT INTO tag (name, revision, created_ns, note)"
                                 " SELECT 't' || n, 1, 0, printf('%.*c', ",
                                 note_bytes, ", 'x') FROM i")
                        .c_str()));
}

TEST(TagTable, AreOfABoundedNumber) {
  TestMap map;
  for (int64_t s = 1; s <= 5; ++s) map.MustCommit(DeltaOfStream({}, s));
  AddTags(map.folder(), 9'999, 1);
  OrDie(map.writer().SetTag("last", 1, ""));
  const auto refused = map.writer().SetTag("more", 1, "").status();
  EXPECT_EQ(ReasonOf(refused), Reason::kQuotaExceeded);
  EXPECT_TRUE(absl::StrContains(refused.message(), "at most 10000 tags")) << refused;
  // One that is there may move, and errors do not list them all.
  OrDie(map.writer().SetTag("last", 2, ""));
  const auto unknown = map.writer().RemoveTag("none");
  EXPECT_TRUE(absl::StrContains(unknown.message(), "and 9980 more")) << unknown;
  EXPECT_LT(unknown.message().size(), 300U);
  OrDie(map.writer().RemoveTag("t1"));
  OrDie(map.writer().SetTag("more", 1, ""));
}

TEST(TagTable, HaveNotesOfABoundedLengthAltogether) {
  TestMap map;
  for (int64_t s = 1; s <= 5; ++s) map.MustCommit(DeltaOfStream({}, s));
  AddTags(map.folder(), 2'097, 1'000);
  OrDie(map.writer().SetTag("a", 1, std::string(152, 'a')));
  const auto refused = map.writer().SetTag("b", 1, "b").status();
  EXPECT_EQ(ReasonOf(refused), Reason::kQuotaExceeded);
  EXPECT_TRUE(absl::StrContains(refused.message(), "bytes of notes")) << refused;
  OrDie(map.writer().SetTag("b", 1, ""));
}

}  // namespace
}  // namespace dsg::test
