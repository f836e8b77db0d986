// SPDX-License-Identifier: Apache-2.0
// Forgetting and compacting a map that the disk has damaged: what they meet is told, and nothing is
// made to look sound that is not.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <set>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "schema/store/sqlite/map_file.h"
#include "tests/unit/schema/retention/prune_test_util.h"

namespace dsg::test {
namespace {

constexpr char kBranch[] = "R1";

// What a reader of the map says of each of its revisions, by revision.
using Told = std::map<Revision, absl::StatusOr<std::string>>;

// As Dump, but for the clock on the wall.
absl::StatusOr<std::string> TextOf(const Snapshot& snapshot) {
  std::string text;
  for (const Answer& answer : AskEverything(snapshot)) {
    DSG_RETURN_IF_ERROR(answer.text.status());
    if (answer.question != "stats") {
      absl::StrAppend(&text, answer.question, ":\n", *answer.text);
    }
  }
  return text;
}

class Damage : public testing::Test {
 protected:
  // A house out of which a room was taken, with the revision before.
  Damage() {
    TestMap map;
    FillHouse(&map);
    GraphDelta delta;
    delta.nodes = {MakeObject(80, "planted-name", BoxOf(2, 2, 0, 3, 3, 1))};
    delta.edges = {MakeEdge({'p', 1}, relations::kContains, {'O', 80})};
    map.MustCommit(std::move(delta));
    map.MustCommit(DeltaOfPoses(kStander, {PoseAt(6 * kSecond, 2, 5, 1)}));
    Prune(&map, {PolicyOf(PrunePolicy::Branch{"p3"})});
    head_ = OrDie(map.reader().Head()).revision;
    map.Close();
    sound_ = ReadFile(map.database_path());
    std::filesystem::create_directory(folder_.path() + "/" + kMap);
  }

  void Write(const std::string& bytes) {
    const std::string path = folder_.path() + "/" + kMap + "/graph.db";
    for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(path + suffix);
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
  }

  // Changes rows past everything that guards them but their own checksums.
  void Execute(const std::string& sql) {
    const auto db =
        OrDie(sqlite::OpenMapFile(folder_.path(), kMap, sqlite::Database::Mode::kWrite));
    OrDie(db->Execute(sql.c_str()));
    db->Checkpoint(/*truncate=*/true);
  }

  // All that dsg prune does to a map, but for its answers.
  absl::Status PruneBranch(const std::string& branch, PruneStrength strength) {
    DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder_.path(), {}));
    DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kMap));
    DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kMap));
    DSG_ASSIGN_OR_RETURN(const auto at_plan, map->Latest());
    PrunePolicy policy = PolicyOf(PrunePolicy::Branch{branch});
    policy.strength = strength;
    DSG_ASSIGN_OR_RETURN(const PrunePlan plan,
                         PlanPrune(map.get(), *at_plan, {policy}, {}, StopCheck()));
    PruneBatches batches(at_plan, plan, {kMap, "prune-damaged", "test", "prune"});
    for (;;) {
      DSG_ASSIGN_OR_RETURN(const auto head, map->Latest());
      DSG_ASSIGN_OR_RETURN(auto delta, batches.Next(*head, StopCheck()));
      if (!delta.has_value()) break;
      DSG_RETURN_IF_ERROR(writer->Commit(*std::move(delta)).status());
    }
    if (!plan.erasure.has_value()) return absl::OkStatus();
    return writer->Erase(*plan.erasure, StopCheck(), Progress()).status();
  }

  absl::Status Compact() {
    DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder_.path(), {}));
    DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kMap));
    DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kMap));
    DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
    return writer->Compact(head.revision, StopCheck(), Progress()).status();
  }

  Told Tell() {
    Told told;
    const auto store = OrDie(GraphStore::Open(folder_.path(), {}));
    const auto map = store->OpenMap(kMap);
    const auto revisions = map.ok() ? (*map)->ListRevisions(0, 100) : map.status();
    if (!revisions.ok()) {
      told.emplace(0, revisions.status());
      return told;
    }
    for (const RevisionInfo& info : *revisions) {
      const auto snapshot = (*map)->At(info.revision);
      told.emplace(info.revision, snapshot.ok() ? TextOf(**snapshot) : snapshot.status());
    }
    return told;
  }

  bool IsFoundByVerify() {
    const auto store = OrDie(GraphStore::Open(folder_.path(), {}));
    const auto map = store->OpenMap(kMap);
    const auto report = map.ok() ? (*map)->Verify({}, {}) : map.status();
    return !report.ok() || !report->problems.empty();
  }

  TempFolder folder_;
  std::string sound_;
  Revision head_ = 0;
};

bool IsToldAsLoss(const absl::Status& status) {
  return ReasonOf(status) == Reason::kStoreCorrupt && absl::IsDataLoss(status);
}

