// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_chunk.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// No LZ4 stream grows more than this; checked before memory is asked for.
constexpr size_t kLz4RatioMax = 256;

absl::Status DamagedChunk(const std::string& origin, const std::string& message) {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(origin, ": ", message, "; the bag is damaged: copy it again"),
                   {{"file", origin}});
}

// Memory grows with what really comes out: a few bytes must not ask for the largest chunk.
absl::StatusOr<std::string> FromBz2(std::string_view bytes, size_t size,
                                    const std::string& origin) {
  const auto fail = [&] {
    return DamagedChunk(origin, absl::StrCat("the bz2 chunk does not decompress to the ", size,
                                             " bytes that it declares"));
  };
  bz_stream stream = {};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return fail();
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> end(&stream,
                                                                       &BZ2_bzDecompressEnd);
  std::string out;
  stream.next_in = const_cast<char*>(bytes.data());
  stream.avail_in = static_cast<unsigned int>(bytes.size());
  int result = BZ_OK;
  while (result == BZ_OK) {
    const size_t done = out.size() - stream.avail_out;
    if (stream.avail_out == 0) {
      // One byte more than declared shows that the stream does not end there.
      if (out.size() > size) return fail();
      out.resize(std::min(size + 1, std::max(size_t{65536}, 2 * out.size())));
    }
    stream.next_out = out.data() + done;
    stream.avail_out = static_cast<unsigned int>(out.size() - done);
    const unsigned int in_before = stream.avail_in;
    const unsigned int out_before = stream.avail_out;
    result = BZ2_bzDecompress(&stream);
    const bool is_stuck = in_before == stream.avail_in && out_before == stream.avail_out;
    if (result == BZ_OK && is_stuck) return fail();
  }
  out.resize(out.size() - stream.avail_out);
  if (result != BZ_STREAM_END || out.size() != size) return fail();
  return out;
}

absl::StatusOr<std::string> FromLz4(std::string_view bytes, size_t size,
                                    const std::string& origin) {
  const auto fail = [&] {
    return DamagedChunk(origin, absl::StrCat("the lz4 chunk does not decompress to the ", size,
                                             " bytes that it declares"));
  };
  if (size / kLz4RatioMax > bytes.size()) return fail();
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0) return fail();
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, &LZ4F_freeDecompressionContext);
  std::string out(size, '\0');
  size_t out_at = 0;
  size_t in_at = 0;
  size_t hint = 1;
  while (hint != 0) {
    size_t out_size = out.size() - out_at;
    size_t in_size = bytes.size() - in_at;
    hint = LZ4F_decompress(context.get(), out.data() + out_at, &out_size, bytes.data() + in_at,
                           &in_size, nullptr);
    if (LZ4F_isError(hint) != 0) return fail();
    out_at += out_size;
    in_at += in_size;
    // Neither bytes in nor bytes out: the stream is cut, or longer than declared.
    if (hint != 0 && out_size == 0 && in_size == 0) return fail();
  }
  if (out_at != size || in_at != bytes.size()) return fail();
  return out;
}

// Memory grows with what really comes out, since Zstandard packs without a bound.
absl::StatusOr<std::string> FromZstd(std::string_view bytes, size_t size,
                                     const std::string& origin) {
  const auto fail = [&] {
    return DamagedChunk(origin, absl::StrCat("the zstd chunk does not decompress to the ", size,
                                             " bytes that it declares"));
  };
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  if (stream == nullptr) return fail();
  std::string out;
  size_t done = 0;
  ZSTD_inBuffer in = {bytes.data(), bytes.size(), 0};
  size_t hint = 1;
  while (hint != 0 || in.pos < in.size) {
    if (done == out.size()) {
      // One byte more than declared shows that the stream does not end there.
      if (out.size() > size) return fail();
      out.resize(std::min(size + 1, std::max(size_t{65536}, 2 * out.size())));
    }
    ZSTD_outBuffer to = {out.data() + done, out.size() - done, 0};
    const size_t in_before = in.pos;
    hint = ZSTD_decompressStream(stream.get(), &to, &in);
    if (ZSTD_isError(hint) != 0) return fail();
    done += to.pos;
    if (hint != 0 && to.pos == 0 && in.pos == in_before) return fail();
  }
  out.resize(done);
  if (out.size() != size) return fail();
  return out;
}

}  // namespace

absl::StatusOr<std::string> DecompressChunk(std::string_view compression, std::string_view bytes,
                                            size_t declared_size, const std::string& origin) {
  if (declared_size > kBagChunkBytesMax || bytes.size() > kBagChunkBytesMax) {
    return DamagedChunk(origin, absl::StrCat("the chunk declares ", declared_size,
                                             " bytes; at most ", kBagChunkBytesMax, " are read"));
  }
  if (compression == "bz2") return FromBz2(bytes, declared_size, origin);
  if (compression == "lz4") return FromLz4(bytes, declared_size, origin);
  if (compression == "zstd") return FromZstd(bytes, declared_size, origin);
  if (compression != "none") {
    return DamagedChunk(origin, absl::StrCat("the chunk's compression is \"",
                                             std::string(compression.substr(0, 16)),
                                             "\"; none, bz2, lz4 and zstd are known"));
  }
  if (bytes.size() != declared_size) {
    return DamagedChunk(origin, absl::StrCat("the chunk declares ", declared_size,
                                             " bytes and has ", bytes.size()));
  }
  return std::string(bytes);
}

}  // namespace dsg::ingest
