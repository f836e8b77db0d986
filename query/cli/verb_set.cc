// SPDX-License-Identifier: Apache-2.0
// The verb set: a person names a room or an object, or corrects its class. It is a patch of one
// node, committed like any other change.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/json.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "query/maintenance/commit.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"
#include "schema/model/delta_check.h"
#include "schema/model/node.h"

namespace dsg::cli {
namespace {

struct SetVerb {
  std::string id;
  /// Empty = no name; unset = as it is.
  std::optional<std::string> name;
  std::optional<std::string> class_name;
};

// How often others may commit between the look at the node and the change of it.
constexpr int kTriesMax = 20;
// Of a class that no label image and no other node has numbered.
constexpr int32_t kNoClass = -1;

// One line of text, as lists print it.
absl::Status CheckLine(const std::string& option, const std::optional<std::string>& text) {
  if (!text.has_value()) return absl::OkStatus();
  if (!IsUtf8(*text)) return Usage(option + " is not UTF-8", "set");
  if (std::any_of(text->begin(), text->end(), [](char c) { return absl::ascii_iscntrl(c); })) {
    return Usage(option + " has a line break or another control character in it", "set");
  }
  if (text->size() <= kNameLengthMax) return absl::OkStatus();
  return Usage(absl::StrCat(option, " has ", text->size(), " bytes; a map takes ", kNameLengthMax),
               "set");
}

absl::Status CheckSet(const SetVerb& verb, const CommonOptions&) {
  DSG_RETURN_IF_ERROR(CheckLine("--name", verb.name));
  DSG_RETURN_IF_ERROR(CheckLine("--class", verb.class_name));
  if (ParseNodeId(verb.name.value_or("")).ok()) {
    return Usage(absl::StrCat("--name ", *verb.name, " is of the form of an id; take another name"),
                 "set");
  }
  if (verb.name.has_value() || verb.class_name.has_value()) return absl::OkStatus();
  return Usage("say what to set: --name or --class", "set");
}

absl::StatusOr<v1::GetNodeResponse> ReadNode(Session* session, const std::string& id) {
  auto request = session->Begin<v1::GetNodeRequest>();
  request.set_id(id);
  request.set_view(v1::NODE_VIEW_FULL);
  v1::GetNodeResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetNode(session->NewCall(), request, &reply));
  return reply;
}

// The number that other nodes of the class have.
absl::StatusOr<int32_t> ClassNumber(Session* session, const std::string& class_name) {
  if (class_name.empty()) return kNoClass;
  auto request = session->Begin<v1::ListNodesRequest>();
  request.mutable_filter()->set_class_name(class_name);
  request.set_view(v1::NODE_VIEW_BASIC);
  request.set_page_size(1);
  v1::ListNodesResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListNodes(session->NewCall(), request, &reply));
  return reply.nodes().empty() ? kNoClass : reply.nodes(0).semantic_class().id();
}

// Logs know agents by their names and kinds: under others the next log would bring the agent again.
absl::Status CheckIsNoAgent(const v1::Node& node) {
  if (!IsAgentKind(node.kind())) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("ID ", node.id(), " is an agent, whose name \"", node.name(),
                                "\" and kind are what logs know it by; name a room, a place or an "
                                "object"),
                   {{"field", "ID"}, {"value", node.id()}});
}

// Where a name stands for a node, one that several have is refused.
absl::Status NoteSharedName(Session* session, const v1::Node& node) {
  if (node.name().empty()) return absl::OkStatus();
  auto request = session->Begin<v1::ListNodesRequest>();
  request.mutable_filter()->set_name(node.name());
  request.set_view(v1::NODE_VIEW_BASIC);
  request.set_page_size(2);
  v1::ListNodesResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListNodes(session->NewCall(), request, &reply));
  for (const v1::Node& other : reply.nodes()) {
    if (other.id() == node.id()) continue;
    session->notes() << "dsg: note: " << other.id() << " has the name \"" << Printable(node.name())
                     << "\" too; ask for both by id\n";
    break;
  }
  return absl::OkStatus();
}

