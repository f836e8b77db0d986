// SPDX-License-Identifier: Apache-2.0
// One function a format; each reads lines in memory and checks them one by one. Those that give
// rows read a whole log, or a piece of one that grows.
// Errors of all: INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field, value and what to do.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/log_source.h"
#include "ingest/log/text_rows.h"

namespace dsg::ingest {

using OpenedLog = absl::StatusOr<std::unique_ptr<LogSource>>;

/// ETH/UCY: frame, person, x, z, y, vx, vz, vy between blanks; metres and m/s; velocities are
/// checked to be numbers and not kept.
absl::StatusOr<TextRows> ReadObsmatRows(const LogFile& file, const LogOptions& options);

/// frame, person, x, y between blanks; metres.
absl::StatusOr<TextRows> ReadTrajnetRows(const LogFile& file, const LogOptions& options);

/// One JSON object a line: {"track": {f, p, x, y}}, metres; {"scene": ...} lines are counted.
absl::StatusOr<TextRows> ReadNdjsonRows(const LogFile& file, const LogOptions& options);

/// THOR-MAGNI tracklets: columns found by the header. Times restart with each run and repeat per
/// helmet, so the agent is the tracklet, "<ag_id>/<tracklet_id>".
OpenedLog ReadThor(const LogFile& file, const LogOptions& options);

/// EuRoC state_groundtruth_estimate0/data.csv: stamp [ns, UNIX], p x y z, q w x y z, ...
absl::StatusOr<TextRows> ReadEurocRows(const LogFile& file, const LogOptions& options);

/// TUM: t [s], x y z, q x y z w between blanks: one robot's poses.
absl::StatusOr<TextRows> ReadTumRows(const LogFile& file, const LogOptions& options);

/// A table with a header that names its columns: a time, x, y, and perhaps z, qx qy qz qw, an
/// agent's name and its kind. docs/sensor_logs.md, "Tables of poses".
absl::StatusOr<TextRows> ReadCsvRows(const LogFile& file, const LogOptions& options);
/// Whether a line is such a header.
bool IsCsvHeader(std::string_view line);

/// Spark-DSG, Kimera and region files. `format` is "auto" or what the file must turn out to be.
OpenedLog ReadSceneGraphLog(const LogFile& file, const LogOptions& options);

/// The objects of a scene of TESSE, Unity's or ROS's axes; classes by name if the scene's
/// segmentation mapping is beside the file.
OpenedLog ReadTesseObjects(const LogFile& file, const LogOptions& options);

/// tracks.csv of dsg-simulate: time_ns,agent,kind,x,y,z,qx,qy,qz,qw; times from the epoch.
absl::StatusOr<TextRows> ReadTracksRows(const LogFile& file, const LogOptions& options);

/// What dsg-simulate writes: the world (may be missing) and tracks.csv, times from the epoch.
OpenedLog ReadTracks(const std::optional<LogFile>& world, const LogFile& tracks,
                     const LogOptions& options);

}  // namespace dsg::ingest
