// SPDX-License-Identifier: Apache-2.0
#include "query/cli/lookups.h"

#include <set>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/session.h"
#include "query/cli/values.h"
#include "schema/base/status.h"
#include "schema/model/node.h"
#include "schema/store/tags.h"

namespace dsg::cli {
namespace {

// The id of the only room of this name or class; "" without one.
absl::StatusOr<std::string> OnlyRoom(Session* session, const std::string& word, bool by_class) {
  auto request = session->Begin<v1::ListNodesRequest>();
  if (by_class) {
    request.mutable_filter()->set_class_name(word);
  } else {
    request.mutable_filter()->set_name(word);
  }
  request.mutable_filter()->set_kind(kinds::kRoom);
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::ListNodesResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListNodes(session->NewCall(), request, &reply));
  if (reply.nodes().empty()) return std::string();
  if (reply.nodes_size() == 1) return reply.nodes(0).id();
  std::string ids;
  for (const v1::Node& room : reply.nodes()) absl::StrAppend(&ids, " ", room.id());
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("--room: several rooms are ", by_class ? "of class \"" : "called \"", word,
                   "\"; name one by its id:", ids),
      {{"field", "--room"}, {"value", word}});
}

// The span of all poses at the revision asked for; open without poses.
absl::StatusOr<Interval> PoseSpan(Session* session) {
  const auto request = session->Begin<v1::GetMapStatsRequest>();
  v1::GetMapStatsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &reply));
  Interval span;
  if (reply.has_first_pose_ns()) span.from_ns = reply.first_pose_ns();
  // The interval is half-open, and the last pose belongs to it.
  if (reply.has_last_pose_ns() && reply.last_pose_ns() < kTimeMax) {
    span.to_ns = reply.last_pose_ns() + 1;
  }
  return span;
}

absl::Status BeyondPoses(const TimeText& times, const Interval& asked, bool is_from_given) {
  const std::string what =
      is_from_given
          ? absl::StrCat("--from ", times.Full(asked.from_ns),
                         " is behind the last pose of the map, ", times.Full(asked.to_ns - 1),
                         ", at which --to ends by default; give an earlier --from")
          : absl::StrCat("--to ", times.Full(asked.to_ns),
                         " is not behind the first pose of the map, ", times.Full(asked.from_ns),
                         ", at which --from begins by default; give a later --to");
  return MakeError(Reason::kTimeRangeInverted, what,
                   {{"field", is_from_given ? "--from" : "--to"}});
}

}  // namespace

std::string NodeNames::Text(const std::string& id) const {
  const auto found = names_.find(id);
  return found == names_.end() ? id : NamedId(id, found->second);
}

Cell NodeNames::Of(const std::string& id) const {
  if (id.empty()) return Cell();
  const auto found = names_.find(id);
  return NodeCell{id, found == names_.end() ? "" : found->second};
}

absl::StatusOr<NodeNames> NamesOf(Session* session, int64_t revision,
                                  const std::vector<std::string>& ids) {
  std::map<std::string, std::string> names;
  for (const std::string& id : ids) {
    if (!id.empty()) names[id];
  }
  for (auto it = names.begin(); it != names.end();) {
    auto request = session->Begin<v1::BatchGetNodesRequest>();
    request.mutable_read_at()->set_exact_revision(revision);
    request.set_view(v1::NODE_VIEW_BASIC);
    for (; it != names.end() && request.ids_size() < kPageSizeMax; ++it) request.add_ids(it->first);
    v1::BatchGetNodesResponse reply;
    DSG_RETURN_IF_ERROR(session->api().BatchGetNodes(session->NewCall(), request, &reply));
    for (const v1::GetNodeResult& result : reply.results()) {
      if (result.status_code() == 0) names[result.node().id()] = result.node().name();
    }
  }
  return NodeNames(std::move(names));
}

absl::StatusOr<std::vector<std::string>> NamesOfMaps(const Session& session) {
  v1::ListMapsResponse reply;
  DSG_RETURN_IF_ERROR(session.api().ListMaps(session.NewCall(), v1::ListMapsRequest(), &reply));
  std::vector<std::string> names;
  for (const v1::MapSpec& map : reply.maps()) names.push_back(map.name());
  return names;
}

absl::StatusOr<SearchWords> WordsOfSearches(const Session& session) {
  // A class may stand in several layers.
  std::set<std::string> layers;
  std::map<v1::WordType, std::set<std::string>> words;
  const auto take = [&](const v1::ListVocabularyResponse& page) {
    for (const v1::Word& word : page.words()) {
      words[word.type()].insert(word.text());
      // Edges have none.
      if (!word.layer().empty()) layers.insert(word.layer());
    }
    return absl::OkStatus();
  };
  DSG_RETURN_IF_ERROR(session.EachPage(&query::Api::ListVocabulary,
                                       session.Begin<v1::ListVocabularyRequest>(), 0,
                                       &v1::ListVocabularyResponse::words_size, take));
  const auto list = [](const std::set<std::string>& found) {
    return std::vector<std::string>(found.begin(), found.end());
  };
  return SearchWords{.layers = list(layers),
                     .kinds = list(words[v1::WORD_TYPE_KIND]),
                     .classes = list(words[v1::WORD_TYPE_CLASS]),
                     .relations = list(words[v1::WORD_TYPE_RELATION])};
}