// The patch that makes the node what is asked for; without nodes if it is that already.
absl::StatusOr<v1::GraphDelta> MakePatch(Session* session, const SetVerb& verb,
                                         const v1::GetNodeResponse& found) {
  const v1::Node& node = found.node();
  v1::GraphDelta delta;
  v1::Node patch;
  patch.set_id(node.id());
  DSG_RETURN_IF_ERROR(CheckIsNoAgent(node));
  std::string message = absl::StrCat("set ", node.id());
  if (verb.name.has_value() && *verb.name != node.name()) {
    patch.set_name(*verb.name);
    patch.mutable_update_mask()->add_paths("name");
    absl::StrAppend(&message, " name \"", *verb.name, "\"");
  }
  if (verb.class_name.has_value() && *verb.class_name != node.semantic_class().name()) {
    DSG_ASSIGN_OR_RETURN(const int32_t number, ClassNumber(session, *verb.class_name));
    patch.mutable_semantic_class()->set_id(number);
    patch.mutable_semantic_class()->set_name(*verb.class_name);
    patch.mutable_update_mask()->add_paths("semantic_class");
    absl::StrAppend(&message, " class \"", *verb.class_name, "\"");
  }
  delta.set_map(session->map().name);
  delta.set_author("dsg set");
  delta.set_message(message);
  // The patch is of the node that was looked at, and makes none that is gone meanwhile.
  delta.set_parent_revision(found.header().read_revision());
  if (patch.update_mask().paths_size() > 0) *delta.add_nodes() = std::move(patch);
  return delta;
}

std::string WordOrNone(const std::string& word) { return word.empty() ? "-" : Printable(word); }

std::string RenderSet(const v1::Node& before, const v1::Node& after, int64_t revision) {
  std::string text = after.id();
  const char* comma = ": ";
  const auto add = [&](const char* what, const std::string& old_word, const std::string& new_word) {
    if (old_word == new_word) return;
    absl::StrAppend(&text, comma, what, " ", WordOrNone(old_word), " -> ", WordOrNone(new_word));
    comma = ", ";
  };
  add("name", before.name(), after.name());
  add("class", before.semantic_class().name(), after.semantic_class().name());
  return absl::StrCat(text, " (revision ", revision, ")\n");
}

absl::Status TellUnchanged(Session* session, const v1::GetNodeResponse& found, std::ostream& out) {
  if (session->common().json) return WriteJson(found, out);
  out << found.node().id() << " is so already; nothing written (revision "
      << found.header().read_revision() << ")\n";
  return absl::OkStatus();
}

absl::Status RunSet(Session* session, const SetVerb& verb, std::ostream& out) {
  v1::CommitRequest request;
  v1::CommitResponse committed;
  v1::Node before;
  absl::Status status;
  for (int tries = 0; tries < kTriesMax; ++tries) {
    DSG_ASSIGN_OR_RETURN(const v1::GetNodeResponse found, ReadNode(session, verb.id));
    before = found.node();
    DSG_ASSIGN_OR_RETURN(*request.mutable_delta(), MakePatch(session, verb, found));
    if (request.delta().nodes().empty()) return TellUnchanged(session, found, out);
    request.mutable_delta()->set_session_id(query::NewSessionId("set"));
    request.mutable_delta()->set_sequence(1);
    status = session->api().Commit(session->NewCall(), request, &committed);
    // Somebody has committed meanwhile, of this node perhaps.
    if (ReasonOf(status) != Reason::kParentRevisionStale) break;
  }
  DSG_RETURN_IF_ERROR(status);
  DSG_ASSIGN_OR_RETURN(const v1::GetNodeResponse after, ReadNode(session, before.id()));
  if (verb.name.has_value()) DSG_RETURN_IF_ERROR(NoteSharedName(session, after.node()));
  if (session->common().json) return WriteJson(after, out);
  out << RenderSet(before, after.node(), committed.revision());
  return absl::OkStatus();
}

}  // namespace

void AddSetVerb(Grammar* grammar) {
  const auto [app, added] =
      grammar->Add<SetVerb>({.name = "set",
                             .what = "Name a room or an object, or correct "
                                     "its class",
                             .example = "O9 --name \"my chair\" --class chair",
                             .takes = kServer | kMap | kJson,
                             .run = RunSet,
                             .check = CheckSet});
  SetVerb* const verb = added;
  app->add_option("ID", verb->id, kNodeHelp)->required();
  // An option of an optional text would take "" for none.
  grammar->AllowEmpty(app->add_option_function<std::string>(
      "--name", [verb](const std::string& name) { verb->name = name; }, "The name; \"\" = none"));
  grammar->AllowEmpty(app->add_option_function<std::string>(
      "--class", [verb](const std::string& name) { verb->class_name = name; },
      "The class, as other nodes have it or a new one; \"\" = none"));
}

}  // namespace dsg::cli
