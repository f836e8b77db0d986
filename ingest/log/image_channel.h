// SPDX-License-Identifier: Apache-2.0
// One camera of a folder log: its calibration, its table, its files.
// Refuses to open images before they are asked for.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/image_file.h"
#include "ingest/log/sensor_log.h"

namespace dsg::ingest {

/// Images by stamp. Paths are made of folder and name, since a long log has many.
struct ImageList {
  std::string folder;
  std::vector<TimeNs> times;
  std::vector<std::string> names;
};

/// "cam0", "color0", "depth0", "label0" and their like; false for any other name.
bool IsImageChannel(std::string_view name);

/// What the images of a channel become.
ImageDecoding DecodingOf(std::string_view channel);

/// The channel of files that exist. `names` are files within `folder`.
/// Errors: FILE_MALFORMED of its measurements, if a file has gone by the time that it is due.
SensorChannel MakeImageChannel(const std::string& channel, const ImageDecoding& decoding,
                               ImageList list);

/// `folder`/{data.csv, data/}: stamps grow, each file is there. Adds to `digest` what it read.
/// Errors: FILE_MALFORMED naming the line, or the first absent file and how many are.
absl::StatusOr<ImageList> ReadImageTable(const std::filesystem::path& folder,
                                         const std::string& channel, LogDigest* digest);

}  // namespace dsg::ingest
