// SPDX-License-Identifier: Apache-2.0
#include "query/engine/edges.h"

#include <optional>
#include <string>

#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

std::string EncodePosition(const EdgeKey& key) {
  std::string position;
  AppendWord(key.source.value, &position);
  AppendWord(key.target.value, &position);
  return position + key.relation;
}

absl::StatusOr<EdgeKey> DecodePosition(std::string_view position) {
  EdgeKey key;
  if (!TakeWord(&position, &key.source.value) || !TakeWord(&position, &key.target.value)) {
    return PageTokenError();
  }
  key.relation = std::string(position);
  return key;
}

absl::StatusOr<EdgeFilter> EdgeFilterFromProto(const v1::ListEdgesRequest& in,
                                               const Snapshot& snapshot) {
  EdgeFilter filter;
  if (!in.source().empty()) {
    DSG_ASSIGN_OR_RETURN(filter.source, snapshot.ResolveNode(in.source()));
  }
  if (!in.target().empty()) {
    DSG_ASSIGN_OR_RETURN(filter.target, snapshot.ResolveNode(in.target()));
  }
  filter.relation = in.relation();
  if (in.has_at_ns()) filter.at_ns = in.at_ns();
  return filter;
}

}  // namespace

EdgeFilter ChildrenOf(NodeId parent) {
  EdgeFilter filter;
  filter.source = parent;
  filter.relation = relations::kContains;
  return filter;
}

absl::Status ListEdges(Engine* engine, const CallContext& call, const v1::ListEdgesRequest& request,
                       v1::ListEdgesResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListEdges", request));
  const Snapshot& snapshot = page.view.snapshot();
  DSG_ASSIGN_OR_RETURN(const EdgeFilter filter, EdgeFilterFromProto(request, snapshot));
  std::optional<EdgeKey> after;
  if (!page.is_first()) {
    DSG_ASSIGN_OR_RETURN(after, DecodePosition(page.position));
  }
  EdgeKey last;
  size_t bytes = 0;
  const auto take = [&](const Edge& edge) {
    if (reply->edges_size() == page.size || bytes > kPageBytesSoftMax) {
      reply->set_next_page_token(page.NextToken(EncodePosition(last)));
      return false;
    }
    v1::Edge* out = reply->add_edges();
    ToProto(edge, out);
    bytes += out->ByteSizeLong();
    last = edge.key();
    return true;
  };
  page.view.FillHeader(reply->mutable_header());
  return snapshot.ScanEdges(filter, after, call.stop(), take);
}

}  // namespace dsg::query
