// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/duration.h"

#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

using Unit = std::pair<std::string_view, TimeNs>;

// Largest first; "ms" before "m" and "s" when reading.
constexpr std::array<Unit, 5> kUnits = {{{"d", kNsPerDay},
                                         {"h", 3600 * kNsPerSecond},
                                         {"m", 60 * kNsPerSecond},
                                         {"s", kNsPerSecond},
                                         {"ms", kNsPerSecond / 1000}}};
constexpr double kAgeMaxNs = 36'525.0 * static_cast<double>(kNsPerDay);

const Unit* UnitOf(std::string_view text) {
  if (text.ends_with("ms")) return &kUnits.back();
  for (const Unit& unit : kUnits) {
    if (text.ends_with(unit.first)) return &unit;
  }
  return nullptr;
}

absl::Status Refuse(std::string_view text) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("\"", std::string(text),
                                "\" is no length of time; write a number above 0 and its unit: "
                                "90s, 15m, 24h, 30d"),
                   {{"value", std::string(text)}});
}

}  // namespace

absl::StatusOr<TimeNs> ParseAge(std::string_view text) {
  const Unit* const unit = UnitOf(text);
  if (unit == nullptr) return Refuse(text);
  const std::string number(text.substr(0, text.size() - unit->first.size()));
  // Only digits and a point: no signs, exponents, blanks or "inf".
  if (number.empty() || number.find_first_not_of("0123456789.") != std::string::npos) {
    return Refuse(text);
  }
  double count = 0.0;
  if (!absl::SimpleAtod(number, &count)) return Refuse(text);
  const double age_ns = std::round(count * static_cast<double>(unit->second));
  if (!(age_ns >= 1.0 && age_ns <= kAgeMaxNs)) return Refuse(text);
  return static_cast<TimeNs>(age_ns);
}

std::string FormatAge(TimeNs age_ns) {
  for (const Unit& unit : kUnits) {
    if (age_ns % unit.second == 0) {
      return absl::StrCat(age_ns / unit.second, std::string(unit.first));
    }
  }
  return absl::StrCat(static_cast<double>(age_ns) / 1e6, "ms");
}

}  // namespace dsg
