// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/image_header.h"

#include <optional>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr std::string_view kPngMagic("\x89PNG\r\n\x1a\n", 8);

uint8_t Byte(std::string_view bytes, size_t at) { return static_cast<uint8_t>(bytes[at]); }

// An integer of `size` bytes; nullopt past the end.
std::optional<uint32_t> Integer(std::string_view bytes, size_t at, size_t size, bool is_big) {
  if (at > bytes.size() || bytes.size() - at < size) return std::nullopt;
  uint32_t value = 0;
  for (size_t i = 0; i < size; ++i) {
    value = value << 8 | Byte(bytes, at + (is_big ? i : size - 1 - i));
  }
  return value;
}

std::optional<ImageHeader> HeaderOf(std::optional<uint32_t> width, std::optional<uint32_t> height,
                                    int channel_count, int bits) {
  // Larger ones fail the bound on pixels; here they must not wrap.
  constexpr uint32_t kSideMax = 1 << 24;
  if (!width || !height || *width > kSideMax || *height > kSideMax) return std::nullopt;
  return ImageHeader{static_cast<int>(*width), static_cast<int>(*height), channel_count, bits};
}

std::optional<ImageHeader> OfPng(std::string_view bytes) {
  if (bytes.size() < 33 || bytes.substr(12, 4) != "IHDR") return std::nullopt;
  int channel_count = 0;
  switch (Byte(bytes, 25)) {
    case 0:
      channel_count = 1;
      break;
    case 2:
    case 3:
      channel_count = 3;
      break;
    case 4:
      channel_count = 2;
      break;
    case 6:
      channel_count = 4;
      break;
    default:
      return std::nullopt;
  }
  std::optional<ImageHeader> header = HeaderOf(
      Integer(bytes, 16, 4, true), Integer(bytes, 20, 4, true), channel_count, Byte(bytes, 24));
  if (header.has_value()) header->is_palette = Byte(bytes, 25) == 3;
  return header;
}

std::optional<ImageHeader> OfJpeg(std::string_view bytes) {
  size_t at = 2;
  while (at + 4 <= bytes.size() && Byte(bytes, at) == 0xff) {
    const uint8_t marker = Byte(bytes, at + 1);
    if (marker == 0xff) {
      ++at;
      continue;
    }
    const bool is_frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame && at + 10 <= bytes.size()) {
      return HeaderOf(Integer(bytes, at + 7, 2, true), Integer(bytes, at + 5, 2, true),
                      Byte(bytes, at + 9), Byte(bytes, at + 4));
    }
    // Markers without a length, and the pixels, come after the frame's header.
    if (marker == 0xda || marker == 0xd9) return std::nullopt;
    at += 2 + *Integer(bytes, at + 2, 2, true);
  }
  return std::nullopt;
}

std::optional<ImageHeader> OfTiff(std::string_view bytes) {
  const bool is_big = bytes[0] == 'M';
  const std::optional<uint32_t> directory = Integer(bytes, 4, 4, is_big);
  if (!directory) return std::nullopt;
  const std::optional<uint32_t> count = Integer(bytes, *directory, 2, is_big);
  if (!count) return std::nullopt;
  std::optional<uint32_t> width;
  std::optional<uint32_t> height;
  uint32_t bits = 1;
  uint32_t samples = 1;
  for (uint32_t i = 0; i < *count; ++i) {
    const size_t at = size_t{*directory} + 2 + size_t{12} * i;
    const std::optional<uint32_t> tag = Integer(bytes, at, 2, is_big);
    const std::optional<uint32_t> type = Integer(bytes, at + 2, 2, is_big);
    if (!tag || !type) return std::nullopt;
    const std::optional<uint32_t> value = Integer(bytes, at + 8, *type == 3 ? 2 : 4, is_big);
    if (!value) return std::nullopt;
    if (*tag == 256) width = value;
    if (*tag == 257) height = value;
    // Several samples keep their bits elsewhere in the file; the decoder's result is checked.
    if (*tag == 258) bits = *Integer(bytes, at + 4, 4, is_big) == 1 ? *value : 8;
    if (*tag == 277) samples = *value;
  }
  if (bits > 64 || samples == 0 || samples > 4) return std::nullopt;
  return HeaderOf(width, height, static_cast<int>(samples), static_cast<int>(bits));
}

}  // namespace

absl::StatusOr<ImageHeader> ReadImageHeader(std::string_view bytes, const std::string& origin) {
  const auto fail = [&origin](const std::string& message) {
    return MakeError(Reason::kFileMalformed, absl::StrCat(origin, ": ", message),
                     {{"file", origin}});
  };
  std::optional<ImageHeader> header;
  if (bytes.starts_with(kPngMagic)) {
    header = OfPng(bytes);
  } else if (bytes.starts_with("\xff\xd8\xff")) {
    header = OfJpeg(bytes);
  } else if (bytes.starts_with(std::string_view("II*\0", 4)) ||
             bytes.starts_with(std::string_view("MM\0*", 4))) {
    header = OfTiff(bytes);
  } else {
    return fail("is no PNG, JPEG or TIFF image; was the copy cut short?");
  }
  if (!header.has_value()) return fail("the image's header is damaged or cut short; copy it again");
  if (header->width < 1 || header->height < 1 ||
      int64_t{header->width} * header->height > kImagePixelsMax) {
    return fail(absl::StrCat("the image is ", header->width, " x ", header->height,
                             " pixels; 1 to ", kImagePixelsMax, " are read"));
  }
  return *header;
}

}  // namespace dsg::ingest
