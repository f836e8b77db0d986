// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/archive_file.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

constexpr auto kFrame = static_cast<int64_t>(kArchiveFrameBytes);

class ArchiveReader {
 public:
  explicit ArchiveReader(InputFile file) : file_(std::move(file)) {}

  absl::StatusOr<ArchiveManifest> ReadHead() {
    std::string header;
    std::string text;
    DSG_RETURN_IF_ERROR(file_.Read(kArchiveHeaderBytes, &header));
    if (header.size() < kArchiveHeaderBytes) return NoArchive(file_.path(), "is too short for one");
    DSG_ASSIGN_OR_RETURN(const size_t size, ManifestBytes(file_.path(), header));
    DSG_RETURN_IF_ERROR(file_.Read(std::min(size, BytesLeft(header.size())), &text));
    if (text.size() < size) return Cut();
    DSG_ASSIGN_OR_RETURN(const ArchiveManifest manifest,
                         DecodeArchiveHead(file_.path(), header, text));
    Take(header);
    Take(text);
    // The writer packs no frame tighter than this.
    const int64_t largest = static_cast<int64_t>(kArchiveRatioMax) * file_.byte_count() + kFrame;
    if (manifest.database_bytes > largest) {
      return NoArchive(file_.path(), absl::StrCat("declares ", manifest.database_bytes,
                                                  " bytes, which it cannot hold"));
    }
    return manifest;
  }

  absl::Status ReadFrame(int64_t index, const ArchiveManifest& manifest, std::string* bytes) {
    const auto byte_count =
        static_cast<size_t>(std::min(kFrame, manifest.database_bytes - index * kFrame));
    const int64_t begin = at_;
    std::string head;
    DSG_RETURN_IF_ERROR(file_.Read(kArchiveFrameHeadBytes, &head));
    if (head.size() < kArchiveFrameHeadBytes) return Cut();
    const size_t stored_size = StoredBytes(head);
    if (stored_size > byte_count ||
        stored_size * kArchiveRatioMax + kArchiveRatioMax < byte_count) {
      return DamagedArchive(
          file_.path(), begin,
          absl::StrCat("a part of ", byte_count, " bytes cannot be stored in ", stored_size));
    }
    std::string stored;
    DSG_RETURN_IF_ERROR(file_.Read(stored_size, &stored));
    if (stored.size() < stored_size) return Cut();
    const absl::Status decoded = DecodeFrame(index, head, stored, byte_count, bytes);
    if (!decoded.ok()) {
      return DamagedArchive(file_.path(), begin, std::string(decoded.message()));
    }
    Take(head);
    Take(stored);
    return absl::OkStatus();
  }

  absl::Status ReadEnd(int64_t frame_count) {
    std::string end;
    // One byte more than there should be.
    DSG_RETURN_IF_ERROR(file_.Read(kArchiveEndBytes + 1, &end));
    if (end.size() < kArchiveEndBytes) return Cut();
    if (end.size() > kArchiveEndBytes) {
      return DamagedArchive(file_.path(), at_ + static_cast<int64_t>(kArchiveEndBytes),
                            "there are bytes after its end");
    }
    const size_t digest_bytes = Sha256().size();
    all_.Add(std::string_view(end).substr(0, end.size() - digest_bytes));
    if (end == EncodeArchiveEnd(frame_count, all_.Finish())) return absl::OkStatus();
    return DamagedArchive(file_.path(), at_, "the digest of the whole is another");
  }

  InputFile& file() { return file_; }

 private:
  size_t BytesLeft(size_t from) const {
    return static_cast<size_t>(
        std::max<int64_t>(0, file_.byte_count() - static_cast<int64_t>(from)));
  }

  void Take(std::string_view bytes) {
    all_.Add(bytes);
    at_ += static_cast<int64_t>(bytes.size());
  }

  absl::Status Cut() const {
    return DamagedArchive(file_.path(), file_.byte_count(), "it ends here, too early");
  }

  InputFile file_;
  Sha256Stream all_;
  /// Of the file, up to what was read and believed.
  int64_t at_ = 0;
};

}  // namespace

ArchiveEncoder::ArchiveEncoder(InputFile database, ArchiveManifest manifest)
    : database_(std::move(database)),
      manifest_(std::move(manifest)),
      frame_count_(FrameCount(manifest_.database_bytes)),
      ready_(EncodeArchiveHead(manifest_)) {
  all_.Add(ready_);
}

absl::Status ArchiveEncoder::AddFrame() {
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

absl::StatusOr<ArchiveManifest> ReadArchiveManifest(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  return ArchiveReader(std::move(file)).ReadHead();
}

absl::StatusOr<ArchiveManifest> ReadArchiveFile(const std::string& path, const ByteSink& sink,
                                                const StopCheck& stop, const Progress& progress) {
  DSG_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  ArchiveReader reader(std::move(file));
  DSG_ASSIGN_OR_RETURN(ArchiveManifest manifest, reader.ReadHead());
  const int64_t frame_count = FrameCount(manifest.database_bytes);
  std::string bytes;
  for (int64_t i = 0; i < frame_count; ++i) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_RETURN_IF_ERROR(reader.ReadFrame(i, manifest, &bytes));
    if (sink) DSG_RETURN_IF_ERROR(sink(bytes));
    if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(frame_count));
  }
  DSG_RETURN_IF_ERROR(reader.ReadEnd(frame_count));
  return manifest;
}

}  // namespace dsg
