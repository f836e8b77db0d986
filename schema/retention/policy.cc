// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/policy.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

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

namespace {

constexpr size_t kNameBytesMax = 200;
constexpr double kSimplifyMaxM = 1000.0;

class Checker {
 public:
  explicit Checker(const PrunePolicy& policy) : policy_(policy) {}

  absl::Status Check() const {
    if (policy_.name.size() > kNameBytesMax || !IsUtf8(policy_.name) || HasNul(policy_.name)) {
      return Error("its name is not UTF-8 of at most " + std::to_string(kNameBytesMax) +
                       " bytes, none of them 0",
                   "name", "");
    }
    // Checked first, because a wrong value here would be reported as a missing `what`.
    DSG_RETURN_IF_ERROR(CheckMetres());
    DSG_RETURN_IF_ERROR(
        std::visit([this](const auto& what) { return CheckWhat(what); }, policy_.what));
    DSG_RETURN_IF_ERROR(CheckThinning());
    for (const std::string& layer : policy_.layers) {
      DSG_RETURN_IF_ERROR(CheckWord("layers", layer, "name a layer, or leave the list empty"));
    }
    if (policy_.IsHistory() && policy_.strength == PruneStrength::kErase) {
      return Refuse("strength", "erase",
                    "history is dropped by compacting; leave the strength out");
    }
    if (policy_.IsHistory() && !policy_.layers.empty()) {
      return Refuse("layers", policy_.layers.front(), "history goes of all layers at once");
    }
    return absl::OkStatus();
  }

 private:
  static bool HasNul(const std::string& text) { return text.find('\0') != std::string::npos; }

  // Policies of the command line have no names.
  std::string Who() const {
    return policy_.name.empty() ? "the policy" : absl::StrCat("policy \"", policy_.name, "\"");
  }

  absl::Status Error(const std::string& what, std::string_view field,
                     const std::string& value) const {
    // An invalid name cannot be part of a message.
    const bool has_name = field != "name";
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(has_name ? Who() : "the policy", ": ", what),
                     {{"policy", has_name ? policy_.name : ""},
                      {"field", std::string(field)},
                      {"value", value}});
  }

  absl::Status Refuse(std::string_view field, const std::string& value,
                      const std::string& rule) const {
    return Error(absl::StrCat(std::string(field), " is \"", value, "\"; ", rule), field, value);
  }

  absl::Status CheckWord(std::string_view field, const std::string& word,
                         const std::string& rule) const {
    if (word.empty()) return Refuse(field, "", rule);
    if (!HasNul(word)) return absl::OkStatus();
    return Error(absl::StrCat(std::string(field), " has a byte 0 in it; ", rule), field, "");
  }

  absl::Status CheckAge(std::string_view field, TimeNs age_ns) const {
    if (age_ns > 0) return absl::OkStatus();
    return Refuse(field, absl::StrCat(age_ns), "an age is above 0 ns");
  }

  absl::Status CheckWhat(const std::monostate&) const {
    if (policy_.IsThinning()) return absl::OkStatus();
    return Refuse("what", "",
                  "say what to forget: a branch, a region, a time, a layer, what was not seen, or "
                  "history; only thinning may leave it out");
  }
  absl::Status CheckWhat(const PrunePolicy::Branch& what) const {
    return CheckWord("branch", what.id_or_name, "give a node's id or name");
  }
  absl::Status CheckWhat(const PrunePolicy::Region& what) const {
    const Box3d& box = what.box_map;
    if (!box.min().allFinite() || !box.max().allFinite()) {
      return MakeError(Reason::kNumberNotFinite,
                       Who() + ": a corner of the region is not a finite number",
                       {{"policy", policy_.name}, {"field", "region"}});
    }
    if (!box.isEmpty()) return absl::OkStatus();
    return MakeError(Reason::kBoxInverted,
                     Who() + ": the region's lower corner is above its upper one; swap them",
                     {{"policy", policy_.name}, {"field", "region"}});
  }
  absl::Status CheckWhat(const PrunePolicy::Before&) const { return absl::OkStatus(); }
  absl::Status CheckWhat(const PrunePolicy::OlderThan& what) const {
    return CheckAge("older_than", what.age_ns);
  }
  absl::Status CheckWhat(const PrunePolicy::WholeLayer& what) const {
    return CheckWord("layer", what.name, "name a layer");
  }
  absl::Status CheckWhat(const PrunePolicy::UnseenSince&) const { return absl::OkStatus(); }
  absl::Status CheckWhat(const PrunePolicy::UnseenFor& what) const {
    return CheckAge("unseen_for", what.age_ns);
  }
  absl::Status CheckWhat(const PrunePolicy::HistoryOlderThan& what) const {
    return CheckAge("history_older_than", what.age_ns);
  }
  absl::Status CheckWhat(const PrunePolicy::HistoryBefore& what) const {
    if (what.revision >= 0) return absl::OkStatus();
    return Refuse("history_before_revision", absl::StrCat(what.revision), "revisions count from 0");
  }

  absl::Status CheckMetres() const {
    const double metres = policy_.simplify_m;
    // 0 forgets; -0 is an error of the caller.
    if (std::isfinite(metres) && !std::signbit(metres) && metres <= kSimplifyMaxM) {
      return absl::OkStatus();
    }
    return Refuse("simplify_m", absl::StrCat(metres),
                  absl::StrCat("give metres above 0, at most ", kSimplifyMaxM));
  }

  absl::Status CheckThinning() const {
    const double metres = policy_.simplify_m;
    const double radians = policy_.simplify_rad;
    if (!policy_.IsThinning()) return absl::OkStatus();
    if (!std::isfinite(radians) || radians <= 0.0 || radians > std::numbers::pi) {
      return Refuse("simplify_rad", absl::StrCat(radians), "give radians above 0, at most pi");
    }
    const auto& what = policy_.what;
    const auto* layer = std::get_if<PrunePolicy::WholeLayer>(&what);
    const bool names_poses = std::holds_alternative<std::monostate>(what) ||
                             std::holds_alternative<PrunePolicy::Region>(what) ||
                             std::holds_alternative<PrunePolicy::Before>(what) ||
                             std::holds_alternative<PrunePolicy::OlderThan>(what) ||
                             (layer != nullptr && layer->name == "agents");
    if (names_poses) return absl::OkStatus();
    return Refuse(
        "simplify_m", absl::StrCat(metres),
        "tracks are thinned in a region, before a time, of the layer agents, or all; drop "
        "one of both");
  }

  const PrunePolicy& policy_;
};

}  // namespace

bool PrunePolicy::IsHistory() const {
  return std::holds_alternative<HistoryOlderThan>(what) ||
         std::holds_alternative<HistoryBefore>(what);
}

absl::Status PrunePolicy::Validate() const { return Checker(*this).Check(); }

}  // namespace dsg
