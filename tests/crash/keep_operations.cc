// SPDX-License-Identifier: Apache-2.0
#include "tests/crash/keep_operations.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "tests/crash/process.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;
using Command = std::vector<std::string>;

constexpr char kMain[] = "office";
constexpr Revision kTagged = KeepRig::kTagged;
constexpr Revision kKeepFrom = KeepRig::kKeepFrom;
constexpr Revision kLength = KeepRig::kLength;

std::string Program(const std::string& name) { return absl::StrCat(DSG_BINARY_DIR, "/", name); }

std::string NewestDump(const Aftermath& after) {
  const auto found = after.main.dumps.find(after.main.newest);
  return found == after.main.dumps.end() ? "" : found->second;
}

std::string EndViolation(const Aftermath& after) {
  if (!after.is_done || after.undisturbed.empty()) return "";
  return NewestDump(after) == after.undisturbed ? "" : "it ended with another content";
}

// Whether the files of the main map have a text in them.
bool MainMapHolds(const std::string& place, const std::string& text) {
  for (const char* name : {"graph.db", "graph.db-wal"}) {
    std::ifstream file(absl::StrCat(place, "/store/", kMain, "/", name), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    if (bytes.find(text) != std::string::npos) return true;
  }
  return false;
}

std::vector<Revision> AllLooked() { return KeepRig::Looked(); }

// ---- The operations, each a command line and its promise.

KeepOperation Commit() {
  return {.name = "commit",
          .command =
              [](const KeepRig& rig, const std::string& place) {
                return Command{Program("dsg-ingest"),
                               "--store",
                               place + "/store",
                               "--map",
                               kMain,
                               "--format",
                               "trajnet",
                               "--commit-poses",
                               "100",
                               "--agent-prefix",
                               "log-",
                               "--quiet",
                               rig.log_path()};
              },
          .violation =
              [](const Aftermath& after) {
                return PastViolation(after, AllLooked()) + EndViolation(after);
              }};
}

Command Dsg(const std::string& verb, const std::string& place, Command more) {
  Command command = {Program("dsg"), verb, "--store", place + "/store", "--map", kMain};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

KeepOperation Compact() {
  return {.name = "compact",
          .command =
              [](const KeepRig&, const std::string& place) {
                return Dsg("compact", place, {"--keep-from", absl::StrCat(kKeepFrom)});
              },
          .violation = [](const Aftermath& after) -> std::string {
            if (after.is_done && after.main.oldest != kKeepFrom)
              return "old revisions are still there";
            return PastViolation(after, AllLooked());
          }};
}

KeepOperation SetTag() {
  return {.name = "tag",
          .command =
              [](const KeepRig&, const std::string& place) {
                return Dsg("tag", place, {"moved-in", "--revision", "12"});
              },
          .violation = [](const Aftermath& after) -> std::string {
            const auto found = after.main.tags.find("moved-in");
            if (found == after.main.tags.end()) {
              return after.is_done ? "the tag is missing" : PastViolation(after, AllLooked());
            }
            if (found->second != 12) return "the tag names another revision";
            return PastViolation(after, AllLooked());
          }};
}

KeepOperation Revert() {
  return {.name = "revert",
          .command =
              [](const KeepRig&, const std::string& place) {
                return Dsg("revert", place, {absl::StrCat(kTagged)});
              },
          .violation =
              [](const Aftermath& after) {
                return PastViolation(after, AllLooked()) + EndViolation(after);
              }};
}

// `erased`: a text that no file may hold afterwards; empty where the past is kept.
KeepOperation Prune(const std::string& name, Command policy, const std::string& erased,
                    const std::string& done_reason = "") {
  return {.name = name,
          .command =
              [policy](const KeepRig&, const std::string& place) {
                Command more = policy;
                more.push_back("--yes");
                return Dsg("prune", place, more);
              },
          // An erasure rewrites the past: what it must leave is what Verify and the end say.
          .violation =
              [erased](const Aftermath& after) {
                const bool is_past_kept = erased.empty();
                return PastViolation(after, is_past_kept ? AllLooked() : std::vector<Revision>()) +
                       EndViolation(after) +
                       (!is_past_kept && after.is_done && MainMapHolds(after.place, erased)
                            ? "the file still holds names of what was erased"
                            : "");
              },
          .done_reason = done_reason};
}

KeepOperation Merge() {
  return {.name = "merge",
          .command =
              [](const KeepRig&, const std::string& place) {
                return Dsg("merge", place, {KeepRig::kOther, "--transform", "200,0,0,0", "--yes"});
              },
          .violation =
              [](const Aftermath& after) {
                return PastViolation(after, AllLooked()) + EndViolation(after);
              }};
}

// A folder that says it is a backup is one.
std::string BackupViolation(const Aftermath& after) {
  const std::string out = after.place + "/backup";
  const bool is_whole = fs::exists(out + "/MANIFEST");
  if (after.is_done && !is_whole) return "the backup has no manifest";
  if (!is_whole) return PastViolation(after, AllLooked());
  const std::string restored = absl::StrCat(after.place, "/restored-", after.is_done);
  fs::remove_all(restored);
  if (RunToEnd({Program("dsg"), "restore", out, "--store", restored}, after.place) != 0) {
    return "what looks like a backup cannot be restored";
  }
  std::string problems;
  const MapContent content = ReadContent(restored, kMain, AllLooked(), &problems);
  if (content.digests != after.rig.content().digests) problems += "another content was restored";
  return problems + PastViolation(after, AllLooked());
}

KeepOperation Backup() {
  return {.name = "backup",
          .command =
              [](const KeepRig&, const std::string& place) {
                return Command{Program("dsg"), "backup", place + "/backup", "--store",
                               place + "/store"};
              },
          .violation = BackupViolation};
}

KeepOperation Restore() {
  return {.name = "restore",
          .make_place =
              [](KeepRig& rig) {
                const std::string place = rig.MakePlace();
                const int code = RunToEnd(
                    {Program("dsg"), "backup", place + "/backup", "--store", place + "/store"},
                    place);
                OrDie(code == 0 ? absl::OkStatus() : absl::InternalError("no backup to restore"));
                fs::remove_all(absl::StrCat(place, "/store/", kMain));
                return place;
              },
          .command =
              [](const KeepRig&, const std::string& place) {
                return Dsg("restore", place, {place + "/backup"});
              },
          .violation = [](const Aftermath& after) -> std::string {
            // Not there at all, or wholly.
            if (after.main.newest == 0) return after.is_done ? "the map is not there" : "";
            return PastViolation(after, AllLooked());
          },
          .done_reason = "MAP_EXISTS"};
}

KeepOperation Upgrade() {
  return {
      .name = "upgrade",
      .make_place = [](KeepRig& rig) { return rig.MakeOldPlace(); },
      .command = [](const KeepRig&, const std::string& place) { return Dsg("upgrade", place, {}); },
      .violation = [](const Aftermath& after) -> std::string {
        if (after.main.newest == 0) return after.is_done ? "the map is not upgraded" : "";
        if (after.main.newest != 24) return "revisions were lost";
        const auto head = after.main.digests.find(24);
        const bool is_right =
            head != after.main.digests.end() &&
            head->second == "0c3c38c0397be6112958784e0277bc33462d6da178e6c39b4a89c1e0d0ec6662";
        return is_right ? "" : "it has another content";
      },
      .may_be_of_old_format = true};
}

// What a map of another name than the two says.
MapContent ContentUnder(const Aftermath& after, const std::string& map, std::string* problems) {
  return ReadContent(after.place + "/store", map, AllLooked(), problems);
}

// Names in the store's folder, but for the other map's.
std::vector<std::string> NamesInStore(const Aftermath& after) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(after.place + "/store")) {
    const std::string name = entry.path().filename().string();
    if (name != KeepRig::kOther) names.push_back(name);
  }
  return names;
}

