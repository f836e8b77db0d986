// SPDX-License-Identifier: Apache-2.0
// The size of a compressed image, read from its first bytes before anything decodes it.
// Refuses images that no camera of ours takes: a decoder would be asked for gigabytes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::ingest {

inline constexpr int64_t kImagePixelsMax = 16'000'000;

struct ImageHeader {
  int width = 0;
  int height = 0;
  int channel_count = 0;
  int bits_per_channel = 0;
  /// Pixels are places in a table of colours; channel_count is that of the table.
  bool is_palette = false;
};

/// PNG, JPEG and TIFF.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `origin` when it is none of them, cut short, or
/// past kImagePixelsMax.
absl::StatusOr<ImageHeader> ReadImageHeader(std::string_view bytes, const std::string& origin);

}  // namespace dsg::ingest
