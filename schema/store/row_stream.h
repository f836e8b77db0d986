// SPDX-License-Identifier: Apache-2.0
// A map as a stream of rows, from one backend to another: every row that counts in digests, with
// the revisions that show it, and what a map keeps besides. docs/storage_format.md lists the kinds
// and their order, which are part of the format of archives and never change.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/content_rows.h"
#include "schema/store/revision_record.h"
#include "schema/store/touched_keys.h"

namespace dsg {

/// The kinds of rows, in the order in which they come. Where content_rows.h knows a row, its letter
/// and its columns are those of its identity; `rev_to` follows them, kRevisionMax for rows that are
/// still believed. Assets and their parts take turns.
namespace row_kinds {
inline constexpr char kOldest = 'O';
inline constexpr char kLayer = 'L';
inline constexpr char kLabel = 'l';
inline constexpr char kRelation = 'R';
inline constexpr char kRevision = 'V';
inline constexpr char kSession = 's';
inline constexpr char kTag = 'g';
inline constexpr char kAsset = 'A';
inline constexpr char kAssetPart = 'a';
inline constexpr char kDroppedAsset = 'D';
inline constexpr char kNode = 'N';
inline constexpr char kEdge = 'E';
inline constexpr char kStay = 'S';
inline constexpr char kTrackEnd = 'K';
inline constexpr char kPoses = 'T';
inline constexpr char kFactors = 'F';
inline constexpr char kShapes = 'H';
inline constexpr char kMeshBlock = 'M';
}  // namespace row_kinds

struct StreamRow {
  char kind = 0;
  std::vector<int64_t> numbers;
  /// Names and payloads.
  std::vector<std::string> texts;

  /// The rev_to of a kind that has one.
  Revision rev_to() const { return numbers.back(); }
  bool operator==(const StreamRow&) const = default;
};

/// How many numbers and texts a kind has.
struct RowShape {
  size_t number_count = 0;
  size_t text_count = 0;
};
/// nullopt for a kind that there is not.
std::optional<RowShape> ShapeOfRow(char kind);

/// Gets rows in order.
using RowSink = std::function<absl::Status(const StreamRow&)>;
/// The next row, in the shape of its kind; false after the last. An error ends it.
using RowSource = std::function<absl::StatusOr<bool>(StreamRow*)>;

/// A row that has a payload, or is a stay, as it is streamed.
template <typename Row>
StreamRow StreamRowOf(const Row& row, Revision rev_to) {
  const auto columns = row.columns();
  StreamRow stream{Row::kLetter, {columns.begin(), columns.end()}, {}};
  stream.numbers.push_back(rev_to);
  if constexpr (Row::kLetter != StayRow::kLetter) stream.texts.emplace_back(row.payload);
  return stream;
}

/// DATA_LOSS/STORE_CORRUPT for rows that make no map.
absl::Status BadRowError(const std::string& map, const StreamRow& row, std::string_view why);

/// All that is kept of one commit.
struct StreamedRevision {
  RevisionRecord record;
  /// Digest of the revision before, where that has no record.
  std::optional<Sha256> parent;
  /// Unknown once something was erased.
  std::optional<int64_t> delta_checksum;
  /// Since the record before; unset in the first one of a compacted map.
  std::optional<TouchedKeys> touched;
};
/// `touched` must be normalized.
StreamRow RowOfRevision(const StreamedRevision& revision);
absl::StatusOr<StreamedRevision> RevisionOfRow(const std::string& map, const StreamRow& row);

/// A SHA-256 among the texts of a row; nullopt if it is none.
std::optional<Sha256> DigestOfText(std::string_view text);

/// Coordinates are checked: backends find nodes by them. Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<Node> NodeOfRow(const std::string& map, const StreamRow& row);

/// FAILED_PRECONDITION for a map of which something is to be erased still.
absl::Status ErasurePendingError(const std::string& map);

}  // namespace dsg
