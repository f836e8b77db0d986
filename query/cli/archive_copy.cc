// SPDX-License-Identifier: Apache-2.0
#include "query/cli/archive_copy.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "schema/archive/archive_format.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

// A map without revisions has no record of one.
absl::StatusOr<Sha256> NewestDigest(Session* session, const std::string& map) {
  v1::ListRevisionsRequest request;
  request.set_map(map);
  request.set_page_size(1);
  v1::ListRevisionsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListRevisions(session->NewCall(), request, &reply));
  Sha256 digest{};
  if (reply.revisions().empty()) return digest;
  const std::string& bytes = reply.revisions(0).digest();
  if (bytes.size() == digest.size()) std::copy(bytes.begin(), bytes.end(), digest.begin());
  return digest;
}

absl::StatusOr<std::vector<Tag>> TagsOf(Session* session, const std::string& map) {
  v1::ListTagsRequest request;
  request.set_map(map);
  v1::ListTagsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListTags(session->NewCall(), request, &reply));
  std::vector<Tag> tags;
  for (const v1::Tag& tag : reply.tags()) {
    tags.push_back({tag.name(), tag.revision(), tag.created_ns(), tag.note()});
  }
  return tags;
}

}  // namespace

absl::StatusOr<Sha256> StateOfMap(Session* session, const std::string& map) {
  v1::GetMapStatsRequest request;
  request.set_map(map);
  v1::GetMapStatsResponse stats;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &stats));
  DSG_ASSIGN_OR_RETURN(const MapSpec spec, FromProto(stats.map()));
  DSG_ASSIGN_OR_RETURN(const Sha256 digest, NewestDigest(session, map));
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, TagsOf(session, map));
  return StateDigest(spec, stats.head_revision(), digest, stats.header().oldest_revision(), tags);
}

absl::Status CopyArchive(Session* session, const std::string& map, const query::CallContext& call,
                         const std::function<absl::Status(std::string_view)>& write,
                         const dsg::Progress& progress) {
  v1::ReadArchiveRequest request;
  request.set_map(map);
  absl::Status written;
  DSG_RETURN_IF_ERROR(query::ReadStream(call, session->api().ReadArchive(call, request),
                                        [&](const v1::ReadArchiveResponse& message) {
                                          written = write(message.content());
                                          progress(message.progress());
                                          return written.ok();
                                        }));
  return written;
}

}  // namespace dsg::cli
