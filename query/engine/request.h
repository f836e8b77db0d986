// SPDX-License-Identifier: Apache-2.0
// What requests have in common: checks of their fields, the revision that they read, and pages of
// lists. A field out of its documented range is an INVALID_ARGUMENT that names field and value.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/statusor.h"
#include "query/engine/maps.h"
#include "query/view/graph_view.h"
#include "schema/base/status.h"
#include "schema/base/time.h"
#include "schema/model/ids.h"
#include "schema/store/snapshot.h"

namespace dsg::v1 {
class NodeFilter;
class Vector3;
}  // namespace dsg::v1

namespace dsg::v1 {
class ReadAt;
class ResponseHeader;
}  // namespace dsg::v1

namespace google::protobuf {
class MessageLite;
}  // namespace google::protobuf

namespace dsg::query {

/// A list's page holds this many entries when the caller does not say.
inline constexpr int kPageSizeDefault = 100;
/// Larger pages, and larger k, are not given.
inline constexpr int kPageSizeMax = 1000;
/// Agent and instant pairs in one batch.
inline constexpr int kBatchSizeMax = 10'000;
/// A page is cut once its encoded entries exceed this, so that an answer stays well below the
/// 4 MiB that a message may have.
inline constexpr size_t kPageBytesSoftMax = size_t{1} << 20;
/// An answer that cannot be cut is refused beyond this.
inline constexpr size_t kReplyBytesMax = size_t{3} << 20;

/// INVALID_ARGUMENT/FIELD_INVALID with `field` and `value` in the metadata.
absl::Status FieldError(std::string_view field, std::string_view value, std::string_view rule);

/// 0 becomes the default, more than the cap becomes the cap. Errors: FIELD_INVALID if negative.
absl::StatusOr<int> CheckPageSize(int32_t page_size);

/// The instant that a request is about. Left out, proto3 would read it as 0, which is an instant
/// too. Errors: FIELD_INVALID if it is left out.
template <typename Request>
absl::StatusOr<TimeNs> InstantOf(const Request& request) {
  if (request.has_at_ns()) return request.at_ns();
  return FieldError("at_ns", "", "give the world time in nanoseconds");
}

/// Errors: TIME_RANGE_INVERTED unless from_ns < to_ns.
absl::Status CheckTimeRange(TimeNs from_ns, TimeNs to_ns);

/// Errors: NUMBER_NOT_FINITE naming `field`.
absl::StatusOr<Eigen::Vector3d> PointFromProto(const v1::Vector3& in, std::string_view field);

/// Names of layers and nodes become ids. Errors: LAYER_UNKNOWN, NODE_UNKNOWN, BOX_INVERTED,
/// NUMBER_NOT_FINITE.
absl::StatusOr<NodeFilter> FilterFromProto(const v1::NodeFilter& in, const Snapshot& snapshot,
                                           const StopCheck& stop);

/// A node by id, or by a name that no other node has; `field` is the request's that says it.
/// Errors: NODE_UNKNOWN; FIELD_INVALID for nothing, and for a name that several nodes have.
absl::StatusOr<NodeId> ResolveOne(const Snapshot& snapshot, const std::string& id_or_name,
                                  std::string_view field, const StopCheck& stop);

/// Errors: NOT_FOUND/TAG_UNKNOWN, which lists the tags that there are.
absl::StatusOr<Revision> RevisionOfTag(MapReader* map, const std::string& tag);

/// What a ReadAt resolves to: a snapshot, and the revisions that the header of the reply names.
///
/// Threads: safe from many threads; holds no lock.
class ReadView {
 public:
  /// Errors: MAP_NAME_INVALID; MAP_UNKNOWN; REVISION_IN_FUTURE or REVISION_COMPACTED with `oldest`
  /// and `newest`; TAG_UNKNOWN; FIELD_INVALID for a negative revision.
  static absl::StatusOr<ReadView> Open(MapTable* maps, const std::string& map,
                                       const v1::ReadAt& read_at);

  static absl::StatusOr<ReadView> Newest(MapTable* maps, const std::string& map);

  /// The same of a map that is open, at exactly one revision.
  static absl::StatusOr<ReadView> OpenAt(MapTable* maps, std::shared_ptr<MapReader> map,
                                         Revision revision);

  MapReader& map() const { return *map_; }
  const Snapshot& snapshot() const { return *snapshot_; }
  const std::shared_ptr<const Snapshot>& shared_snapshot() const { return snapshot_; }
  Revision head_revision() const { return head_; }

