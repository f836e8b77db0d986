// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/origins.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/codec/proto_convert.h"

namespace dsg::merge {
namespace {

constexpr char kCopy[] = "new:";

std::vector<std::string> Words(const Attributes& attributes, const char* name) {
  const auto found = attributes.find(name);
  if (found == attributes.end()) return {};
  const auto* text = std::get_if<std::string>(&found->second);
  if (text == nullptr) return {};
  return absl::StrSplit(*text, ' ', absl::SkipEmpty());
}

uint64_t HexNumber(absl::string_view text) {
  uint64_t number = 0;
  return absl::SimpleHexAtoi(text, &number) ? number : 0;
}

// "new:57@12,15:<seen>:<written>"; missing or malformed parts keep their defaults.
void ReadCount(absl::string_view text, Origin* origin) {
  origin->is_copy = absl::ConsumePrefix(&text, kCopy);
  const std::vector<absl::string_view> parts = absl::StrSplit(text, ':');
  const std::vector<absl::string_view> taken = absl::StrSplit(parts[0], '@');
  if (!absl::SimpleAtoi(taken[0], &origin->observation_count)) origin->observation_count = 0;
  if (taken.size() > 1) {
    for (const absl::string_view word : absl::StrSplit(taken[1], ',')) {
      Revision revision = 0;
      if (absl::SimpleAtoi(word, &revision)) origin->revisions.push_back(revision);
    }
  }
  if (parts.size() > 1) origin->seen_mark = HexNumber(parts[1]);
  if (parts.size() > 2) origin->written_mark = HexNumber(parts[2]);
}

std::string CountText(const Origin& origin) {
  std::string text = absl::StrCat(origin.is_copy ? kCopy : "", origin.observation_count);
  if (origin.revisions.empty()) return text;
  absl::StrAppend(&text, "@", absl::StrJoin(origin.revisions, ","), ":",
                  absl::Hex(origin.seen_mark));
  if (origin.is_copy) absl::StrAppend(&text, ":", absl::Hex(origin.written_mark));
  return text;
}

}  // namespace

std::vector<Origin> OriginsOf(const Node& node) {
  std::vector<Origin> origins;
  const std::vector<std::string> counts = Words(node.attributes, kMergedCounts);
  const std::vector<std::string> names = Words(node.attributes, kMergedFrom);
  for (size_t i = 0; i < names.size(); ++i) {
    const size_t slash = names[i].find('/');
    if (slash == std::string::npos) continue;
    const absl::StatusOr<NodeId> id = ParseNodeId(names[i].substr(slash + 1));
    if (!id.ok()) continue;
    Origin origin;
    origin.map = names[i].substr(0, slash);
    origin.id = *id;
    if (i < counts.size()) ReadCount(counts[i], &origin);
    origins.push_back(std::move(origin));
  }
  return origins;
}

void SetOrigin(Origin origin, Node* node) {
  std::vector<Origin> origins = OriginsOf(*node);
  auto found = std::find_if(origins.begin(), origins.end(), [&](const Origin& known) {
    return known.map == origin.map && known.id == origin.id;
  });
  if (found == origins.end()) {
    origins.push_back(std::move(origin));
  } else {
    *found = std::move(origin);
  }
  std::string names;
  std::string counts;
  for (const Origin& each : origins) {
    const char* blank = names.empty() ? "" : " ";
    absl::StrAppend(&names, blank, each.map, "/", ToString(each.id));
    absl::StrAppend(&counts, blank, CountText(each));
  }
  node->attributes[kMergedFrom] = std::move(names);
  node->attributes[kMergedCounts] = std::move(counts);
}

std::optional<Origin> CopiedFrom(const Node& node) {
  const std::vector<Origin> origins = OriginsOf(node);
  if (origins.size() != 1 || !origins.front().is_copy) return std::nullopt;
  return origins.front();
}

uint64_t MarkOf(const Node& node) {
  Node bare = node;
  bare.name.clear();
  bare.attributes.erase(kMergedFrom);
  bare.attributes.erase(kMergedCounts);
  if (bare.place.has_value() || bare.region.has_value()) bare.box_node.setEmpty();
  // Checksum of what the store returns, after one round trip through the codec.
  Node stored;
  std::string bytes = EncodeNodePayload(bare);
  if (DecodeNodePayload(bytes, &stored)) bytes = EncodeNodePayload(stored);
  const auto mark = static_cast<uint64_t>(Checksum(bytes));
  return mark == 0 ? 1 : mark;
}

bool IsAsWritten(const Node& node, const Origin& origin) {
  return origin.written_mark != 0 && origin.written_mark == MarkOf(node);
}

int64_t OwnCount(const Node& node) {
  int64_t taken = 0;
  for (const Origin& origin : OriginsOf(node)) taken = AddCounts(taken, origin.observation_count);
  return std::max<int64_t>(0, node.observation_count - taken);
}

int64_t AddCounts(int64_t a, int64_t b) {
  a = std::max<int64_t>(0, a);
  b = std::max<int64_t>(0, b);
  constexpr int64_t kMax = std::numeric_limits<int64_t>::max();
  return a > kMax - b ? kMax : a + b;
}

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

// Decides claims on nodes that have changed since their revision, by that revision.
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

namespace {

class HistoryReader {
 public:
  HistoryReader(const Snapshot& other, MapReader* other_map)
      : other_(other), other_map_(other_map) {}

