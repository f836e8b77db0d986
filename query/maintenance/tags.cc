// SPDX-License-Identifier: Apache-2.0
// Names for revisions: set, removed, listed.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

void FillTag(const Tag& tag, v1::Tag* out) {
  out->set_name(tag.name);
  out->set_revision(tag.revision);
  out->set_created_ns(tag.created_ns);
  out->set_note(tag.note);
}

absl::StatusOr<std::string> NoteOf(MapTable* maps, const std::string& map,
                                   const std::string& name) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, maps->Reader(map));
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, reader->Tags());
  for (const Tag& tag : tags) {
    if (tag.name == name) return tag.note;
  }
  return std::string();
}

}  // namespace

absl::Status SetTag(Engine* engine, const CallContext& call, const v1::SetTagRequest& request,
                    v1::SetTagResponse* reply) {
  if (request.revision() < 0) {
    return FieldError("revision", absl::StrCat(request.revision()),
                      "give a revision, or none for the newest");
  }
  return engine->maps.WithWriter(
      request.map(), call.stop(), [&](MapWriter& writer) -> absl::Status {
        Revision revision = request.revision();
        if (!request.has_revision()) {
          // Read under the writer's lock, so that nothing is newer when the tag is set.
          DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map,
                               engine->maps.Reader(request.map()));
          DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
          revision = head.revision;
        }
        std::string note = request.note();
        if (!request.has_note()) {
          DSG_ASSIGN_OR_RETURN(note, NoteOf(&engine->maps, request.map(), request.name()));
        }
        DSG_ASSIGN_OR_RETURN(const Tag tag, writer.SetTag(request.name(), revision, note));
        FillTag(tag, reply->mutable_tag());
        return absl::OkStatus();
      });
}

absl::Status RemoveTag(Engine* engine, const CallContext& call, const v1::RemoveTagRequest& request,
                       v1::RemoveTagResponse*) {
  return engine->maps.WithWriter(request.map(), call.stop(), [&](MapWriter& writer) {
    return writer.RemoveTag(request.name());
  });
}

absl::Status ListTags(Engine* engine, const CallContext&, const v1::ListTagsRequest& request,
                      v1::ListTagsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, map->Tags());
  for (const Tag& tag : tags) FillTag(tag, reply->add_tags());
  return absl::OkStatus();
}

}  // namespace dsg::query
