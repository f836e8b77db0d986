// SPDX-License-Identifier: Apache-2.0
#include "schema/base/time.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

absl::Status BadTime(std::string_view text) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("time \"", std::string(text),
                                "\" is not understood; write nanoseconds, \"+12.5s\" from the "
                                "map's start, or RFC 3339 like \"2014-06-25T16:58:44.9Z\""),
                   {{"field", "time"}, {"value", std::string(text)}});
}

int64_t UnitNs(std::string_view unit) {
  if (unit == "ns") return 1;
  if (unit == "us") return 1'000;
  if (unit == "ms") return 1'000'000;
  if (unit == "s" || unit.empty()) return kNsPerSecond;
  if (unit == "m" || unit == "min") return 60 * kNsPerSecond;
  if (unit == "h") return 3600 * kNsPerSecond;
  if (unit == "d") return 86400 * kNsPerSecond;
  return 0;
}

// Takes a number and its unit from the front of `text`, as "1.5h" of "1.5h10m"; false if there is
// none or it is far beyond 64 bits. Exact for up to nine decimals of any unit: whole part and
// fraction are integers.
bool TakeQuantity(std::string_view* text, __int128* quantity_ns, int64_t* unit_ns) {
  const auto is_digit = [&](size_t at) {
    return at < text->size() && std::isdigit(static_cast<unsigned char>((*text)[at]));
  };
  size_t at = 0;
  __int128 whole = 0;
  size_t digit_count = 0;
  for (; is_digit(at); ++at) {
    whole = whole * 10 + ((*text)[at] - '0');
    if (++digit_count > 19) return false;
  }
  __int128 fraction = 0;
  __int128 scale = 1;
  if (at < text->size() && (*text)[at] == '.') {
    for (++at; is_digit(at); ++at) {
      ++digit_count;
      if (scale >= 1'000'000'000'000'000) continue;
      fraction = fraction * 10 + ((*text)[at] - '0');
      scale *= 10;
    }
  }
  const size_t unit_end = std::min(text->find_first_of("0123456789.", at), text->size());
  *unit_ns = UnitNs(text->substr(at, unit_end - at));
  if (digit_count == 0 || *unit_ns == 0) return false;
  *quantity_ns = whole * *unit_ns + fraction * *unit_ns / scale;
  text->remove_prefix(unit_end);
  return true;
}

// A sign and quantities in descending units: "+12.5s", "-1m10s".
absl::StatusOr<TimeNs> ParseOffset(std::string_view text) {
  __int128 offset = 0;
  int64_t last_unit_ns = std::numeric_limits<int64_t>::max();
  std::string_view rest = text.substr(1);
  // Of "+1h30" one would not know the unit; a number alone is seconds.
  const bool is_bare = std::isalpha(static_cast<unsigned char>(text.back())) == 0;
  do {
    __int128 quantity_ns = 0;
    int64_t unit_ns = 0;
    if (!TakeQuantity(&rest, &quantity_ns, &unit_ns) || unit_ns >= last_unit_ns ||
        (is_bare && !rest.empty())) {
      return BadTime(text);
    }
    last_unit_ns = unit_ns;
    offset += quantity_ns;
    if (offset > kTimeMax) return BadTime(text);
  } while (!rest.empty());
  return static_cast<TimeNs>(text[0] == '-' ? -offset : offset);
}

}  // namespace

absl::StatusOr<TimeNs> ParseTime(std::string_view text, TimeNs epoch_ns) {
  if (text.empty()) return BadTime(text);
  TimeNs value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size()) return value;
  if (text[0] == '+' || text[0] == '-') {
    DSG_ASSIGN_OR_RETURN(const TimeNs offset, ParseOffset(text));
    TimeNs sum = 0;
    if (__builtin_add_overflow(epoch_ns, offset, &sum)) return BadTime(text);
    return sum;
  }
  absl::Time time;
  std::string parse_error;
  if (!absl::ParseTime(absl::RFC3339_full, absl::string_view(text.data(), text.size()), &time,
                       &parse_error) ||
      time < absl::FromUnixNanos(kTimeMin) || time > absl::FromUnixNanos(kTimeMax)) {
    return BadTime(text);
  }
  return absl::ToUnixNanos(time);
}

std::string FormatRfc3339(TimeNs time_ns) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%E*SZ", absl::FromUnixNanos(time_ns),
                          absl::UTCTimeZone());
}

std::string FormatRelative(TimeNs time_ns, TimeNs epoch_ns) {
  const __int128 offset = static_cast<__int128>(time_ns) - epoch_ns;
  const __int128 magnitude = offset < 0 ? -offset : offset;
  std::string text =
      absl::StrCat(offset < 0 ? "-" : "+", static_cast<uint64_t>(magnitude / kNsPerSecond));
  const auto fraction = static_cast<uint64_t>(magnitude % kNsPerSecond);
  if (fraction != 0) {
    std::string digits = absl::StrFormat("%09d", fraction);
    digits.erase(digits.find_last_not_of('0') + 1);
    absl::StrAppend(&text, ".", digits);
  }
  return text + "s";
}

int64_t WallClockNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace dsg
