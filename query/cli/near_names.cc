// SPDX-License-Identifier: Apache-2.0
#include "query/cli/near_names.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "query/cli/lookups.h"
#include "schema/base/spelling.h"
#include "schema/base/status.h"
#include "schema/model/ids.h"

namespace dsg::cli {
namespace {

// A mistake must not take longer than an answer.
constexpr int64_t kNodesReadMax = 20'000;

std::string HintOf(const std::string& word, const absl::StatusOr<std::vector<std::string>>& known) {
  return known.ok() ? NearHint(word, *known) : "";
}

// Names, and the ids of all, since some have no name.
absl::StatusOr<std::vector<std::string>> NodeWordsOf(Session* session, const std::string& layer) {
  DSG_ASSIGN_OR_RETURN(NodeWords words, WordsOfNodes(*session, layer, kNodesReadMax));
  words.names.insert(words.names.end(), words.ids.begin(), words.ids.end());
  return std::move(words.names);
}

}  // namespace

absl::Status WithNearNames(Session* session, const absl::Status& status) {
  const Reason reason = ReasonOf(status);
  const ErrorMetadata metadata = MetadataOf(status);
  const auto word_of = [&](const char* key) {
    const auto found = metadata.find(key);
    return found == metadata.end() ? std::string() : found->second;
  };
  if (absl::StrContains(status.message(), "near in spelling")) return status;
  std::string hint;
  if (reason == Reason::kMapUnknown && !word_of("map").empty()) {
    hint = HintOf(word_of("map"), NamesOfMaps(*session));
  } else if (reason == Reason::kAgentUnknown && !ParseNodeId(word_of("agent")).ok()) {
    hint = HintOf(word_of("agent"), NodeWordsOf(session, "agents"));
  } else if (reason == Reason::kNodeUnknown && !word_of("node").empty() &&
             !ParseNodeId(word_of("node")).ok()) {
    hint = HintOf(word_of("node"), NodeWordsOf(session, ""));
  }
  if (hint.empty()) return status;
  return MakeError(reason, absl::StrCat(status.message(), hint), metadata);
}

}  // namespace dsg::cli
