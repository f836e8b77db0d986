// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/origins.h"

#include <algorithm>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

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
    Origin origin{names[i].substr(0, slash), *id, 0, false};
    absl::string_view count = i < counts.size() ? counts[i] : absl::string_view();
    origin.is_copy = absl::ConsumePrefix(&count, kCopy);
    if (!absl::SimpleAtoi(count, &origin.observation_count)) origin.observation_count = 0;
    origins.push_back(std::move(origin));
  }
  return origins;
}

int64_t SetOrigin(Origin origin, Node* node) {
  std::vector<Origin> origins = OriginsOf(*node);
  auto found = std::find_if(origins.begin(), origins.end(), [&](const Origin& known) {
    return known.map == origin.map && known.id == origin.id;
  });
  int64_t before = 0;
  if (found == origins.end()) {
    origins.push_back(std::move(origin));
  } else {
    before = found->observation_count;
    found->observation_count = origin.observation_count;
  }
  std::string names;
  std::string counts;
  for (const Origin& each : origins) {
    const char* blank = names.empty() ? "" : " ";
    absl::StrAppend(&names, blank, each.map, "/", ToString(each.id));
    absl::StrAppend(&counts, blank, each.is_copy ? kCopy : "", each.observation_count);
  }
  node->attributes[kMergedFrom] = std::move(names);
  node->attributes[kMergedCounts] = std::move(counts);
  return before;
}

std::optional<Origin> CopiedFrom(const Node& node) {
  const std::vector<Origin> origins = OriginsOf(node);
  if (origins.size() != 1 || !origins.front().is_copy) return std::nullopt;
  return origins.front();
}

}  // namespace dsg::merge
