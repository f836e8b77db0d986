// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/rows.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::sqlite {
namespace {

constexpr TimeNs kTenthNs = kNsPerSecond / 10;
constexpr int64_t kInt32Max = INT32_MAX;
constexpr int64_t kInt32Min = INT32_MIN;

__extension__ using Int128 = __int128;

int64_t FloorDivide(Int128 value, int64_t divisor) {
  Int128 quotient = value / divisor;
  if (value % divisor != 0 && value < 0) --quotient;
  return static_cast<int64_t>(
      std::clamp<Int128>(quotient, std::numeric_limits<int64_t>::min(), kTimeMax));
}

}  // namespace

int64_t RowChecksum(std::span<const int64_t> columns, std::string_view payload) {
  const std::string_view head(reinterpret_cast<const char*>(columns.data()), columns.size_bytes());
  return Checksum(payload, static_cast<uint64_t>(Checksum(head)));
}

absl::Status CorruptRow(const std::string& map, std::string_view table, const std::string& key) {
  return MakeError(Reason::kStoreCorrupt,
                   absl::StrCat("map \"", map, "\": row ", key, " of table ", std::string(table),
                                " is not what was written; run `dsg verify` and restore from a "
                                "copy"),
                   {{"map", map}, {"table", std::string(table)}, {"key", key}});
}

IntBox ToMillimetres(const Box3d& box) {
  const auto low = [](double m) { return static_cast<int64_t>(std::floor(m * 1000.0)); };
  const auto high = [](double m) { return static_cast<int64_t>(std::ceil(m * 1000.0)); };
  return {low(box.min().x()),  high(box.max().x()), low(box.min().y()),
          high(box.max().y()), low(box.min().z()),  high(box.max().z())};
}

int64_t ToTenthsFloor(TimeNs time_ns, const MapSpec& spec) {
  return std::clamp(FloorDivide(static_cast<Int128>(time_ns) - spec.epoch_ns, kTenthNs), kInt32Min,
                    kInt32Max);
}

int64_t ToTenthsCeil(TimeNs time_ns, const MapSpec& spec) {
  return std::clamp(-FloorDivide(static_cast<Int128>(spec.epoch_ns) - time_ns, kTenthNs), kInt32Min,
                    kInt32Max);
}

int64_t SegmentId(int64_t slot, TimeNs t0_ns, const MapSpec& spec) {
  const int64_t bias = int64_t{1} << (kSegmentTimeBits - 1);
  const int64_t ms = FloorDivide(static_cast<Int128>(t0_ns) - spec.epoch_ns, 1'000'000) + bias;
  return FirstSegmentId(slot) + std::clamp<int64_t>(ms, 0, 2 * bias - 1);
}

}  // namespace dsg::sqlite
