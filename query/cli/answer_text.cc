// SPDX-License-Identifier: Apache-2.0
#include "query/cli/answer_text.h"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "dsg/v1/graph.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

bool IsOpen(TimeNs time_ns) { return time_ns == kTimeMin || time_ns == kTimeMax; }

// The interval that two values of an error's metadata give; none if they are no times.
std::optional<Interval> IntervalIn(const ErrorMetadata& metadata, const std::string& from_key,
                                   const std::string& to_key) {
  const auto from = metadata.find(from_key);
  const auto to = metadata.find(to_key);
  Interval interval;
  if (from == metadata.end() || to == metadata.end() ||
      !absl::SimpleAtoi(from->second, &interval.from_ns) ||
      !absl::SimpleAtoi(to->second, &interval.to_ns)) {
    return std::nullopt;
  }
  return interval;
}

}  // namespace

std::string TimeText::Relative(TimeNs time_ns) const {
  return IsOpen(time_ns) ? "open" : FormatRelative(time_ns, epoch_ns_);
}

std::string TimeText::Date(TimeNs time_ns) const {
  return has_dates() && !IsOpen(time_ns) ? FormatRfc3339(time_ns) : "";
}

std::string TimeText::Full(TimeNs time_ns) const {
  const std::string date = Date(time_ns);
  return date.empty() ? Relative(time_ns) : absl::StrCat(Relative(time_ns), " (", date, ")");
}

std::string TimeText::Tenth(TimeNs time_ns) const {
  constexpr TimeNs kTenth = kNsPerSecond / 10;
  if (time_ns <= kTimeMin + kTenth || time_ns >= kTimeMax - kTenth) return Relative(time_ns);
  // Rounds the time since the epoch, which need not be a whole tenth itself.
  const TimeNs since = time_ns - epoch_ns_;
  TimeNs rest = since % kTenth;
  if (rest < 0) rest += kTenth;
  return Relative(rest < kTenth / 2 ? time_ns - rest : time_ns - rest + kTenth);
}

std::string TimeText::Span(TimeNs from_ns, TimeNs to_ns) const {
  if (IsOpen(from_ns) && IsOpen(to_ns)) return "";
  return absl::StrCat(Full(from_ns), " to ", Full(to_ns));
}

absl::Status TimeText::Explain(const absl::Status& status) const {
  const ErrorMetadata metadata = MetadataOf(status);
  switch (ReasonOf(status)) {
    case Reason::kTimeOutsideTrack: {
      const auto track = IntervalIn(metadata, "first_ns", "last_ns");
      if (!track.has_value()) return status;
      return MakeError(
          Reason::kTimeOutsideTrack,
          absl::StrCat(status.message(), " (the track: ", Span(track->from_ns, track->to_ns), ")"),
          metadata);
    }
    case Reason::kTimeRangeInverted: {
      const auto asked = IntervalIn(metadata, "from_ns", "to_ns");
      if (!asked.has_value()) return status;
      return MakeError(
          Reason::kTimeRangeInverted,
          absl::StrCat("--from ", Full(asked->from_ns), " is not before --to ", Full(asked->to_ns),
                       "; an interval begins at --from and ends before --to: give an "
                       "earlier --from or a later --to"),
          metadata);
    }
    default:
      return status;
  }
}

TimeNs LengthNs(TimeNs from_ns, TimeNs to_ns) {
  TimeNs length_ns = 0;
  return __builtin_sub_overflow(to_ns, from_ns, &length_ns) ? kTimeMax : length_ns;
}

std::string DurationText(TimeNs from_ns, TimeNs to_ns) {
  // Drops the sign of the relative time.
  const std::string text = FormatRelative(to_ns, from_ns);
  return text[0] == '+' ? text.substr(1) : text;
}

std::string SecondsText(TimeNs time_ns) {
  const __int128 magnitude = time_ns < 0 ? -static_cast<__int128>(time_ns) : time_ns;
  return absl::StrFormat("%s%d.%09d", time_ns < 0 ? "-" : "",
                         static_cast<uint64_t>(magnitude / kNsPerSecond),
                         static_cast<uint64_t>(magnitude % kNsPerSecond));
}

std::string BytesText(int64_t byte_count) {
  constexpr std::array<const char*, 4> kUnits{"kB", "MB", "GB", "TB"};
  if (byte_count < 1000) return absl::StrCat(byte_count, " bytes");
  double value = static_cast<double>(byte_count) / 1000.0;
  size_t unit = 0;
  for (; value >= 999.95 && unit + 1 < kUnits.size(); ++unit) value /= 1000.0;
  return absl::StrCat(Fixed(value, 1), " ", kUnits[unit], " (", byte_count, " bytes)");
}

std::string AmountText(const v1::Amount& amount) {
  const std::pair<int64_t, const char*> parts[] = {{amount.node_count(), "node"},
                                                   {amount.edge_count(), "edge"},
                                                   {amount.pose_count(), "pose"},
                                                   {amount.shape_count(), "body shape"},
                                                   {amount.factor_count(), "factor"},
                                                   {amount.stay_count(), "stay"},
                                                   {amount.mesh_block_count(), "mesh block"},
                                                   {amount.asset_count(), "asset"},
                                                   {amount.revision_count(), "revision"}};
  std::string text;
  for (const auto& [count, noun] : parts) {
    if (count > 0) absl::StrAppend(&text, text.empty() ? "" : ", ", Counted(count, noun));
  }
  return text.empty() ? "nothing" : text;
}

std::string NamedId(const std::string& id, const std::string& name) {
  return name.empty() || name == id ? id : absl::StrCat(name, " (", id, ")");
}

std::string ProvenanceText(int provenance) {
  switch (provenance) {
    case v1::PROVENANCE_PERCEIVED:
      return "perceived";
    case v1::PROVENANCE_IMPORTED:
      return "imported";
    case v1::PROVENANCE_PREDICTED:
      return "predicted";
    case v1::PROVENANCE_MANUAL:
      return "manual";
    default:
      return "";
  }
}

double YawDeg(const v1::Pose& pose) {
  const v1::Quaternion& q = pose.orientation();
  // A message without an orientation means the identity; its zeros also give 0 here.
  const double sine = 2.0 * (q.w() * q.z() + q.x() * q.y());
  const double cosine = 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z());
  return std::atan2(sine, cosine) * 180.0 / std::numbers::pi;
}

std::string Footer(int64_t count, const std::string& noun, int64_t revision, bool is_cut) {
  return absl::StrCat(Counted(count, noun), " (revision ", revision, ")",
                      is_cut ? "; there are more, see --limit" : "", "\n");
}

std::string PositionText(const v1::Vector3& position) {
  return absl::StrCat("x ", Fixed(position.x(), 2), " y ", Fixed(position.y(), 2), " z ",
                      Fixed(position.z(), 2), " m");
}

}  // namespace dsg::cli
