// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/shuffle.h"

#include <zstd.h>

#include "schema/base/check.h"

namespace dsg {

std::string Compress(std::string_view bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3);
  DSG_CHECK(!ZSTD_isError(size));
  out.resize(size);
  return out;
}

bool Decompress(std::string_view compressed, size_t size_max, std::string* bytes) {
  const auto declared = ZSTD_getFrameContentSize(compressed.data(), compressed.size());
  if (declared == ZSTD_CONTENTSIZE_ERROR || declared == ZSTD_CONTENTSIZE_UNKNOWN ||
      declared > size_max) {
    return false;
  }
  bytes->resize(declared);
  const size_t size =
      ZSTD_decompress(bytes->data(), bytes->size(), compressed.data(), compressed.size());
  return !ZSTD_isError(size) && size == declared;
}

std::string CompressShuffled(std::string_view bytes, size_t item_size) {
  const size_t count = bytes.size() / item_size;
  std::string planes(bytes.size(), '\0');
  for (size_t i = 0; i < count; ++i) {
    for (size_t b = 0; b < item_size; ++b) planes[b * count + i] = bytes[i * item_size + b];
  }
  return Compress(planes);
}

bool DecompressShuffled(std::string_view compressed, size_t item_size, size_t size,
                        std::string* bytes) {
  std::string planes;
  if (!Decompress(compressed, size, &planes) || planes.size() != size) return false;
  const size_t count = size / item_size;
  bytes->resize(size);
  for (size_t i = 0; i < count; ++i) {
    for (size_t b = 0; b < item_size; ++b) (*bytes)[i * item_size + b] = planes[b * count + i];
  }
  return true;
}

}  // namespace dsg
