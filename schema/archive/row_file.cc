// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/row_file.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/bit_stream.h"
#include "schema/store/graph_store.h"

namespace dsg {
namespace {

constexpr size_t kVarintBytesMax = 10;
constexpr size_t kRowReadBytes = size_t{256} << 10;

}  // namespace

void AppendRow(const StreamRow& row, std::string* out) {
  out->push_back(row.kind);
  for (const int64_t number : row.numbers) AppendVarint(ZigZag(number), out);
  for (const std::string& text : row.texts) {
    AppendVarint(text.size(), out);
    *out += text;
  }
}

absl::Status RowFileReader::Damaged() const {
  return MakeError(Reason::kStoreCorrupt,
                   absl::StrCat("the rows of map \"", map_, "\" end or change their form at byte ",
                                taken_ - static_cast<int64_t>(ready().size()),
                                "; take another copy of the archive"),
                   {{"map", map_}});
}

absl::Status RowFileReader::Fill(size_t size) {
  if (ready().size() >= size) return absl::OkStatus();
  buffer_.erase(0, std::exchange(at_, 0));
  const auto left = static_cast<size_t>(file_.byte_count() - taken_);
  std::string more;
  DSG_RETURN_IF_ERROR(
      file_.Read(std::min(left, std::max(size - buffer_.size(), kRowReadBytes)), &more));
  buffer_ += more;
  taken_ += static_cast<int64_t>(more.size());
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> RowFileReader::Varint() {
  DSG_RETURN_IF_ERROR(Fill(kVarintBytesMax));
  ByteReader bytes(ready());
  const uint64_t value = bytes.Varint();
  if (!bytes.ok()) return Damaged();
  at_ += bytes.position();
  return value;
}

absl::StatusOr<bool> RowFileReader::Next(StreamRow* row) {
  DSG_RETURN_IF_ERROR(Fill(1));
  if (ready().empty()) return false;
  const auto shape = ShapeOfRow(ready().front());
  if (!shape.has_value()) return Damaged();
  row->kind = ready().front();
  ++at_;
  row->numbers.resize(shape->number_count);
  row->texts.resize(shape->text_count);
  for (int64_t& number : row->numbers) {
    DSG_ASSIGN_OR_RETURN(const uint64_t value, Varint());
    number = UnZigZag(value);
  }
  for (std::string& text : row->texts) {
    DSG_ASSIGN_OR_RETURN(const uint64_t size, Varint());
    const uint64_t left = ready().size() + static_cast<uint64_t>(file_.byte_count() - taken_);
    if (size > left) return Damaged();
    DSG_RETURN_IF_ERROR(Fill(size));
    if (ready().size() < size) return Damaged();
    text = ready().substr(0, size);
    at_ += size;
  }
  return true;
}

void RowsSummary::Take(const StreamRow& row) {
  if (row.kind == row_kinds::kOldest) oldest_ = row.numbers[0];
  if (row.kind == row_kinds::kRevision) {
    newest_ = row.numbers[0];
    newest_digest_ = DigestOfText(row.texts[0]).value_or(Sha256{});
  }
  if (row.kind == row_kinds::kTag) {
    tags_.push_back({row.texts[0], row.numbers[0], row.numbers[1], row.texts[1]});
  }
}

ArchiveManifest RowsSummary::Describe(const MapSpec& spec) const {
  ArchiveManifest manifest;
  manifest.content = ArchiveContent::kRows;
  manifest.spec = spec;
  manifest.store_format = kStoreFormatVersion;
  manifest.newest_revision = newest_;
  manifest.newest_digest = newest_digest_;
  manifest.oldest_revision = oldest_;
  manifest.state = StateDigest(spec, newest_, newest_digest_, oldest_, tags_);
  return manifest;
}

}  // namespace dsg
