// SPDX-License-Identifier: Apache-2.0
// Compressed images to plain pixels of the format that a channel has.
// Refuses to guess: an image of another depth than the channel's is an error.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/image_header.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// What a channel measures, and so what its images become.
enum class ImageRole {
  /// kGray8; colour is turned to grey.
  kGray,
  /// kRgb8.
  kColor,
  /// 16 bits: kDepth16 if the unit is a millimetre, else kDepth32. Floats: kDepth32.
  kDepth,
  /// kLabel16.
  kLabel,
};

struct ImageDecoding {
  ImageRole role = ImageRole::kGray;
  /// What a 16-bit depth counts: 1000 = millimetres.
  double depth_units_per_m = 1000.0;
  /// Whether a depth of 65535 means no reading, besides 0.
  bool is_max_no_reading = false;
  /// Of labels of 8 or 16 bits that are numbers of a table: 65536 values of kLabel16. Null: 16 bits
  /// that are kLabel16 themselves.
  std::shared_ptr<const std::vector<uint16_t>> label_of_id;
};

/// PNG, JPEG or TIFF. `origin` is for messages.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED.
absl::StatusOr<Image> DecodeImage(std::string_view bytes, const std::string& origin,
                                  const ImageDecoding& decoding);

/// Errors: also those of ReadLogFile.
absl::StatusOr<Image> LoadImageFile(const std::string& path, const ImageDecoding& decoding);

/// Of a file, without reading its pixels.
absl::StatusOr<ImageHeader> LoadImageHeader(const std::string& path);

/// Depths of 16 bits in other units than millimetres, as metres. Requires: kDepth16.
Image ScaleDepth(const Image& image, const ImageDecoding& decoding);

}  // namespace dsg::ingest