TEST_F(Damage, OfAnyByteIsToldByForgettingAndCompactingOrStaysToBeFound) {
  const std::map<std::string, std::function<absl::Status()>> works = {
      {"retire", [this] { return PruneBranch(kBranch, PruneStrength::kRetire); }},
      {"erase", [this] { return PruneBranch(kBranch, PruneStrength::kErase); }},
      {"compact", [this] { return Compact(); }}};
  std::mt19937_64 random(RecordSeed());
  const int64_t flip_count = EnvNumber("DSG_FLIPS", 25);
  int told_count = 0;
  // Each revision before each of the works and after it: of what erases, the commits come first.
  std::map<Revision, std::set<std::string>> allowed;
  for (const auto& [name, work] : works) {
    Write(sound_);
    for (const auto& [revision, text] : Tell()) allowed[revision].insert(OrDie(text));
    OrDie(work());
    for (const auto& [revision, text] : Tell()) allowed[revision].insert(OrDie(text));
  }
  for (const auto& [name, work] : works) {
    for (int64_t i = 0; i < flip_count; ++i) {
      const size_t at = random() % sound_.size();
      SCOPED_TRACE(absl::StrCat(name, ", byte ", at % 4096, " of page ", at / 4096 + 1));
      std::string bytes = sound_;
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
      Write(bytes);
      const absl::Status status = work();
      if (!status.ok()) ++told_count;
      bool is_whole = true;
      for (const auto& [revision, text] : Tell()) {
        is_whole = is_whole && text.ok();
        EXPECT_TRUE(!text.ok() || allowed[revision].contains(*text)) << "revision " << revision;
      }
      EXPECT_TRUE((is_whole && status.ok()) || IsFoundByVerify()) << status;
    }
  }
  std::printf("%d of %d runs met the damage\n", told_count, static_cast<int>(3 * flip_count));
  EXPECT_GT(told_count, 0);
}

TEST_F(Damage, OfWhatIsForgottenIsDataLossAndLeavesTheMapAsItWas) {
  const size_t at = sound_.find("planted-name");
  ASSERT_NE(at, std::string::npos);
  for (const PruneStrength strength : {PruneStrength::kRetire, PruneStrength::kErase}) {
    std::string bytes = sound_;
    bytes[at] ^= 1;
    Write(bytes);
    const absl::Status status = PruneBranch(kBranch, strength);
    EXPECT_TRUE(IsToldAsLoss(status)) << status;
    const auto map = OrDie(OrDie(GraphStore::Open(folder_.path(), {}))->OpenMap(kMap));
    EXPECT_EQ(OrDie(map->Head()).revision, head_) << "a part was written";
    EXPECT_TRUE(IsFoundByVerify());
  }
}

// Damage under the seals of pages: a machine's memory, or a program that should not have.
class DamagedRow : public Damage {
 protected:
  void ExpectToldByErasing(const std::string& sql) {
    SCOPED_TRACE(sql);
    Write(sound_);
    Execute(sql);
    const absl::Status status = PruneBranch(kBranch, PruneStrength::kErase);
    EXPECT_TRUE(IsToldAsLoss(status)) << status;
    EXPECT_TRUE(IsFoundByVerify());
  }
};

TEST_F(DamagedRow, IsNoReasonToVouchForItAnew) {
  ExpectToldByErasing("UPDATE revision SET author = 'nobody' WHERE revision = 2");
  ExpectToldByErasing("UPDATE revision SET node_count = node_count + 1 WHERE revision = 1");
  ExpectToldByErasing(
      "UPDATE node SET payload = CAST(payload || x'00' AS BLOB) WHERE name = 'planted-name'");
  ExpectToldByErasing("UPDATE edge SET weight = weight + 1");
  ExpectToldByErasing(
      "UPDATE touched SET payload = CAST(payload || x'00' AS BLOB) WHERE revision = 2");
}

TEST_F(DamagedRow, DoesNotCostTheModelThatItReferredTo) {
  TestMap map;
  FillHouse(&map);
  map.MustCommit(DeltaOfNodes({MakeObject(80, "lamp", BoxOf(2, 2, 0, 3, 3, 1))}));
  map.Close();
  Write(ReadFile(map.database_path()));
  Execute(
      "UPDATE node SET payload = (SELECT payload FROM node WHERE name = 'lamp')"
      " WHERE name <> 'lamp'");
  EXPECT_TRUE(IsToldAsLoss(Compact()));
  const auto then = OrDie(OrDie(GraphStore::Open(folder_.path(), {}))->OpenMap(kMap));
  EXPECT_TRUE(OrDie(then->Latest())->ReadAsset(ComputeSha256("a chair")).ok());
}

TEST_F(DamagedRow, DoesNotCostTheTopologyOfABody) {
  TestMap map;
  FillHouse(&map);
  GraphDelta delta;
  delta.assets = {{ComputeSha256("faces"), "model/ply", "faces"}};
  delta.shapes.push_back({kStander, delta.assets[0].sha256, {{.time_ns = 5}}});
  map.MustCommit(delta);
  map.MustCommit(DeltaOfPoses(kStander, {PoseAt(6 * kSecond, 2, 5, 1)}));
  map.Close();
  Write(ReadFile(map.database_path()));
  const Sha256 sha256 = ComputeSha256("faces");
  const std::string digest =
      absl::BytesToHexString({reinterpret_cast<const char*>(sha256.data()), sha256.size()});
  const std::string at = absl::StrCat("instr(payload, x'", digest, "')");
  Execute(absl::StrCat("UPDATE shape_segment SET payload = CAST(substr(payload, 1, ", at,
                       " - 1) || zeroblob(1) || substr(payload, ", at, " + 1) AS BLOB) WHERE ", at,
                       " > 0"));
  EXPECT_TRUE(IsToldAsLoss(Compact()));
  const auto then = OrDie(OrDie(GraphStore::Open(folder_.path(), {}))->OpenMap(kMap));
  EXPECT_TRUE(OrDie(then->Latest())->ReadAsset(sha256).ok());
}

}  // namespace
}  // namespace dsg::test
