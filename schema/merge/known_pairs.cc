// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/known_pairs.h"

#include <map>
#include <utility>

#include "schema/base/status.h"

namespace dsg::merge {
namespace {

struct Claim {
  int holder = 0;
  int source = 0;
  Origin origin;
  std::optional<bool> holds;
};

std::vector<Claim> ClaimsOf(const MapContent& holder, const MapContent& source) {
  std::vector<Claim> claims;
  for (size_t i = 0; i < holder.nodes.size(); ++i) {
    for (Origin& origin : OriginsOf(holder.nodes[i])) {
      if (origin.map != source.spec.name) continue;
      const int index = source.IndexOf(origin.id);
      if (index < 0) continue;
      const std::optional<bool> holds = HoldsNow(origin, source);
      claims.push_back({static_cast<int>(i), index, std::move(origin), holds});
    }
  }
  return claims;
}

// Claims on nodes that have changed since their revision, as that revision tells.
absl::Status AskRevision(MapReader* map, Revision revision, const std::vector<Claim*>& claims,
                         const StopCheck& stop) {
  const auto then = map->At(revision);
  if (ReasonOf(then.status()) == Reason::kRevisionCompacted) return absl::OkStatus();
  DSG_RETURN_IF_ERROR(then.status());
  std::vector<NodeId> ids;
  for (const Claim* claim : claims) ids.push_back(claim->origin.id);
  DSG_ASSIGN_OR_RETURN(const std::vector<std::optional<Node>> nodes, (*then)->FindNodes(ids, stop));
  for (size_t i = 0; i < claims.size(); ++i) {
    claims[i]->holds = nodes[i].has_value() && MarkOf(*nodes[i]) == claims[i]->origin.seen_mark;
  }
  return absl::OkStatus();
}

absl::Status AskPast(MapReader* map, std::vector<Claim>* claims, const StopCheck& stop) {
  std::map<Revision, std::vector<Claim*>> open;
  for (Claim& claim : *claims) {
    const bool can_tell = claim.origin.seen_mark != 0 && !claim.origin.revisions.empty();
    if (!claim.holds.has_value() && can_tell) {
      open[claim.origin.revisions.back()].push_back(&claim);
    }
  }
  for (const auto& [revision, those] : open) {
    DSG_RETURN_IF_ERROR(AskRevision(map, revision, those, stop));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Claim>> HoldingClaims(const MapContent& holder, const MapContent& source,
                                                 MapReader* source_map, const StopCheck& stop) {
  std::vector<Claim> claims = ClaimsOf(holder, source);
  if (source_map != nullptr) DSG_RETURN_IF_ERROR(AskPast(source_map, &claims, stop));
  int64_t balance = 0;
  for (const Claim& claim : claims) {
    if (claim.holds.has_value()) balance += *claim.holds ? 1 : -1;
  }
  std::erase_if(claims, [&](const Claim& claim) { return !claim.holds.value_or(balance >= 0); });
  return claims;
}

}  // namespace

std::optional<bool> HoldsNow(const Origin& origin, const MapContent& source) {
  if (origin.seen_mark == 0 || origin.revisions.empty()) return std::nullopt;
  const Revision taken_at = origin.revisions.back();
  if (taken_at > source.revision) return false;
  const int index = source.IndexOf(origin.id);
  if (index < 0) return std::nullopt;
  const Node& node = source.nodes[static_cast<size_t>(index)];
  if (node.revision > taken_at) return std::nullopt;
  return MarkOf(node) == origin.seen_mark;
}

absl::StatusOr<KnownPairs> FindKnownPairs(const MapContent& into, const MapContent& other,
                                          MapReader* into_map, MapReader* other_map,
                                          const StopCheck& stop) {
  KnownPairs known;
  known.pair_of.assign(other.nodes.size(), -1);
  known.origin_of.resize(other.nodes.size());
  for (const Node& node : other.nodes) known.mark_of.push_back(MarkOf(node));
  DSG_ASSIGN_OR_RETURN(const std::vector<Claim> from_here,
                       HoldingClaims(other, into, into_map, stop));
  for (const Claim& claim : from_here) {
    known.pair_of[static_cast<size_t>(claim.holder)] = claim.source;
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<Claim> from_there,
                       HoldingClaims(into, other, other_map, stop));
  for (const Claim& claim : from_there) {
    known.pair_of[static_cast<size_t>(claim.source)] = claim.holder;
    known.origin_of[static_cast<size_t>(claim.source)] = claim.origin;
  }
  return known;
}

}  // namespace dsg::merge