// LookAt has opened the store, so nothing may be left of what was begun.
KeepOperation Drop() {
  return {.name = "drop",
          .command =
              [](const KeepRig&, const std::string& place) {
                return Command{Program("dsg"), "drop",          kMain,
                               "--yes",        "--expect",      absl::StrCat(kLength),
                               "--store",      place + "/store"};
              },
          .violation = [](const Aftermath& after) -> std::string {
            const std::vector<std::string> names = NamesInStore(after);
            if (after.main.newest > 0) {
              if (after.is_done) return "the map is there";
              return names.size() == 1 ? PastViolation(after, AllLooked()) : "there is more of it";
            }
            if (!names.empty()) return absl::StrCat("it left ", names.front());
            return after.other.digests == after.rig.other_content().digests
                       ? ""
                       : "the other map has changed";
          },
          .done_reason = "MAP_UNKNOWN"};
}

KeepOperation Rename() {
  return {.name = "rename",
          .command =
              [](const KeepRig&, const std::string& place) {
                return Command{Program("dsg"), "rename",  kMain,
                               "moved",        "--store", place + "/store"};
              },
          .violation = [](const Aftermath& after) -> std::string {
            const std::vector<std::string> names = NamesInStore(after);
            if (names.size() != 1) return "the map has another number of names than one";
            if (names.front() == kMain) {
              return after.is_done ? "it has its old name" : PastViolation(after, AllLooked());
            }
            Aftermath renamed = after;
            std::string problems;
            renamed.main = ContentUnder(after, "moved", &problems);
            return problems + PastViolation(renamed, AllLooked());
          },
          .done_reason = "MAP_UNKNOWN"};
}

