// SPDX-License-Identifier: Apache-2.0
// The verbs about revisions that are kept, dropped or restored: tag, compact, revert.
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/json.h"
#include "query/cli/list_writer.h"
#include "query/cli/lookups.h"
#include "query/cli/progress.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"
#include "schema/base/time.h"

namespace dsg::cli {
namespace {

struct TagVerb {
  /// The tag to set, at --revision.
  std::string name;
  std::optional<std::string> note;
  std::string removed;
  bool list = false;
};

struct CompactVerb {
  RevisionOption keep_from;
};

struct RevertVerb {
  RevisionOption to;
  bool dry_run = false;
};

std::string RenderTag(const v1::Tag& tag) {
  return absl::StrCat("tag ", tag.name(), " is revision ", tag.revision(), "\n");
}

std::string RenderCompact(const v1::CompactResponse& reply) {
  return absl::StrCat(
      "dropped ", Counted(reply.revision_count(), "revision"), " and ",
      Counted(reply.row_count(), "row"), "; readable are revision ", reply.oldest_revision(),
      " and later, and those with tags; ", BytesText(reply.file_bytes_before()), " before, ",
      BytesText(reply.file_bytes_after()), " now",
      reply.shrunk() ? "" : "; a reader keeps the file from shrinking for now", "\n");
}

std::string RenderRevert(const v1::RevertResponse& reply, const std::string& to, bool is_dry_run) {
  const std::string changes =
      absl::StrCat("restored ", AmountText(reply.added()), "; gone ", AmountText(reply.removed()));
  if (is_dry_run) return absl::StrCat("would go back to ", to, ": ", changes, "\n");
  if (reply.revision() == 0) {
    return absl::StrCat("the map already has the content of ", to, "; nothing written\n");
  }
  return absl::StrCat("went back to ", to, " as revision ", reply.revision(), ": ", changes, "\n");
}

absl::Status ListTags(Session* session, std::ostream& out) {
  v1::ListTagsRequest request;
  request.set_map(session->map().name);
  v1::ListTagsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListTags(session->NewCall(), request, &reply));
  const std::vector<ListColumn> columns = {
      {"tag"}, {"revision", CellType::kCount}, {"set"}, {"note"}};
  ListWriter list(session->common(), session->times(), "tags", columns, &out);
  if (list.is_table() && reply.tags().empty()) {
    out << "no tags\n";
    return absl::OkStatus();
  }
  DSG_RETURN_IF_ERROR(list.Add(reply, reply.tags(), [](const v1::Tag& tag) {
    return Row{tag.name(), tag.revision(), FormatRfc3339(tag.created_ns()), tag.note()};
  }));
  return list.End("");
}

absl::Status RemoveTag(Session* session, const std::string& name, std::ostream& out) {
  v1::RemoveTagRequest request;
  request.set_map(session->map().name);
  request.set_name(name);
  v1::RemoveTagResponse reply;
  DSG_RETURN_IF_ERROR(session->api().RemoveTag(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << "tag " << name << " is removed\n";
  return absl::OkStatus();
}

absl::Status RunTag(Session* session, const TagVerb& verb, std::ostream& out) {
  if (!verb.removed.empty()) return RemoveTag(session, verb.removed, out);
  if (verb.name.empty()) return ListTags(session, out);
  v1::SetTagRequest request;
  request.set_map(session->map().name);
  request.set_name(verb.name);
  if (verb.note.has_value()) request.set_note(*verb.note);
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> revision,
                       NumberOf(session->common().at, session));
  if (revision.has_value()) request.set_revision(*revision);
  v1::SetTagResponse reply;
  DSG_RETURN_IF_ERROR(session->api().SetTag(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << RenderTag(reply.tag());
  return absl::OkStatus();
}

absl::Status RunCompact(Session* session, const CompactVerb& verb, std::ostream& out) {
  v1::CompactRequest request;
  request.set_map(session->map().name);
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> keep_from, NumberOf(verb.keep_from, session));
  if (keep_from.has_value()) request.set_keep_from_revision(*keep_from);
  v1::CompactResponse last;
  DSG_RETURN_IF_ERROR(ReadLong(session, absl::StrCat("compact ", session->map().name),
                               &query::Api::Compact, request,
                               [&](const v1::CompactResponse& message) { last = message; }));
  if (session->common().json) return WriteJson(last, out);
  out << RenderCompact(last);
  return absl::OkStatus();
}

absl::Status RunRevert(Session* session, const RevertVerb& verb, std::ostream& out) {
  v1::RevertRequest request;
  request.set_map(session->map().name);
  request.set_author("dsg revert");
  request.set_dry_run(verb.dry_run);
  if (verb.to.tag.empty()) {
    request.set_revision(verb.to.number.value_or(0));
  } else {
    request.set_tag(verb.to.tag);
  }
  v1::RevertResponse last;
  DSG_RETURN_IF_ERROR(ReadLong(session, absl::StrCat("revert ", session->map().name),
                               &query::Api::Revert, request,
                               [&](const v1::RevertResponse& message) { last = message; }));
  if (session->common().json) return WriteJson(last, out);
  const std::string to =
      verb.to.tag.empty() ? absl::StrCat("revision ", request.revision()) : "tag " + verb.to.tag;
  out << RenderRevert(last, to, verb.dry_run);
  return absl::OkStatus();
}

void AddTag(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<TagVerb>({.name = "tag",
                             .what = "Name a revision, which then stays readable; or list the tags",
                             .example = "before-moving --note \"desks as built\"",
                             .takes = kServer | kMap | kJson | kRevision | kFormat,
                             .run = RunTag});
  CLI::Option* name =
      app->add_option("NAME", verb->name, "Name of the tag; an existing tag is moved");
  app->add_option("--note", verb->note, "A note to store with the tag")->needs(name);
  CLI::Option* list = app->add_flag("--list", verb->list, "List the tags; default without NAME");
  CLI::Option* remove = app->add_option("--remove", verb->removed, "Remove this tag");
  list->excludes(name)->excludes(remove);
  remove->excludes(name);
  app->get_option("--format")->excludes(name)->excludes(remove);
}

void AddCompact(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<CompactVerb>({.name = "compact",
                                 .what = "Drop old revisions without a tag, and free their bytes",
                                 .example = "--keep-from before-moving",
                                 .takes = kServer | kMap | kJson,
                                 .run = RunCompact});
  AddRevision(app, "--keep-from", "The oldest revision to keep; default the newest",
              &verb->keep_from);
}

void AddRevert(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<RevertVerb>(
      {.name = "revert",
       .what = "Restore the content of an older revision, as new revisions",
       .example = "before-moving --dry-run",
       .takes = kServer | kMap | kJson,
       .run = RunRevert});
  AddRevision(app, "TO", "Revision or tag to go back to", &verb->to)->required();
  app->add_flag("--dry-run", verb->dry_run, "Only report what would change");
}

}  // namespace

void AddKeepVerbs(Grammar* grammar) {
  AddTag(grammar);
  AddCompact(grammar);
  AddRevert(grammar);
}

}  // namespace dsg::cli