  // Null if the revision is not readable any more.
  absl::StatusOr<std::shared_ptr<const Snapshot>> At(Revision revision) {
    std::shared_ptr<const Snapshot> none;
    if (other_map_ == nullptr) return none;
    const auto known = snapshots_.find(revision);
    if (known != snapshots_.end()) return known->second;
    auto then = other_map_->At(revision);
    if (!then.ok() && ReasonOf(then.status()) != Reason::kRevisionCompacted) return then.status();
    return snapshots_[revision] = then.ok() ? *std::move(then) : none;
  }

  // Whether the track of an agent was written after a revision.
  absl::StatusOr<bool> HasChanged(NodeId agent, Revision since, const StopCheck& stop) {
    if (since == other_.revision()) return false;
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> then, At(since));
    if (then == nullptr) return true;
    auto [touched, is_new] = touched_.try_emplace(since);
    if (is_new) {
      DSG_ASSIGN_OR_RETURN(Touched all, other_map_->TouchedBetween(since, other_.revision(), stop));
      touched->second = std::move(all.tracks);
    }
    return std::binary_search(touched->second.begin(), touched->second.end(), agent);
  }

 private:
  const Snapshot& other_;
  MapReader* const other_map_;
  std::map<Revision, std::shared_ptr<const Snapshot>> snapshots_;
  std::map<Revision, std::vector<NodeId>> touched_;
};

}  // namespace

absl::StatusOr<TrackHistory> ReadTrackHistory(const MapContent& content, const KnownPairs& known,
                                              const Snapshot& other, MapReader* other_map,
                                              const StopCheck& stop) {
  TrackHistory history;
  HistoryReader reader(other, other_map);
  for (const int agent : content.OfClass(NodeClass::kAgent)) {
    const std::optional<Origin>& origin = known.origin_of[static_cast<size_t>(agent)];
    if (!origin.has_value() || !origin->is_copy || origin->revisions.empty()) continue;
    const std::vector<Revision>& revisions = origin->revisions;
    const NodeId id = content.nodes[static_cast<size_t>(agent)].id;
    DSG_ASSIGN_OR_RETURN(const bool has_changed, reader.HasChanged(id, revisions.back(), stop));
    if (has_changed) history.changed.insert(agent);
    // If only the present state was ever copied, nothing needs a correction.
    if (!has_changed && revisions.size() == 1) continue;
    auto& bases = history.bases[agent];
    for (const Revision revision : revisions) {
      if (revision == other.revision()) {
        bases.push_back(nullptr);
        continue;
      }
      DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> then, reader.At(revision));
      if (then != nullptr) bases.push_back(std::move(then));
    }
  }
  return history;
}

std::optional<Pose3d> TransformOfLastMerge(const MapContent& into, const MapContent& other) {
  std::vector<Pose3d> transforms;
  for (const Node& node : into.nodes) {
    const auto copy = CopiedFrom(node);
    if (!copy.has_value() || copy->map != other.spec.name) continue;
    const int index = other.IndexOf(copy->id);
    if (index < 0) continue;
    const bool is_other = !HoldsNow(*copy, other).value_or(true);
    if (is_other || !IsAsWritten(node, *copy)) continue;
    const Node& theirs = other.nodes[static_cast<size_t>(index)];
    Pose3d transform = node.map_T_node * theirs.map_T_node.Inverse();
    transform.orientation.normalize();
    transforms.push_back(transform);
  }
  // Copies that moved in a later revision of the other map are outliers.
  const auto agreeing = [&](const Pose3d& pose) {
    return std::count_if(transforms.begin(), transforms.end(), [&](const Pose3d& each) {
      return (each.position - pose.position).norm() < 0.01 &&
             AngleBetween(each.orientation, pose.orientation) < 0.001;
    });
  };
  const size_t tried = std::min<size_t>(transforms.size(), 20);
  for (size_t i = 0; i < tried; ++i) {
    if (agreeing(transforms[i]) * 2 > static_cast<int64_t>(transforms.size())) {
      return transforms[i];
    }
  }
  return std::nullopt;
}

}  // namespace dsg::merge