  /// The graph of this revision in memory, read or derived if nobody has asked for it yet.
  /// Errors: as ViewCache::Get.
  absl::StatusOr<std::shared_ptr<const GraphView>> Graph(const StopCheck& stop) const;

  void FillHeader(v1::ResponseHeader* header) const;

 private:
  static absl::StatusOr<ReadView> Make(MapTable* maps, std::shared_ptr<MapReader> map,
                                       std::shared_ptr<const Snapshot> snapshot, Revision head);

  MapTable* maps_ = nullptr;
  std::shared_ptr<MapReader> map_;
  std::shared_ptr<const Snapshot> snapshot_;
  Revision head_ = 0;
  Revision oldest_ = 0;
};

/// A digest of the method and of every field that shapes its answer. The same in every process.
/// `request` must have page_size and page_token cleared: both may change between pages.
uint64_t QuestionDigest(std::string_view method, const google::protobuf::MessageLite& request);

/// Of the map's incarnation, for a token.
uint64_t DigestOf(const MapReader& map);

/// Where a list goes on: bound to the map and the revision that the first page read, and to the
/// question. A token of another question or map is refused, so that two lists cannot be mixed
/// unnoticed.
struct PageToken {
  uint64_t incarnation = 0;
  Revision revision = 0;
  /// The key of the last entry that was delivered, as bytes that only its question reads.
  std::string position;
};

std::string EncodePageToken(const PageToken& token, uint64_t question);

/// Errors: PAGE_TOKEN_MISMATCH when the text is no token, was damaged, or belongs to another
/// question.
absl::StatusOr<PageToken> DecodePageToken(std::string_view text, uint64_t question);

/// Errors: ABORTED/MAP_REPLACED when the token was given for another map of that name.
absl::Status CheckToken(const PageToken& token, const MapReader& map);

/// PAGE_TOKEN_MISMATCH, for a position that its question cannot read.
absl::Status PageTokenError();

/// Appends 64 bits to a position, so that positions compare as their numbers do when unsigned.
void AppendWord(uint64_t word, std::string* position);
/// Takes them off its front. False if there are fewer than 64 bits.
bool TakeWord(std::string_view* position, uint64_t* word);
/// Keys as positions, and back. False if the text is no position of such a key.
std::string KeyPosition(NodeId id);
std::string KeyPosition(const EdgeKey& key);
std::string KeyPosition(const BlockIndex& index);
bool ReadKey(std::string_view text, NodeId* id);
bool ReadKey(std::string_view text, EdgeKey* key);
bool ReadKey(std::string_view text, BlockIndex* index);

/// One page of a list: what to read, from where on, and how much.
struct Page {
  ReadView view;
  uint64_t question = 0;
  int size = 0;
  /// Empty for the first page.
  std::string position;

  bool is_first() const { return position.empty(); }
  /// The token of the page after the one that ends at `last_position`.
  std::string NextToken(std::string last_position) const {
    return EncodePageToken(
        {DigestOf(view.map()), view.snapshot().revision(), std::move(last_position)}, question);
  }
};

/// Settles page size, token and revision of a list request. A later page reads the revision that
/// the first one read, whatever has been committed since.
/// Errors: as CheckPageSize, DecodePageToken, ReadView::Open; ABORTED/MAP_REPLACED when the map is
/// another one than that of the first page.
/// A request without `read_at` reads the newest revision.
template <typename Request>
absl::StatusOr<Page> OpenPage(MapTable* maps, std::string_view method, const Request& request) {
  Page page;
  DSG_ASSIGN_OR_RETURN(page.size, CheckPageSize(request.page_size()));
  Request question = request;
  question.clear_page_size();
  question.clear_page_token();
  page.question = QuestionDigest(method, question);
  if (request.page_token().empty()) {
    if constexpr (requires { request.read_at(); }) {
      DSG_ASSIGN_OR_RETURN(page.view, ReadView::Open(maps, request.map(), request.read_at()));
    } else {
      DSG_ASSIGN_OR_RETURN(page.view, ReadView::Newest(maps, request.map()));
    }
    return page;
  }
  DSG_ASSIGN_OR_RETURN(PageToken token, DecodePageToken(request.page_token(), page.question));
  DSG_ASSIGN_OR_RETURN(const auto reader, maps->Reader(request.map()));
  DSG_RETURN_IF_ERROR(CheckToken(token, *reader));
  DSG_ASSIGN_OR_RETURN(page.view, ReadView::OpenAt(maps, reader, token.revision));
  page.position = std::move(token.position);
  return page;
}

}  // namespace dsg::query
