// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/imu_table.h"

#include <array>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/files/spilled_rows.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr char kImuColumns[] = "timestamp, w x y z [rad/s], a x y z [m/s^2]";
constexpr std::string_view kNames[] = {"w_x", "w_y", "w_z", "a_x", "a_y", "a_z"};

// What stays of a sample until its turn: hours of them are gigabytes.
struct ImuRow {
  TimeNs time_ns = 0;
  std::array<double, 6> values{};
};

ImuRow ImuRowOf(const ImuMeasurement& sample) {
  ImuRow row{sample.time_ns, {}};
  for (Eigen::Index i = 0; i < 3; ++i) {
    row.values[static_cast<size_t>(i)] = sample.angular_velocity_rad_s[i];
    row.values[static_cast<size_t>(i) + 3] = sample.acceleration_m_s2[i];
  }
  return row;
}

ImuMeasurement SampleOf(const ImuRow& row) {
  const auto& v = row.values;
  return {row.time_ns, {v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

absl::StatusOr<ImuMeasurement> ReadImuRow(const LinePosition& at,
                                          const std::vector<std::string_view>& fields) {
  ImuMeasurement sample;
  DSG_ASSIGN_OR_RETURN(sample.time_ns, ParseInteger(at, "timestamp", fields[0]));
  if (sample.time_ns == kTimeMin || sample.time_ns == kTimeMax) {
    return at.FieldError("timestamp", fields[0], "nanoseconds are due");
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    const size_t k = static_cast<size_t>(i);
    DSG_ASSIGN_OR_RETURN(sample.angular_velocity_rad_s[i],
                         ParseNumber(at, kNames[k], fields[1 + k]));
    DSG_ASSIGN_OR_RETURN(sample.acceleration_m_s2[i],
                         ParseNumber(at, kNames[3 + k], fields[4 + k]));
  }
  return sample;
}

}  // namespace

absl::StatusOr<SensorChannel> ReadImuTable(const LogFile& file, const std::string& channel) {
  SensorChannel result{.name = channel, .rank = ChannelRank::kImu, .times = {}, .make = {}};
  const auto samples = std::make_shared<SpilledRows<ImuRow>>();
  LineReader lines(file.bytes);
  TextLine line;
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) continue;
    const LinePosition at{file.path, line.number};
    SplitAtCommas(line.text, &fields);
    DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 7, kImuColumns));
    DSG_ASSIGN_OR_RETURN(const ImuMeasurement sample, ReadImuRow(at, fields));
    DSG_RETURN_IF_ERROR(CheckGrows(file.path, line.number, channel, result.times, sample.time_ns));
    result.times.push_back(sample.time_ns);
    DSG_RETURN_IF_ERROR(samples->Add(ImuRowOf(sample)));
  }
  result.times.shrink_to_fit();
  result.make = [samples](size_t index) -> absl::StatusOr<Measurement> {
    DSG_ASSIGN_OR_RETURN(const ImuRow row, samples->At(index));
    return Measurement(SampleOf(row));
  };
  return result;
}

}  // namespace dsg::ingest
