// SPDX-License-Identifier: Apache-2.0
// How answers to people write times, sizes, positions and nodes.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "query/cli/table.h"
#include "schema/base/time.h"
#include "schema/model/layer.h"

namespace dsg::v1 {
class Amount;
class Pose;
class Vector3;
}  // namespace dsg::v1

namespace dsg::cli {

/// Instants of one map: relative to its epoch and, on a UNIX clock, as dates. Other clocks are not
/// UTC, so their instants have no dates.
class TimeText {
 public:
  explicit TimeText(const MapSpec& map) : epoch_ns_(map.epoch_ns), clock_(map.clock) {}

  bool has_dates() const { return clock_ == Clock::kUnix; }

  /// "+12.5s"; "open" for the ends of an open interval.
  std::string Relative(TimeNs time_ns) const;
  /// RFC 3339; empty without dates, and for open ends.
  std::string Date(TimeNs time_ns) const;
  /// "+12.5s (2014-06-25T16:58:44.9Z)", or as Relative without dates.
  std::string Full(TimeNs time_ns) const;
  /// As Relative, rounded to a tenth of a second: "+12.5s".
  std::string Tenth(TimeNs time_ns) const;
  /// "+1s to +2.5s"; empty if both ends are open.
  std::string Span(TimeNs from_ns, TimeNs to_ns) const;

  /// The same error; TIME_OUTSIDE_TRACK also gets the times at which the track begins and ends, and
  /// TIME_RANGE_INVERTED says the times of --from and --to as answers do.
  absl::Status Explain(const absl::Status& status) const;

 private:
  TimeNs epoch_ns_;
  Clock clock_;
};

/// Of an interval; the largest number if it is longer than 64 bits hold.
TimeNs LengthNs(TimeNs from_ns, TimeNs to_ns);

/// "2.5s" for the length of an interval.
std::string DurationText(TimeNs from_ns, TimeNs to_ns);

/// Seconds with nine decimals, exact: "1403715524.907143168".
std::string SecondsText(TimeNs time_ns);

/// "60.5 MB (60512345 bytes)"; only the bytes below 1 kB.
std::string BytesText(int64_t byte_count);

/// "3 nodes, 12 poses"; "nothing" if all counts are zero.
std::string AmountText(const v1::Amount& amount);

/// "carol (H1)"; the id without a name.
std::string NamedId(const std::string& id, const std::string& name);

/// "perceived"; empty if unspecified. `provenance` is a v1::Provenance.
std::string ProvenanceText(int provenance);

/// Rotation about the map's z axis, degrees in (-180, 180].
double YawDeg(const v1::Pose& pose);

/// "x 1.20 y 3.40 z 0.00 m".
std::string PositionText(const v1::Vector3& position);

/// "3 nodes (revision 6)", and a hint at --limit if the list is cut.
std::string Footer(int64_t count, const std::string& noun, int64_t revision, bool is_cut);

}  // namespace dsg::cli
