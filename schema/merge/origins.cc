// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/origins.h"

#include <algorithm>
#include <limits>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
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

// "new:57@12,15:<seen>:<written>"; what is missing or is no number stays as it is.
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
  // As the store gives it back.
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

}  // namespace dsg::merge
