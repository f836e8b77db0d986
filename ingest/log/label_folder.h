// SPDX-License-Identifier: Apache-2.0
// A folder of label pictures beside an RGB-D log: which picture of the log each belongs to, and
// what its numbers mean.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/log_digest.h"
#include "ingest/log/log_source.h"
#include "ingest/log/sensor_log.h"

namespace dsg::ingest {

/// The pictures of one channel of a log that labels may belong to.
struct LabelledPictures {
  std::string channel;
  /// In the order of time; `names` may have folders before them.
  std::vector<TimeNs> times;
  std::vector<std::string> names;
  /// Of logs that number their frames: the time of each; empty for those with stamps.
  std::map<int64_t, TimeNs> time_of_frame;
};

/// The channel "label0" of LogOptions::label_folder: its PNGs of one channel, 8 or 16 bits, and
/// labels.csv or labels.txt (ReadLabelIds). A picture belongs to that of `pictures` with its name
/// before the ending, leaving out ".color", ".depth" and ".label"; else with its number, or, where
/// the log has stamps, to that whose stamp is nearest to the time in its name (seconds with a
/// point, or nanoseconds) and no more than half a frame away. `stamp_offset_ns` is what the log
/// has added to the stamps of its names. Channels that come first in `pictures` go before the
/// others.
///
/// Each picture is decoded once: sizes and numbers are checked before the log begins. Sets the
/// classes of `info`, and the camera of the labels; says there what is missing, and which numbers
/// the table does not have; they count as unknown.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the file: no table, no picture that belongs to
/// the log, two of one, a size that is not that of the depth or colour pictures, a picture of
/// colours or that does not decode; with LogOptions::is_strict whatever would be noted as missing
/// or unknown.
absl::StatusOr<SensorChannel> ReadLabelFolder(const LogOptions& options,
                                              const std::vector<LabelledPictures>& pictures,
                                              TimeNs stamp_offset_ns, LogDigest* digest,
                                              LogInfo* info);

}  // namespace dsg::ingest
