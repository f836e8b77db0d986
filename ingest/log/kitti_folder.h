// SPDX-License-Identifier: Apache-2.0
// Folders of lidar scans in the form of KITTI's odometry benchmark.
#pragma once

#include <string>

#include "ingest/log/readers.h"

namespace dsg::ingest {

/// Whether a folder has velodyne/ with a scan in it.
bool IsKittiFolder(const std::string& folder);

/// velodyne/NNNNNN.bin (x y z intensity, 32-bit floats, little endian), times.txt (seconds, a line
/// a scan), poses.txt (3x4 matrices of the left grey camera, a line a scan) and calib.txt, whose Tr
/// takes points of the lidar into that camera. The body is the lidar; the map is the lidar's frame
/// where the poses have their origin, so its z points up. The poses count as ground truth.
///
/// Source of the form: Geiger et al., "Are we ready for autonomous driving?", 2012, and the
/// development kit of the odometry benchmark.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line and what to do: a scan that was cut,
/// counts that differ, a pose that is not rigid, a missing file. With LogOptions::is_strict also
/// when scans are absent that have a time.
OpenedLog OpenKittiFolder(const std::string& folder, const LogOptions& options);

}  // namespace dsg::ingest
