// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/packed_bytes.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cstdint>
#include <memory>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr std::string_view kGzipBegin = "\x1f\x8b";
constexpr std::string_view kZstdBegin = "\x28\xb5\x2f\xfd";

// Room for what comes out, twice as much each time, and never more than one byte past the bound.
class Output {
 public:
  Output(const std::string& path, size_t byte_count_max)
      : path_(path), byte_count_max_(byte_count_max) {}

  absl::Status MakeRoom() {
    if (done_ < bytes_.size()) return absl::OkStatus();
    if (done_ > byte_count_max_) {
      return MalformedFile(path_, absl::StrCat("unpacks to more than ", byte_count_max_ >> 20,
                                               " MiB; unpack it yourself and give the file"));
    }
    bytes_.resize(std::min(byte_count_max_ + 1, std::max(size_t{65536}, 2 * bytes_.size())));
    return absl::OkStatus();
  }
  char* at() { return bytes_.data() + done_; }
  size_t room() const { return bytes_.size() - done_; }
  void Advance(size_t count) { done_ += count; }

  absl::Status Cut() const {
    return MalformedFile(path_, absl::StrCat("the packed file is cut short: it ends after ", done_,
                                             " unpacked bytes; copy it again"));
  }
  absl::Status Damaged(std::string_view why) const {
    return MalformedFile(
        path_, absl::StrCat("the packed file is damaged after ", done_, " unpacked bytes (",
                            std::string(why), "); copy it again, or pack it again"));
  }
  absl::StatusOr<std::string> Take() {
    bytes_.resize(done_);
    if (done_ > byte_count_max_) return MakeRoom();
    if (bytes_.empty()) return MalformedFile(path_, "unpacks to nothing");
    return std::move(bytes_);
  }

 private:
  const std::string& path_;
  size_t byte_count_max_;
  std::string bytes_;
  size_t done_ = 0;
};

bool IsAllZero(std::string_view bytes) {
  return bytes.find_first_not_of('\0') == std::string_view::npos;
}

// zlib counts in 32 bits.
uInt Capped(size_t size) { return static_cast<uInt>(std::min(size, size_t{1} << 30)); }

absl::StatusOr<std::string> Gunzip(std::string_view bytes, Output* out) {
  z_stream stream = {};
  // Sixteen more than the largest window: gzip's header and checksum.
  if (inflateInit2(&stream, 15 + 16) != Z_OK) return out->Damaged("no memory");
  const std::unique_ptr<z_stream, decltype(&inflateEnd)> end(&stream, &inflateEnd);
  while (!bytes.empty()) {
    DSG_RETURN_IF_ERROR(out->MakeRoom());
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = Capped(bytes.size());
    const uInt in_before = stream.avail_in;
    stream.next_out = reinterpret_cast<Bytef*>(out->at());
    stream.avail_out = Capped(out->room());
    const uInt out_before = stream.avail_out;
    const int result = inflate(&stream, Z_NO_FLUSH);
    out->Advance(out_before - stream.avail_out);
    bytes.remove_prefix(in_before - stream.avail_in);
    if (result == Z_STREAM_END) {
      // Tapes and some transfers fill the last block with zeros.
      if (IsAllZero(bytes)) return out->Take();
      if (!bytes.starts_with(kGzipBegin)) return out->Damaged("something else follows");
      inflateReset(&stream);
    } else if (result != Z_OK) {
      return out->Damaged(stream.msg != nullptr ? stream.msg : "not gzip");
    }
  }
  // All went in; what is left comes out, or the end is missing.
  while (true) {
    DSG_RETURN_IF_ERROR(out->MakeRoom());
    stream.next_out = reinterpret_cast<Bytef*>(out->at());
    stream.avail_out = Capped(out->room());
    const uInt out_before = stream.avail_out;
    const int result = inflate(&stream, Z_NO_FLUSH);
    const uInt count = out_before - stream.avail_out;
    out->Advance(count);
    if (result == Z_STREAM_END) return out->Take();
    if (result != Z_OK || count == 0) return out->Cut();
  }
}

absl::StatusOr<std::string> Unzstd(std::string_view bytes, Output* out) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  if (stream == nullptr) return out->Damaged("no memory");
  ZSTD_inBuffer in = {bytes.data(), bytes.size(), 0};
  while (true) {
    DSG_RETURN_IF_ERROR(out->MakeRoom());
    ZSTD_outBuffer to = {out->at(), out->room(), 0};
    const size_t in_before = in.pos;
    const size_t hint = ZSTD_decompressStream(stream.get(), &to, &in);
    if (ZSTD_isError(hint) != 0) return out->Damaged(ZSTD_getErrorName(hint));
    out->Advance(to.pos);
    // Zero: a part is whole; the next one begins by itself.
    if (hint == 0 && in.pos == in.size) return out->Take();
    if (to.pos == 0 && in.pos == in_before) return out->Cut();
  }
}

}  // namespace

bool IsPacked(std::string_view bytes) {
  return bytes.starts_with(kGzipBegin) || bytes.starts_with(kZstdBegin);
}

absl::StatusOr<std::string> Unpack(std::string_view bytes, const std::string& path,
                                   size_t byte_count_max) {
  Output out(path, byte_count_max);
  return bytes.starts_with(kGzipBegin) ? Gunzip(bytes, &out) : Unzstd(bytes, &out);
}

}  // namespace dsg::ingest
