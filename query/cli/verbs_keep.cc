// SPDX-License-Identifier: Apache-2.0
// The verbs about revisions that are kept or dropped: tag, compact, revert.
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/interrupt.h"
#include "query/cli/json.h"
#include "query/cli/progress.h"
#include "query/cli/render_keep.h"
#include "query/cli/tag_names.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

absl::Status ListTags(Session* session, std::ostream& out) {
  v1::ListTagsRequest request;
  request.set_map(session->map().name);
  v1::ListTagsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListTags(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << RenderTags(reply);
  return absl::OkStatus();
}

absl::Status RemoveTag(Session* session, const std::string& name, std::ostream& out) {
  v1::RemoveTagRequest request;
  request.set_map(session->map().name);
  request.set_name(name);
  v1::RemoveTagResponse reply;
  DSG_RETURN_IF_ERROR(session->api().RemoveTag(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << "tag " << name << " is gone\n";
  return absl::OkStatus();
}

}  // namespace

absl::Status RunTag(Session* session, const TagVerb& verb, std::ostream& out) {
  if (!verb.removed.empty()) return RemoveTag(session, verb.removed, out);
  if (verb.name.empty()) return ListTags(session, out);
  const RevisionOption at{session->common().revision, session->common().tag};
  v1::SetTagRequest request;
  request.set_map(session->map().name);
  request.set_name(verb.name);
  if (verb.note.has_value()) request.set_note(*verb.note);
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> revision, NumberOf(at, session));
  if (revision.has_value()) request.set_revision(*revision);
  v1::SetTagResponse reply;
  DSG_RETURN_IF_ERROR(session->api().SetTag(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << RenderTag(reply.tag());
  return absl::OkStatus();
}

absl::Status RunCompact(Session* session, const CompactVerb& verb, std::ostream& out,
                        std::ostream& progress_out) {
  v1::CompactRequest request;
  request.set_map(session->map().name);
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> keep_from, NumberOf(verb.keep_from, session));
  if (keep_from.has_value()) request.set_keep_from_revision(*keep_from);
  Progress progress(absl::StrCat("compact ", session->map().name), &progress_out);
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  v1::CompactResponse last;
  DSG_RETURN_IF_ERROR(query::ReadStream(call, session->api().Compact(call, request),
                                        [&](const v1::CompactResponse& message) {
                                          progress.Update(message.progress());
                                          last = message;
                                          return true;
                                        }));
  if (session->common().json) return WriteJson(last, out);
  out << RenderCompact(last);
  return absl::OkStatus();
}

absl::Status RunRevert(Session* session, const RevertVerb& verb, std::ostream& out,
                       std::ostream& progress_out) {
  v1::RevertRequest request;
  request.set_map(session->map().name);
  request.set_author("dsg revert");
  request.set_dry_run(verb.dry_run);
  if (verb.to.tag.empty()) {
    request.set_revision(verb.to.number.value_or(0));
  } else {
    request.set_tag(verb.to.tag);
  }
  Progress progress(absl::StrCat("revert ", session->map().name), &progress_out);
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  v1::RevertResponse last;
  DSG_RETURN_IF_ERROR(query::ReadStream(call, session->api().Revert(call, request),
                                        [&](const v1::RevertResponse& message) {
                                          progress.Update(message.progress());
                                          last = message;
                                          return true;
                                        }));
  if (session->common().json) return WriteJson(last, out);
  const std::string to =
      verb.to.tag.empty() ? absl::StrCat("revision ", request.revision()) : "tag " + verb.to.tag;
  out << RenderRevert(last, to, verb.dry_run);
  return absl::OkStatus();
}

}  // namespace dsg::cli
