// SPDX-License-Identifier: Apache-2.0
// RGB-D folders in the form of TUM's benchmark: tables of stamps and files, and a trajectory.
#pragma once

#include <string>

#include "ingest/log/readers.h"

namespace dsg::ingest {

/// Whether a folder has rgb.txt and depth.txt.
bool IsTumFolder(const std::string& folder);

/// Colour and depth keep their own stamps: whoever makes frames of them associates them. Unlike
/// those of other RGB-D folders, the frame of the poses is upright: it is that of motion capture.
/// docs/sensor_logs.md, "RGB-D folders".
/// Source of the form: Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", 2012.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line and what to do.
OpenedLog OpenTumFolder(const std::string& folder, const LogOptions& options);

}  // namespace dsg::ingest