bool HasVerb(const std::string& verb) {
  TempFolder folder;
  return RunToEnd({Program("dsg"), verb, "--help"}, folder.path()) == 0;
}

}  // namespace

int RunToEnd(const std::vector<std::string>& command, const std::string& place) {
  return Process::Run(command, place + "/output").Wait().exit_code;
}

std::string PastViolation(const Aftermath& after, const std::vector<Revision>& readable) {
  std::string wrong;
  for (const Revision revision : readable) {
    const auto found = after.main.dumps.find(revision);
    if (found == after.main.dumps.end()) {
      absl::StrAppend(&wrong, "revision ", revision, " is lost; ");
    } else if (found->second != after.rig.content().dumps.at(revision) ||
               after.main.digests.at(revision) != after.rig.content().digests.at(revision)) {
      absl::StrAppend(&wrong, "revision ", revision, " is another; ");
    }
  }
  if (after.main.newest < kLength) wrong += "acknowledged revisions are lost; ";
  const auto tag = after.main.tags.find(KeepRig::kTag);
  if (tag == after.main.tags.end() || tag->second != kTagged) wrong += "a tag is lost; ";
  if (after.other.digests != after.rig.other_content().digests) {
    wrong += "the other map has changed; ";
  }
  return wrong;
}

Aftermath LookAt(const KeepRig& rig, const KeepOperation& operation, const std::string& place,
                 bool is_done, std::string* problems) {
  Aftermath after{.rig = rig, .place = place, .is_done = is_done, .main = {}, .other = {}};
  const std::string store = place + "/store";
  std::vector<Revision> looked = AllLooked();
  if (operation.may_be_of_old_format) {
    const auto opened = OrDie(GraphStore::Open(store, {}))->OpenMap(kMain);
    if (ReasonOf(opened.status()) == Reason::kFormatTooOld) return after;
  }
  const auto head = OrDie(GraphStore::Open(store, {}))->OpenMap(kMain);
  if (head.ok()) looked.push_back(OrDie((*head)->Head()).revision);
  after.main = ReadContent(store, kMain, looked, problems);
  after.other = ReadContent(store, KeepRig::kOther, {12}, problems);
  return after;
}

std::vector<KeepOperation> KeepOperations(std::vector<std::string>* missing) {
  std::vector<KeepOperation> all = {Commit()};
  const auto add = [&](const std::string& verb, KeepOperation operation) {
    if (HasVerb(verb)) {
      all.push_back(std::move(operation));
    } else {
      missing->push_back(operation.name);
    }
  };
  add("compact", Compact());
  add("tag", SetTag());
  add("revert", Revert());
  add("prune", Prune("prune (retire)", {"--layer", "objects", "--retire"}, ""));
  // The names that the stream of deltas gives to objects, and to the room.
  add("prune", Prune("prune (erase)", {"--layer", "objects", "--erase"}, "object 1"));
  add("prune",
      Prune("prune (erase a branch)", {"--branch", "R2", "--erase"}, "room 2", "NODE_UNKNOWN"));
  add("merge", Merge());
  add("backup", Backup());
  add("restore", Restore());
  add("upgrade", Upgrade());
  add("drop", Drop());
  add("rename", Rename());
  return all;
}

}  // namespace dsg::test
