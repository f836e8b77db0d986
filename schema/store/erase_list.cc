// SPDX-License-Identifier: Apache-2.0
#include "schema/store/erase_list.h"

#include <algorithm>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

void JoinSpans(std::vector<TrackSpan>* spans) {
  std::sort(spans->begin(), spans->end(), [](const TrackSpan& a, const TrackSpan& b) {
    return std::tie(a.agent, a.from_ns, a.to_ns) < std::tie(b.agent, b.from_ns, b.to_ns);
  });
  std::vector<TrackSpan> joined;
  for (const TrackSpan& span : *spans) {
    const bool touches =
        !joined.empty() && joined.back().agent == span.agent && span.from_ns <= joined.back().to_ns;
    if (touches) {
      joined.back().to_ns = std::max(joined.back().to_ns, span.to_ns);
    } else {
      joined.push_back(span);
    }
  }
  *spans = std::move(joined);
}

bool IsIn(const std::vector<TrackSpan>& spans, const TrackSpan& span) {
  return std::any_of(spans.begin(), spans.end(), [&](const TrackSpan& other) {
    return other.agent == span.agent && other.from_ns <= span.from_ns && other.to_ns >= span.to_ns;
  });
}

}  // namespace

size_t EraseList::size() const {
  return keys.nodes.size() + keys.edges.size() + keys.mesh_blocks.size() + spans.size();
}

void EraseList::Add(const EraseList& other) {
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  append(other.keys.nodes, &keys.nodes);
  append(other.keys.edges, &keys.edges);
  append(other.keys.mesh_blocks, &keys.mesh_blocks);
  append(other.spans, &spans);
  assets = assets || other.assets;
  keys.Normalize();
  JoinSpans(&spans);
}

absl::StatusOr<EraseList> ListOf(
    const Erasure& erasure,
    const std::function<absl::StatusOr<int64_t>(const std::string&)>& find_relation) {
  EraseList named;
  named.keys.nodes = erasure.nodes;
  named.keys.mesh_blocks = erasure.mesh_blocks;
  named.spans = erasure.tracks;
  named.assets = erasure.assets;
  for (const EdgeKey& edge : erasure.edges) {
    DSG_ASSIGN_OR_RETURN(const int64_t relation, find_relation(edge.relation));
    if (relation != 0) named.keys.edges.push_back({edge.source, relation, edge.target});
  }
  EraseList list;
  list.Add(named);
  return list;
}

absl::StatusOr<RipeAndRest> SortByRipeness(const EraseList& noted, const EraseList& named,
                                           const BelievedSince& is_believed) {
  RipeAndRest sorted;
  sorted.ripe.assets = sorted.rest.assets = noted.assets;
  const auto sort = [&](const auto& ask, auto part) -> absl::Status {
    const auto& also_named = named.keys.*part;
    for (const auto& key : noted.keys.*part) {
      DSG_ASSIGN_OR_RETURN(const bool is_there, ask(key));
      const bool is_named = std::binary_search(also_named.begin(), also_named.end(), key);
      ((is_there && !is_named ? sorted.rest : sorted.ripe).keys.*part).push_back(key);
    }
    return absl::OkStatus();
  };
  DSG_RETURN_IF_ERROR(sort(is_believed.node, &TouchedKeys::nodes));
  DSG_RETURN_IF_ERROR(sort(is_believed.edge, &TouchedKeys::edges));
  DSG_RETURN_IF_ERROR(sort(is_believed.mesh_block, &TouchedKeys::mesh_blocks));
  for (const TrackSpan& span : noted.spans) {
    DSG_ASSIGN_OR_RETURN(const bool is_there, is_believed.span(span));
    (is_there && !IsIn(named.spans, span) ? sorted.rest : sorted.ripe).spans.push_back(span);
  }
  return sorted;
}

PendingErasure CountsOf(const EraseList& list) {
  const auto count = [](const auto& items) { return static_cast<int64_t>(items.size()); };
  return {count(list.keys.nodes), count(list.keys.edges), count(list.keys.mesh_blocks),
          count(list.spans)};
}

std::string PendingErasureNote(const PendingErasure& left) {
  const int64_t count = left.node_count + left.edge_count + left.mesh_block_count + left.span_count;
  if (count == 0) {
    return "an erasure has not come to its end, and what it took out may still be in the file; the "
           "next `dsg prune --erase`, whatever it names, does the rest";
  }
  return absl::StrCat("an erasure has not come to its end, and names ", left.node_count, " nodes, ",
                      left.edge_count, " edges, ", left.mesh_block_count, " mesh blocks and ",
                      left.span_count,
                      " stretches of tracks; the same `dsg prune --erase` again does the rest");
}

absl::Status AgentIsThereError(const std::string& map, NodeId agent) {
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("cannot erase the past of agent ", ToString(agent), " of map \"", map,
                   "\": it is still there; retire it first, or name spans of its "
                   "track"),
      {{"field", "nodes"}, {"value", ToString(agent)}});
}

bool ForgottenKeys::Edit(Revision before, Revision revision, TouchedKeys* keys) const {
  bool is_changed = nodes_.Edit(before, revision, &keys->nodes);
  const size_t edge_count = keys->edges.size();
  std::erase_if(keys->edges, [&](const EdgeRowKey& key) {
    return !edges_.contains(key) && (nodes_.contains(key.source) || nodes_.contains(key.target));
  });
  is_changed = edges_.Edit(before, revision, &keys->edges) || is_changed;
  is_changed = mesh_blocks_.Edit(before, revision, &keys->mesh_blocks) || is_changed;
  const size_t track_count = keys->tracks.size();
  std::erase_if(keys->tracks, [&](NodeId agent) { return tracks_.contains(agent); });
  is_changed = is_changed || keys->edges.size() != edge_count || keys->tracks.size() != track_count;
  if (is_changed) keys->Normalize();
  return is_changed;
}

}  // namespace dsg