absl::StatusOr<NodeWords> WordsOfNodes(const Session& session, const std::string& layer,
                                       int64_t node_count_max) {
  auto request = session.Begin<v1::ListNodesRequest>();
  request.mutable_filter()->set_layer(layer);
  request.set_view(v1::NODE_VIEW_BASIC);
  std::set<std::string> names;
  NodeWords words;
  DSG_RETURN_IF_ERROR(session.EachPage(&query::Api::ListNodes, request, node_count_max,
                                       &v1::ListNodesResponse::nodes_size,
                                       [&](const v1::ListNodesResponse& page) {
                                         for (const v1::Node& node : page.nodes()) {
                                           words.ids.push_back(node.id());
                                           names.insert(node.name());
                                           if (node.kind() == kinds::kRoom)
                                             names.insert(node.semantic_class().name());
                                         }
                                         return absl::OkStatus();
                                       }));
  names.erase("");
  words.names.assign(names.begin(), names.end());
  return words;
}

absl::StatusOr<std::string> NodeIdOf(Session* session, const std::string& id_or_name) {
  auto request = session->Begin<v1::GetNodeRequest>();
  request.set_id(id_or_name);
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::GetNodeResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetNode(session->NewCall(), request, &reply));
  return reply.node().id();
}

// Requests about a region take ids only; GetNode takes ids and names.
absl::StatusOr<std::string> RegionId(Session* session, const std::string& id_or_name) {
  auto request = session->Begin<v1::GetNodeRequest>();
  request.set_id(id_or_name);
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::GetNodeResponse reply;
  const absl::Status found = session->api().GetNode(session->NewCall(), request, &reply);
  if (found.ok() && reply.node().id() == id_or_name) return id_or_name;
  if (!found.ok() && !absl::IsNotFound(found) && !absl::IsInvalidArgument(found)) return found;
  DSG_ASSIGN_OR_RETURN(const std::string named, OnlyRoom(session, id_or_name, false));
  if (!named.empty()) return named;
  // Rooms found in images have a class but no name.
  DSG_ASSIGN_OR_RETURN(const std::string room, OnlyRoom(session, id_or_name, true));
  if (room.empty()) return found.ok() ? absl::StatusOr<std::string>(reply.node().id()) : found;
  if (!found.ok()) return room;
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("--room: \"", id_or_name, "\" is the name of the ", reply.node().kind(), " ",
                   reply.node().id(), " and the class of room ", room, "; name one by its id"),
      {{"field", "--room"}, {"value", id_or_name}});
}

absl::StatusOr<v1::ListTagsResponse> ReadTags(Session* session) {
  v1::ListTagsRequest request;
  request.set_map(session->map().name);
  v1::ListTagsResponse reply;
  const absl::Status status = session->api().ListTags(session->NewCall(), request, &reply);
  if (!absl::IsUnimplemented(status)) DSG_RETURN_IF_ERROR(status);
  return reply;
}

absl::StatusOr<std::optional<Revision>> NumberOf(const RevisionOption& revision, Session* session) {
  if (revision.committed_at_ns.has_value()) {
    v1::GetMapStatsRequest request;
    request.set_map(session->map().name);
    request.mutable_read_at()->set_committed_at_ns(*revision.committed_at_ns);
    v1::GetMapStatsResponse stats;
    DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &stats));
    return std::optional<Revision>(stats.header().read_revision());
  }
  if (revision.tag.empty()) return revision.number;
  DSG_ASSIGN_OR_RETURN(const v1::ListTagsResponse reply, ReadTags(session));
  std::vector<Tag> tags;
  for (const v1::Tag& tag : reply.tags()) {
    if (tag.name() == revision.tag) return std::optional<Revision>(tag.revision());
    tags.emplace_back().name = tag.name();
  }
  const std::string& map = session->map().name;
  return MakeError(
      Reason::kTagUnknown,
      absl::StrCat("map \"", map, "\" has no tag \"", revision.tag, "\"; it has ", TagNames(tags)),
      {{"map", map}, {"tag", revision.tag}});
}

absl::StatusOr<Interval> AskedInterval(Session* session, const std::string& from,
                                       const std::string& to) {
  Interval asked;
  if (from.empty() || to.empty()) {
    DSG_ASSIGN_OR_RETURN(asked, PoseSpan(session));
  }
  const MapSpec& map = session->map();
  if (!from.empty()) {
    DSG_ASSIGN_OR_RETURN(asked.from_ns, ParseInstant("--from", from, map));
  }
  if (!to.empty()) {
    DSG_ASSIGN_OR_RETURN(asked.to_ns, ParseInstant("--to", to, map));
  }
  // Of two that are given the question itself tells; here one is an end of all poses.
  if (asked.from_ns >= asked.to_ns && from.empty() != to.empty()) {
    return BeyondPoses(session->times(), asked, to.empty());
  }
  return asked;
}

absl::Status FillFilter(const FilterOptions& options, const MapSpec& map, v1::NodeFilter* filter) {
  filter->set_layer(options.layer);
  filter->set_kind(options.kind);
  filter->set_class_name(options.class_name);
  DSG_RETURN_IF_ERROR(SetInstant("--at", options.at, map, filter, &v1::NodeFilter::set_at_ns));
  return absl::OkStatus();
}

v1::NodePattern WordsOf(const FilterOptions& options) {
  v1::NodePattern words;
  words.set_layer(options.layer);
  words.set_kind(options.kind);
  words.set_class_name(options.class_name);
  return words;
}

absl::Status CheckWords(Session* session, const v1::NodePattern& words) {
  if (words.ByteSizeLong() == 0) return absl::OkStatus();
  // The search names the words of the map that are similar.
  auto request = session->Begin<v1::SearchNodesRequest>();
  *request.mutable_pattern() = words;
  request.set_page_size(1);
  v1::SearchNodesResponse reply;
  absl::Status status = session->api().SearchNodes(session->NewCall(), request, &reply);
  switch (ReasonOf(status)) {
    case Reason::kLayerUnknown:
    case Reason::kClassUnknown:
    case Reason::kRelationUnknown:
      return status;
    default:
      return absl::OkStatus();
  }
}

}  // namespace dsg::cli
