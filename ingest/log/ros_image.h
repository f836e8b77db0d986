// SPDX-License-Identifier: Apache-2.0
// ROS images to plain pixels of the format that a channel has.
// Refuses encodings that do not fit the channel.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/image_file.h"
#include "ingest/log/ros_messages.h"

namespace dsg::ingest {

/// mono8, rgb8, bgr8, rgba8, bgra8 for grey and colour; 16UC1, mono16, 32FC1 for depth; mono16,
/// 16UC1, or the colours of `class_of_color` (red << 16 | green << 8 | blue) for labels.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `origin`, also past kImagePixelsMax.
absl::StatusOr<Image> ToImage(const RosImage& image, const ImageDecoding& decoding,
                              const std::map<uint32_t, int32_t>& class_of_color,
                              const std::string& origin);

/// PNG or JPEG, and the compressed depth of image_transport: a PNG of millimetres (16UC1), or of
/// inverse depth (32FC1), which becomes metres.
/// Errors: as above.
absl::StatusOr<Image> ToImage(const RosCompressedImage& image, const ImageDecoding& decoding,
                              const std::string& origin);

}  // namespace dsg::ingest
