// SPDX-License-Identifier: Apache-2.0
#include "query/cli/node_names.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/paging.h"
#include "schema/base/status.h"
#include "schema/model/node.h"

namespace dsg::cli {
namespace {

// Rooms of this name or of this class; the id of the only one, or "" if there is none.
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

}  // namespace

std::string NodeNames::Text(const std::string& id) const {
  const auto found = names_.find(id);
  if (found == names_.end() || found->second.empty() || found->second == id) return id;
  return absl::StrCat(found->second, " (", id, ")");
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

// Questions about a region take ids only. GetNode knows ids and names.
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
  if (found.ok()) return reply.node().id();
  // Rooms that were made from images have a class and no name.
  DSG_ASSIGN_OR_RETURN(const std::string room, OnlyRoom(session, id_or_name, true));
  return room.empty() ? absl::StatusOr<std::string>(found) : room;
}

}  // namespace dsg::cli
