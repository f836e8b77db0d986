// SPDX-License-Identifier: Apache-2.0
#include "tests/crash/keep_rig.h"

#include <zstd.h>

#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "tests/crash/people_log.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

constexpr int kLogRows = 6'000;

void FillMap(GraphStore* store, const std::string& name, uint64_t seed, int64_t length) {
  MapSpec spec = Spec(TrajectoryCodec::kQuantized);
  spec.name = name;
  OrDie(store->CreateMap(spec));
  const auto writer = OrDie(store->OpenWriter(name));
  DeltaStreamOptions options;
  options.seed = seed;
  options.mesh_vertex_count = 2'000;
  options.asset_bytes = 100'000;
  for (int64_t sequence = 1; sequence <= length; ++sequence) {
    GraphDelta delta = DeltaOfStream(options, sequence);
    delta.map = name;
    OrDie(writer->Commit(std::move(delta)));
  }
  if (name != KeepRig::kMain) return;
  OrDie(writer->SetTag(KeepRig::kTag, KeepRig::kTagged, "before the move"));
}

// Without the counters of the file, and without the revision that wrote each row: in how many
// steps an operation came to its end is its own business.
std::string TextOf(const Snapshot& snapshot) {
  constexpr std::string_view kMark = " revision ";
  const std::string text = OrDie(Dump(snapshot));
  std::string out;
  for (size_t at = text.find("ScanNodes:"); at < text.size();) {
    const size_t mark = text.find(kMark, at);
    out.append(text, at, mark == std::string::npos ? mark : mark - at);
    if (mark == std::string::npos) break;
    at = text.find_first_not_of("0123456789", mark + kMark.size());
  }
  return out;
}

}  // namespace

MapContent ReadContent(const std::string& store, const std::string& map,
                       const std::vector<Revision>& revisions, std::string* problems) {
  MapContent content;
  const auto opened = OrDie(GraphStore::Open(store, {}))->OpenMap(map);
  if (ReasonOf(opened.status()) == Reason::kMapUnknown) return content;
  if (!opened.ok()) {
    absl::StrAppend(problems, "map ", map, " cannot be opened: ", opened.status().message(), "\n");
    return content;
  }
  const auto report = (*opened)->Verify({}, {});
  if (!report.ok()) {
    absl::StrAppend(problems, "verify of ", map, " failed: ", report.status().message(), "\n");
    return content;
  }
  for (const std::string& problem : report->problems) absl::StrAppend(problems, problem, "\n");
  if (!report->problems.empty()) return content;
  content.oldest = OrDie((*opened)->OldestRevision());
  content.newest = OrDie((*opened)->Head()).revision;
  for (const Tag& tag : OrDie((*opened)->Tags())) content.tags[tag.name] = tag.revision;
  for (const Revision revision : revisions) {
    const auto snapshot = (*opened)->At(revision);
    if (!snapshot.ok()) continue;
    content.dumps[revision] = TextOf(**snapshot);
    content.digests[revision] = ToHex(OrDie((*snapshot)->Stats()).at.digest);
  }
  return content;
}

KeepRig::KeepRig() : store_(folder_.path() + "/template") {
  StoreOptions options;
  options.create = true;
  {
    const auto store = OrDie(GraphStore::Open(store_, options));
    FillMap(store.get(), kMain, 5, kLength);
    FillMap(store.get(), kOther, 6, 12);
  }
  std::string problems;
  content_ = ReadContent(store_, kMain, Looked(), &problems);
  other_content_ = ReadContent(store_, kOther, {12}, &problems);
  if (!problems.empty() || content_.dumps.size() != Looked().size()) {
    OrDie(absl::InternalError(absl::StrCat("the template is unsound: ", problems)));
  }
  std::ofstream(log_path()) << PeopleLog(7, kLogRows);
}

std::string KeepRig::MakePlace() {
  const std::string place = absl::StrCat(folder_.path(), "/place-", ++place_count_);
  fs::create_directory(place);
  fs::copy(store_, place + "/store", fs::copy_options::recursive);
  return place;
}

std::string KeepRig::MakeOldPlace() {
  const std::string place = absl::StrCat(folder_.path(), "/place-", ++place_count_);
  fs::create_directories(absl::StrCat(place, "/store/", kMain));
  const std::string packed =
      ReadFile(std::string(DSG_SOURCE_DIR) + "/tests/data/store_format_1.db.zst");
  std::string bytes(ZSTD_getFrameContentSize(packed.data(), packed.size()), '\0');
  if (ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size()) != bytes.size()) {
    OrDie(absl::InternalError("the map of format 1 cannot be unpacked"));
  }
  std::ofstream(absl::StrCat(place, "/store/", kMain, "/graph.db"), std::ios::binary) << bytes;
  return place;
}

}  // namespace dsg::test
