// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/archive/archive_test_util.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "absl/strings/str_join.h"
#include "schema/archive/archive_map.h"
#include "tests/unit/schema/store/delta_stream.h"

namespace dsg::test {

std::unique_ptr<TestMap> MakeArchivedMap(int64_t revision_count, uint64_t seed) {
  auto map = std::make_unique<TestMap>();
  for (int64_t i = 1; i <= revision_count; ++i) {
    OrDie(map->writer().Commit(DeltaOfStream({.seed = seed}, i)));
  }
  OrDie(map->writer().SetTag("begin", 1, "the first"));
  OrDie(map->writer().SetTag("half", (revision_count + 1) / 2, ""));
  return map;
}

namespace {

absl::StatusOr<std::string> BytesOf(ArchiveEncoder* encoder) {
  std::string all;
  while (!encoder->done()) {
    DSG_ASSIGN_OR_RETURN(const std::string piece, encoder->Next(nullptr));
    if (piece.size() > kArchivePieceBytes) return absl::InternalError("a piece is too large");
    all += piece;
  }
  return all;
}

}  // namespace

absl::StatusOr<std::string> ArchiveBytes(MapReader* map, const std::string& scratch) {
  DSG_ASSIGN_OR_RETURN(const auto encoder, ArchiveMap(map, scratch, nullptr, nullptr));
  return BytesOf(encoder.get());
}

absl::StatusOr<std::string> RowArchiveBytes(MapReader* map, const std::string& scratch) {
  DSG_ASSIGN_OR_RETURN(const auto encoder, ArchiveRows(map, scratch, nullptr));
  return BytesOf(encoder.get());
}

absl::StatusOr<std::string> ArchiveBytes(GraphStore* store, const std::string& map) {
  DSG_ASSIGN_OR_RETURN(const auto reader, store->OpenMap(map));
  return ArchiveBytes(reader.get(), store->folder());
}

std::string ReadBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

std::string NamesOf(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.insert(entry.path().filename().string());
  }
  return absl::StrJoin(names, " ");
}

}  // namespace dsg::test
