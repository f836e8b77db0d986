// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/archive_encoder.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {

ArchiveEncoder::ArchiveEncoder(InputFile database, ArchiveManifest manifest)
    : database_(std::move(database)),
      manifest_(std::move(manifest)),
      frame_count_(FrameCount(manifest_.database_bytes)),
      ready_(EncodeArchiveHead(manifest_)) {
  all_.Add(ready_);
}

absl::Status ArchiveEncoder::AddFrame() {
  constexpr auto kFrame = static_cast<int64_t>(kArchiveFrameBytes);
  const int64_t left = manifest_.database_bytes - frame_index_ * kFrame;
  const auto size = static_cast<size_t>(std::min(kFrame, left));
  std::string bytes;
  DSG_RETURN_IF_ERROR(database_.Read(size, &bytes));
  if (bytes.size() != size || database_.byte_count() != manifest_.database_bytes) {
    return MakeError(Reason::kStoreCorrupt,
                     absl::StrCat("the copy of map \"", manifest_.spec.name, "\" has not the ",
                                  manifest_.database_bytes, " bytes that were copied; try again"),
                     {{"map", manifest_.spec.name}});
  }
  const size_t before = ready_.size();
  AppendFrame(frame_index_++, bytes, &ready_);
  all_.Add(std::string_view(ready_).substr(before));
  return absl::OkStatus();
}

void ArchiveEncoder::AddEnd() {
  // The digest covers what stands before it in the end record, too.
  const std::string end = EncodeArchiveEnd(frame_count_, Sha256());
  const size_t digest_bytes = Sha256().size();
  all_.Add(std::string_view(end).substr(0, end.size() - digest_bytes));
  ready_ += EncodeArchiveEnd(frame_count_, all_.Finish());
  has_ended_ = true;
}

absl::StatusOr<std::string> ArchiveEncoder::Next(const StopCheck& stop) {
  while (!has_ended_ && ready_.size() - next_ < kArchivePieceBytes) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    ready_.erase(0, std::exchange(next_, 0));
    if (frame_index_ < frame_count_) {
      DSG_RETURN_IF_ERROR(AddFrame());
    } else {
      AddEnd();
    }
  }
  std::string piece = ready_.substr(next_, kArchivePieceBytes);
  next_ += piece.size();
  return piece;
}

double ArchiveEncoder::progress() const {
  return has_ended_ ? 1.0
                    : static_cast<double>(frame_index_) / static_cast<double>(frame_count_ + 1);
}

}  // namespace dsg
