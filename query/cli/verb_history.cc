// SPDX-License-Identifier: Apache-2.0
// The verbs about what is believed: history (of one node) and words (that searches can use).
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/list_writer.h"
#include "query/cli/session.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"
#include "schema/model/ids.h"

namespace dsg::cli {
namespace {

struct HistoryVerb {
  std::string id;
};
struct WordsVerb {};

// A name as the newest revision has it; an id may be of a node that is gone.
absl::StatusOr<std::string> IdOf(Session* session, const std::string& id_or_name) {
  v1::GetNodeRequest request;
  request.set_map(session->map().name);
  request.set_id(id_or_name);
  request.set_view(v1::NODE_VIEW_ID);
  v1::GetNodeResponse reply;
  const absl::Status found = session->api().GetNode(session->NewCall(), request, &reply);
  if (found.ok()) return reply.node().id();
  if (absl::IsNotFound(found) && ParseNodeId(id_or_name).ok()) return id_or_name;
  return found;
}

Row VersionRow(const v1::NodeVersion& version) {
  const v1::Node& node = version.node();
  Row row = {version.from_revision(),      Cell(), node.name(), node.kind(),
             node.semantic_class().name(), Cell(), Cell(),      Cell()};
  if (version.has_to_revision()) row[1] = version.to_revision();
  if (node.map_t_node().has_position()) {
    const v1::Vector3& at = node.map_t_node().position();
    row[5] = at.x();
    row[6] = at.y();
    row[7] = at.z();
  }
  return row;
}

absl::Status RunHistory(Session* session, const HistoryVerb& verb, std::ostream& out) {
  v1::ListNodeVersionsRequest request;
  request.set_map(session->map().name);
  DSG_ASSIGN_OR_RETURN(const std::string id, IdOf(session, verb.id));
  request.set_id(id);
  request.set_view(v1::NODE_VIEW_FULL);
  ListWriter list(session->common(), session->times(), "versions",
                  {{"from", CellType::kCount, 2, "", "from_revision"},
                   {"to", CellType::kCount, 2, "now", "to_revision"},
                   {"name"},
                   {"kind"},
                   {"class"},
                   {"x m", CellType::kReal},
                   {"y m", CellType::kReal},
                   {"z m", CellType::kReal}},
                  &out);
  const auto take = [&](const v1::ListNodeVersionsResponse& page) {
    return list.Add(page, page.versions(), VersionRow);
  };
  DSG_RETURN_IF_ERROR(session->EachPage(&query::Api::ListNodeVersions, request,
                                        session->common().limit,
                                        &v1::ListNodeVersionsResponse::versions_size, take));
  return list.End("");
}

std::string TypeText(v1::WordType type) {
  switch (type) {
    case v1::WORD_TYPE_KIND:
      return "kind";
    case v1::WORD_TYPE_CLASS:
      return "class";
    case v1::WORD_TYPE_RELATION:
      return "relation";
    default:
      return absl::StrCat("type ", static_cast<int>(type));
  }
}

absl::Status RunWords(Session* session, const WordsVerb&, std::ostream& out) {
  const auto request = session->Begin<v1::ListVocabularyRequest>();
  ListWriter list(session->common(), session->times(), "words",
                  {{"type"}, {"layer"}, {"word"}, {"count", CellType::kCount}}, &out);
  const auto take = [&](const v1::ListVocabularyResponse& page) {
    return list.Add(page, page.words(), [](const v1::Word& word) {
      return Row{TypeText(word.type()), word.layer(), word.text(), word.count()};
    });
  };
  DSG_RETURN_IF_ERROR(session->EachPage(&query::Api::ListVocabulary, request,
                                        session->common().limit,
                                        &v1::ListVocabularyResponse::words_size, take));
  return list.End("");
}

}  // namespace

void AddHistoryVerbs(Grammar* grammar) {
  const auto [history, verb] =
      grammar->Add<HistoryVerb>({.name = "history",
                                 .what = "What was believed of a node, newest first",
                                 .example = "O9",
                                 .takes = kServer | kMap | kJson | kLimit | kFormat,
                                 .run = RunHistory});
  history->add_option("ID", verb->id, kNodeHelp)->required();
  grammar->Add<WordsVerb>({.name = "words",
                           .what = "Kinds, classes and relations that searches can use, counted",
                           .example = "",
                           .takes = kServer | kMap | kJson | kRevision | kLimit | kFormat,
                           .run = RunWords});
}

}  // namespace dsg::cli
