// SPDX-License-Identifier: Apache-2.0
// tag, compact, revert, backup, restore, export and import of archives, verify of files: as scripts
// see them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "query/cli/run.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Arguments;
using test::Outcome;
using test::ReadFile;
using test::RunDsg;

void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

class KeepVerbs : public testing::Test {
 protected:
  void SetUp() override {
    AddMap("office", 4);
    AddMap("attic", 1);
  }

  // Each revision adds an object.
  void AddMap(const std::string& name, int revision_count) {
    const auto store = GraphStore::Open(store_, {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = name;
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    const auto writer = (*store)->OpenWriter(name);
    for (int i = 1; i <= revision_count; ++i) AddObject(writer->get(), name, i);
  }
  void AddObject(MapWriter* writer, const std::string& map, int i) {
    Node node;
    node.id = NodeId('O', static_cast<uint64_t>(i));
    node.kind = kinds::kObject;
    node.layer = layers::kObjects;
    node.name = "thing " + std::to_string(i);
    GraphDelta delta;
    delta.map = map;
    delta.session_id = "test";
    delta.sequence = i;
    delta.nodes = {node};
    const auto committed = writer->Commit(delta);
    ASSERT_TRUE(committed.ok()) << committed.status();
  }

  Outcome Ask(Arguments arguments) {
    arguments.insert(arguments.end(), {"--store", store_});
    return RunDsg(arguments);
  }
  void ExpectRefused(int code, const std::string& what, Arguments arguments) {
    const Outcome outcome = Ask(std::move(arguments));
    EXPECT_EQ(outcome.code, code) << outcome.errors;
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.errors.find(what), std::string::npos) << outcome.errors;
  }
  size_t NodeCount(const std::string& store, const std::string& map) {
    const Outcome outcome = RunDsg({"ls", "--json", "--store", store, "--map", map});
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    return Json::parse(outcome.out)["nodes"].size();
  }

  test::TempFolder folder_;
  const std::string store_ = folder_.path() + "/store";
  const std::string out_ = folder_.path() + "/out";
};

TEST_F(KeepVerbs, ATagStandsWhereverARevisionDoes) {
  EXPECT_EQ(Ask({"tag", "two", "--revision", "2", "--note", "early", "--map", "office"}).out,
            "tag two is revision 2\n");
  EXPECT_EQ(Ask({"tag", "last", "--map", "office"}).out, "tag last is revision 4\n");
  EXPECT_EQ(Ask({"tag", "again", "--revision", "two", "--map", "office"}).out,
            "tag again is revision 2\n");
  EXPECT_NE(Ask({"tag", "--map", "office"}).out.find("early"), std::string::npos);
  EXPECT_NE(Ask({"log", "--map", "office"}).out.find("again two"), std::string::npos);
  const Json listed =
      Json::parse(Ask({"ls", "--revision", "two", "--map", "office", "--json"}).out);
  EXPECT_EQ(listed["nodes"].size(), 2U);
  EXPECT_EQ(Ask({"diff", "two", "last", "--map", "office"}).out,
            Ask({"diff", "2", "4", "--map", "office"}).out);
  EXPECT_EQ(Ask({"watch", "--after", "two", "-n", "1", "--map", "office"}).out.substr(0, 11),
            "revision 3 ");
  EXPECT_EQ(Ask({"tag", "--remove", "again", "--map", "office"}).code, 0);
  ExpectRefused(1, "TAG_UNKNOWN", {"ls", "--revision", "again", "--map", "office"});
  ExpectRefused(1, "it has last, two", {"diff", "again", "--map", "office"});
  ExpectRefused(2, "neither a revision", {"ls", "--revision", "-1", "--map", "office"});
  ExpectRefused(2, "FIELD_INVALID", {"tag", "a b", "--map", "office"});
}

TEST_F(KeepVerbs, CompactAndRevertSayWhatTheyDid) {
  EXPECT_EQ(Ask({"tag", "two", "--revision", "2", "--map", "office"}).code, 0);
  const Outcome dry = Ask({"revert", "two", "--dry-run", "--map", "office"});
  EXPECT_EQ(dry.out, "would go back to tag two: restored nothing; gone 2 nodes\n");
  EXPECT_EQ(Ask({"revert", "two", "--map", "office"}).out,
            "went back to tag two as revision 5: restored nothing; gone 2 nodes\n");
  EXPECT_EQ(NodeCount(store_, "office"), 2U);
  EXPECT_EQ(Ask({"revert", "2", "--map", "office"}).out,
            "the map already has the content of revision 2; nothing written\n");
  const Outcome compacted = Ask({"compact", "--map", "office"});
  EXPECT_EQ(compacted.code, 0) << compacted.errors;
  EXPECT_EQ(compacted.out.substr(0, 19), "dropped 3 revisions");
  EXPECT_NE(compacted.out.find("readable are revision 5 and later, and those with tags"),
            std::string::npos)
      << compacted.out;
  ExpectRefused(1, "REVISION_COMPACTED", {"revert", "3", "--map", "office"});
  ExpectRefused(1, "REVISION_IN_FUTURE", {"revert", "9", "--map", "office"});
  ExpectRefused(1, "REVISION_IN_FUTURE", {"compact", "--keep-from", "9", "--map", "office"});
  ExpectRefused(2, "TO", {"revert", "--map", "office"});
}

TEST_F(KeepVerbs, ABackupRestoresAllMapsAndIsRenewed) {
  const Outcome first = Ask({"backup", out_});
  ASSERT_EQ(first.code, 0) << first.errors;
  EXPECT_NE(first.out.find("backup of 2 maps"), std::string::npos);
  EXPECT_EQ(RunDsg({"verify", out_}).code, 0);
  const auto attic = fs::last_write_time(out_ + "/MANIFEST");
  Ask({"tag", "two", "--revision", "2", "--map", "office"});
  const Outcome second = Ask({"backup", out_});
  EXPECT_NE(second.out.find("attic: unchanged"), std::string::npos) << second.out;
  EXPECT_NE(second.out.find("office: copied"), std::string::npos) << second.out;
  EXPECT_GE(fs::last_write_time(out_ + "/MANIFEST"), attic);
  const Json json = Json::parse(Ask({"backup", out_, "--json"}).out);
  EXPECT_EQ(json["maps"].size(), 2U);
  EXPECT_FALSE(json["maps"][1]["copied"].get<bool>());
  const std::string other = folder_.path() + "/other";
  EXPECT_EQ(RunDsg({"restore", out_, "--store", other}).code, 0);
  EXPECT_EQ(NodeCount(other, "office"), 4U);
  EXPECT_EQ(NodeCount(other, "attic"), 1U);
  EXPECT_EQ(RunDsg({"verify", "--store", other}).code, 0);
}

TEST_F(KeepVerbs, ABackupOfOneMapKeepsTheOthersThatWereThere) {
  ASSERT_EQ(Ask({"backup", out_}).code, 0);
  const Outcome one = Ask({"backup", out_, "--map", "office"});
  EXPECT_NE(one.out.find("attic: kept"), std::string::npos) << one.out;
  // A variable must not leave maps out unseen.
  const Outcome all =
      RunDsg({"backup", folder_.path() + "/all"}, {.store = store_, .map = "office"});
  EXPECT_NE(all.out.find("backup of 2 maps"), std::string::npos) << all.out;
}

TEST_F(KeepVerbs, RestoreRefusesWhatItCannotDoAndChangesNothing) {
  ASSERT_EQ(Ask({"backup", out_}).code, 0);
  ExpectRefused(2, "MAP_EXISTS", {"restore", out_});
  ExpectRefused(2, "--as names one map", {"restore", out_, "--as", "x"});
  ExpectRefused(1, "MAP_UNKNOWN", {"restore", out_, "--map", "cellar"});
  ExpectRefused(1, "there is no file", {"restore", folder_.path() + "/none", "--map", "x"});
  EXPECT_EQ(Ask({"restore", out_, "--map", "attic", "--as", "loft"}).code, 0);
  EXPECT_EQ(NodeCount(store_, "loft"), 1U);
  EXPECT_EQ(Ask({"restore", out_, "--map", "attic", "--force"}).code, 0);
  {
    const auto store = GraphStore::Open(store_, {.program = "a robot"});
    const auto writer = (*store)->OpenWriter("attic");
    ExpectRefused(3, "a robot", {"restore", out_, "--map", "attic", "--force"});
  }
  EXPECT_EQ(RunDsg({"restore", out_}).code, 2);
}

TEST_F(KeepVerbs, ADamagedBackupIsFoundBeforeAnythingIsRestored) {
  ASSERT_EQ(Ask({"backup", out_}).code, 0);
  std::string office;
  for (const auto& entry : fs::directory_iterator(out_)) {
    const std::string name = entry.path().filename().string();
    if (name.substr(0, 6) == "office") office = entry.path().string();
  }
  std::string bytes = ReadFile(office);
  bytes[bytes.size() / 2] ^= 1;
  WriteBytes(office, bytes);
  const Outcome verified = RunDsg({"verify", out_});
  EXPECT_EQ(verified.code, 4);
  EXPECT_NE(verified.out.find("office: 0 revisions"), std::string::npos) << verified.out;
  EXPECT_NE(verified.out.find("attic: 1 revision,"), std::string::npos) << verified.out;
  const std::string other = folder_.path() + "/other";
  EXPECT_EQ(RunDsg({"restore", out_, "--store", other}).code, 4);
  EXPECT_FALSE(fs::exists(other));
  // The next backup puts it right.
  EXPECT_NE(Ask({"backup", out_}).out.find("office: copied"), std::string::npos);
  EXPECT_EQ(RunDsg({"verify", out_}).code, 0);
  // Without a manifest it is none.
  fs::remove(out_ + "/MANIFEST");
  EXPECT_EQ(RunDsg({"restore", out_, "--store", other}).code, 1);
}

TEST_F(KeepVerbs, ABackupNamesMapsThatCannotBeOpenedAndHoldsTheOthers) {
  ASSERT_EQ(Ask({"backup", out_, "--map", "office"}).code, 0);
  fs::create_directories(store_ + "/cellar");
  WriteBytes(store_ + "/cellar/graph.db", "no database");
  WriteBytes(store_ + "/office/graph.db", "once a database");
  const Outcome outcome = Ask({"backup", out_});
  EXPECT_NE(outcome.code, 0);
  EXPECT_NE(outcome.out.find("attic: copied"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("cellar: left out: "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("office: left out: "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("office: kept from the last backup"), std::string::npos);
  EXPECT_NE(outcome.errors.find("2 maps that could not be read, first \"cellar\""),
            std::string::npos)
      << outcome.errors;
  EXPECT_NE(outcome.errors.find("["), std::string::npos) << outcome.errors;
  const Json json = Json::parse(Ask({"backup", out_, "--json"}).out);
  ASSERT_EQ(json["left_out"].size(), 2U);
  EXPECT_EQ(json["left_out"][1]["map"], "office");
  EXPECT_EQ(json["maps"].size(), 2U);
  EXPECT_EQ(RunDsg({"verify", out_}).code, 0);
  // One that was asked for is an error of its own.
  ExpectRefused(outcome.code, "backup of map \"cellar\"", {"backup", out_, "--map", "cellar"});
  EXPECT_NE(Ask({"maps"}).out.find("map cellar cannot be opened"), std::string::npos);
}

TEST_F(KeepVerbs, VerifyNamesMapsThatCannotBeOpenedAndLooksAtTheOthers) {
  WriteBytes(store_ + "/attic/graph.db", "once a database");
  const Outcome outcome = Ask({"verify"});
  EXPECT_EQ(outcome.code, 4) << outcome.errors;
  EXPECT_NE(outcome.out.find("attic: 0 revisions, 0 rows, 0 poses, 1 problem\n"), std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("office: 4 revisions"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.errors.find("STORE_CORRUPT"), std::string::npos) << outcome.errors;
  const Json json = Json::parse(Ask({"verify", "--json"}).out);
  ASSERT_EQ(json["maps"].size(), 2U);
  EXPECT_EQ(json["maps"][0]["map"], "attic");
  EXPECT_EQ(json["maps"][0]["problems"].size(), 1U);
  EXPECT_EQ(json["maps"][1]["revision_count"], "4");
  EXPECT_TRUE(json["maps"][1]["problems"].empty());
}

TEST_F(KeepVerbs, VerifyLooksAtTheOthersWhereOneIsOfANewerFormat) {
  // Where SQLite keeps user_version, in the head of the database.
  std::string bytes = ReadFile(store_ + "/attic/graph.db");
  bytes[63] = static_cast<char>(kStoreFormatVersion + 1);
  WriteBytes(store_ + "/attic/graph.db", bytes);
  const Outcome outcome = Ask({"verify"});
  EXPECT_EQ(outcome.code, 2) << outcome.errors;
  EXPECT_NE(outcome.out.find("attic: not checked: "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("office: 4 revisions"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.errors.find("FORMAT_TOO_NEW"), std::string::npos) << outcome.errors;
}

TEST_F(KeepVerbs, UpgradeSpeaksToScriptsAndOfItself) {
  const Json json = Json::parse(Ask({"upgrade", "--json"}).out);
  ASSERT_EQ(json["maps"].size(), 2U);
  EXPECT_EQ(json["maps"][0]["from_format"], kStoreFormatVersion);
  EXPECT_EQ(json["maps"][0]["copy"], "");
  const Outcome remote = RunDsg({"upgrade"}, {.server = "unix:/nowhere"});
  EXPECT_EQ(remote.code, 2);
  EXPECT_NE(remote.errors.find("upgrade works on a store folder"), std::string::npos)
      << remote.errors;
}

TEST_F(KeepVerbs, ARestoreThatFailsLeavesNoFolder) {
  ASSERT_EQ(Ask({"backup", out_}).code, 0);
  const std::string file = folder_.path() + "/attic.dsgz";
  ASSERT_EQ(Ask({"export", file, "--map", "attic"}).code, 0);
  std::string bytes = ReadFile(file);
  bytes[bytes.size() - 100] ^= 1;
  WriteBytes(file, bytes);
  EXPECT_EQ(RunDsg({"restore", file, "--store", folder_.path() + "/new/deep"}).code, 4);
  EXPECT_FALSE(fs::exists(folder_.path() + "/new"));
  // One that was there stays.
  fs::create_directories(folder_.path() + "/empty");
  EXPECT_EQ(RunDsg({"restore", file, "--store", folder_.path() + "/empty"}).code, 4);
  EXPECT_TRUE(fs::exists(folder_.path() + "/empty"));
}

TEST_F(KeepVerbs, ARestoreLooksAtAllMapsBeforeItReplacesOne) {
  ASSERT_EQ(Ask({"backup", out_}).code, 0);
  {
    const auto store = GraphStore::Open(store_, {.program = "a robot"});
    AddObject((*store)->OpenWriter("attic")->get(), "attic", 2);
    const auto writer = (*store)->OpenWriter("office");
    ExpectRefused(3, "a robot", {"restore", out_, "--force"});
  }
  EXPECT_EQ(NodeCount(store_, "attic"), 2U);
  const Outcome done = Ask({"restore", out_, "--force"});
  EXPECT_EQ(done.code, 0) << done.errors;
  EXPECT_NE(done.out.find("attic: restored at revision 1"), std::string::npos) << done.out;
  EXPECT_EQ(NodeCount(store_, "attic"), 1U);
}

TEST_F(KeepVerbs, ABackupWithItsArchivesExchangedIsRefused) {
  ASSERT_EQ(Ask({"backup", out_}).code, 0);
  // As by somebody who knows how the manifest is sealed.
  std::string text = ReadFile(out_ + "/MANIFEST");
  text = text.substr(0, text.rfind("sha256 "));
  Json json = Json::parse(text);
  std::swap(json["maps"][0]["map"], json["maps"][1]["map"]);
  std::swap(json["maps"][0], json["maps"][1]);
  text = json.dump();
  WriteBytes(out_ + "/MANIFEST", text + "sha256 " + ToHex(ComputeSha256(text)) + "\n");
  const Outcome outcome = RunDsg({"restore", out_, "--store", folder_.path() + "/other"});
  EXPECT_EQ(outcome.code, 4);
  EXPECT_NE(outcome.errors.find("its map is"), std::string::npos) << outcome.errors;
  EXPECT_EQ(RunDsg({"verify", out_}).code, 4);
}

TEST_F(KeepVerbs, AnArchiveGoesOutAndComesBackWithTheSameBytes) {
  const std::string file = folder_.path() + "/office.dsgz";
  const std::string again = folder_.path() + "/again.dsgz";
  const std::string other = folder_.path() + "/other";
  const Outcome written = Ask({"export", file, "--map", "office"});
  ASSERT_EQ(written.code, 0) << written.errors;
  EXPECT_EQ(written.out.substr(0, 6 + file.size()), "wrote " + file);
  ExpectRefused(2, "is there already", {"export", file, "--map", "office"});
  const Json told = Json::parse(Ask({"export", file, "--map", "office", "--force", "--json"}).out);
  EXPECT_TRUE(told["files"][0].contains("database_bytes")) << told;
  EXPECT_EQ(RunDsg({"verify", file}).code, 0);
  EXPECT_EQ(RunDsg({"import", file, "--store", other}).code, 0);
  EXPECT_EQ(RunDsg({"export", again, "--store", other}).code, 0);
  EXPECT_TRUE(ReadFile(file) == ReadFile(again));
  // Only a name on the command line is a new name.
  const Outcome copy =
      RunDsg({"import", file, "--store", other, "--map", "copy"}, {.map = "elsewhere"});
  EXPECT_EQ(
      copy.out,
      "copy: restored at revision 4, readable from 0 on; its name in the archive is office\n");
  EXPECT_EQ(RunDsg({"restore", file, "--store", other, "--force"}, {.map = "elsewhere"}).code, 0);
  EXPECT_FALSE(fs::exists(other + "/elsewhere"));
}

TEST_F(KeepVerbs, AnArchiveOfRowsIsAnArchiveToo) {
  const std::string file = folder_.path() + "/rows.dsgz";
  const std::string again = folder_.path() + "/again.dsgz";
  const std::string other = folder_.path() + "/other";
  const Json told = Json::parse(Ask({"export", file, "--rows", "--map", "office", "--json"}).out);
  EXPECT_TRUE(told["files"][0].contains("row_bytes")) << told;
  EXPECT_EQ(RunDsg({"verify", file}).code, 0);
  const Outcome restored = RunDsg({"restore", file, "--store", other});
  EXPECT_EQ(restored.out, "office: restored at revision 4, readable from 0 on\n");
  EXPECT_EQ(RunDsg({"export", again, "--rows", "--store", other}).code, 0);
  EXPECT_TRUE(ReadFile(file) == ReadFile(again));
  EXPECT_EQ(RunDsg({"import", file, "--store", other, "--map", "copy"}).code, 0);
  ExpectRefused(2, "--rows is of an archive",
                {"export", "--gltf", "x.glb", "--rows", "--map", "office"});
  const Outcome remote =
      RunDsg({"export", again, "--rows", "--map", "office"}, {.server = "unix:/nowhere"});
  EXPECT_EQ(remote.code, 2);
  EXPECT_NE(remote.errors.find("reads a store folder"), std::string::npos) << remote.errors;
}

TEST_F(KeepVerbs, FilesThatAreNoArchivesAreRefused) {
  const std::string file = folder_.path() + "/office.dsgz";
  ExpectRefused(2, "does not end in .dsgz", {"export", "office.zip", "--map", "office"});
  ExpectRefused(2, "remove --revision", {"export", file, "--revision", "2", "--map", "office"});
  ExpectRefused(2, "only file of its call", {"export", file, "--gltf", "x.glb", "--map", "office"});
  ExpectRefused(2, "cannot create",
                {"export", folder_.path() + "/none/office.dsgz", "--map", "office"});
  ASSERT_EQ(Ask({"export", file, "--map", "office"}).code, 0);
  const std::string bytes = ReadFile(file);
  WriteBytes(file, bytes.substr(0, bytes.size() - 7));
  EXPECT_EQ(RunDsg({"restore", file, "--store", folder_.path() + "/other"}).code, 4);
  EXPECT_EQ(RunDsg({"verify", file}).code, 4);
  WriteBytes(file, "no archive");
  EXPECT_EQ(RunDsg({"verify", file}).code, 2);
  EXPECT_EQ(RunDsg({"import", file, "--store", folder_.path() + "/other"}).code, 2);
  EXPECT_EQ(RunDsg({"verify", folder_.path() + "/none"}).code, 1);
}

TEST_F(KeepVerbs, ABackupGoesNeitherIntoItsStoreNorAmongOtherThings) {
  ExpectRefused(2, "inside the store", {"backup", store_ + "/backup"});
  fs::create_directories(out_);
  WriteBytes(out_ + "/letter.txt", "dear");
  ExpectRefused(2, "letter.txt", {"backup", out_});
  EXPECT_EQ(ReadFile(out_ + "/letter.txt"), "dear");
}

}  // namespace
}  // namespace dsg::cli
