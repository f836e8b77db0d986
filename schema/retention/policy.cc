// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/policy.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg {
namespace {

constexpr size_t kNameBytesMax = 200;
constexpr double kSimplifyMaxM = 1000.0;

class Checker {
 public:
  explicit Checker(const PrunePolicy& policy) : policy_(policy) {}

  absl::Status Check() const {
    if (policy_.name.size() > kNameBytesMax || !IsUtf8(policy_.name)) {
      return Refuse("name", "",
                    absl::StrCat("a name is UTF-8 of at most ", kNameBytesMax, " bytes"));
    }
    DSG_RETURN_IF_ERROR(
        std::visit([this](const auto& what) { return CheckWhat(what); }, policy_.what));
    DSG_RETURN_IF_ERROR(CheckThinning());
    for (const std::string& layer : policy_.layers) {
      if (layer.empty()) return Refuse("layers", "", "name a layer, or leave the list empty");
    }
    if (policy_.IsHistory() && !policy_.layers.empty()) {
      return Refuse("layers", policy_.layers.front(), "history goes of all layers at once");
    }
    return absl::OkStatus();
  }

 private:
  absl::Status Refuse(std::string_view field, const std::string& value,
                      const std::string& rule) const {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("policy \"", policy_.name, "\": ", std::string(field), " is \"",
                                  value, "\"; ", rule),
                     {{"policy", policy_.name}, {"field", std::string(field)}, {"value", value}});
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
    if (!what.id_or_name.empty()) return absl::OkStatus();
    return Refuse("branch", "", "give a node's id or name");
  }
  absl::Status CheckWhat(const PrunePolicy::Region& what) const {
    const Box3d& box = what.box_map;
    if (!box.min().allFinite() || !box.max().allFinite()) {
      return MakeError(Reason::kNumberNotFinite,
                       absl::StrCat("policy \"", policy_.name,
                                    "\": a corner of the region is not a finite number"),
                       {{"policy", policy_.name}, {"field", "region"}});
    }
    if (!box.isEmpty()) return absl::OkStatus();
    return MakeError(
        Reason::kBoxInverted,
        absl::StrCat("policy \"", policy_.name,
                     "\": the region's lower corner is above its upper one; swap them"),
        {{"policy", policy_.name}, {"field", "region"}});
  }
  absl::Status CheckWhat(const PrunePolicy::Before&) const { return absl::OkStatus(); }
  absl::Status CheckWhat(const PrunePolicy::OlderThan& what) const {
    return CheckAge("older_than", what.age_ns);
  }
  absl::Status CheckWhat(const PrunePolicy::WholeLayer& what) const {
    if (!what.name.empty()) return absl::OkStatus();
    return Refuse("layer", "", "name a layer");
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

  absl::Status CheckThinning() const {
    const double metres = policy_.simplify_m;
    const double radians = policy_.simplify_rad;
    if (!std::isfinite(metres) || metres < 0.0 || metres > kSimplifyMaxM) {
      return Refuse("simplify", absl::StrCat(metres),
                    absl::StrCat("give metres above 0, at most ", kSimplifyMaxM));
    }
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
        "simplify", absl::StrCat(metres),
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
