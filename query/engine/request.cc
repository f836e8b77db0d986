// SPDX-License-Identifier: Apache-2.0
#include "query/engine/request.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/delta_check.h"
#include "schema/store/tags.h"

namespace dsg::query {

absl::Status FieldError(std::string_view field, std::string_view value, std::string_view rule) {
  const std::string name(field);
  const std::string text(value);
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat(name, " is ", text.empty() ? "empty" : text, "; ", std::string(rule)),
      {{"field", name}, {"value", text}});
}

absl::StatusOr<int> CheckPageSize(int32_t page_size) {
  if (page_size < 0) {
    return FieldError("page_size", absl::StrCat(page_size), "give 1 to 1000, or 0 for 100");
  }
  return page_size == 0 ? kPageSizeDefault : std::min(page_size, kPageSizeMax);
}

absl::Status CheckTimeRange(TimeNs from_ns, TimeNs to_ns) {
  if (from_ns < to_ns) return absl::OkStatus();
  return MakeError(Reason::kTimeRangeInverted,
                   absl::StrCat("from_ns ", from_ns, " is not before to_ns ", to_ns,
                                "; an interval is half-open and holds at least 1 ns"),
                   {{"from_ns", absl::StrCat(from_ns)}, {"to_ns", absl::StrCat(to_ns)}});
}

absl::StatusOr<Eigen::Vector3d> PointFromProto(const v1::Vector3& in, std::string_view field) {
  const Eigen::Vector3d point(in.x(), in.y(), in.z());
  const std::string name(field);
  if (point.allFinite()) {
    if (point.cwiseAbs().maxCoeff() <= kCoordinateMaxM) return point;
    return FieldError(name, absl::StrCat(point.cwiseAbs().maxCoeff(), " m"),
                      "stay within 2000 km of the map's origin, as all nodes do");
  }
  return MakeError(Reason::kNumberNotFinite,
                   absl::StrCat(name, " is (", in.x(), ", ", in.y(), ", ", in.z(),
                                "); give finite metres in the map frame"),
                   {{"field", name}});
}

namespace {

// A node asked for by a name that several share would be an arbitrary one of them.
absl::Status CheckNameIsUnique(const Snapshot& snapshot, const std::string& name,
                               std::string_view field, const StopCheck& stop) {
  NodeFilter filter;
  filter.name = name;
  std::vector<NodeId> found;
  DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
    found.push_back(node.id);
    return found.size() < 2;
  }));
  if (found.size() < 2) return absl::OkStatus();
  return FieldError(field, name,
                    absl::StrCat("several nodes have this name, among them ", ToString(found[0]),
                                 " and ", ToString(found[1]), "; give an id"));
}

}  // namespace

absl::StatusOr<NodeId> ResolveOne(const Snapshot& snapshot, const std::string& id_or_name,
                                  std::string_view field, const StopCheck& stop) {
  if (id_or_name.empty()) return FieldError(field, "", "give a node id such as O42, or a name");
  DSG_ASSIGN_OR_RETURN(const NodeId id, snapshot.ResolveNode(id_or_name));
  const absl::StatusOr<NodeId> parsed = ParseNodeId(id_or_name);
  if (!parsed.ok() || *parsed != id) {
    DSG_RETURN_IF_ERROR(CheckNameIsUnique(snapshot, id_or_name, field, stop));
  }
  return id;
}

absl::StatusOr<NodeFilter> FilterFromProto(const v1::NodeFilter& in, const Snapshot& snapshot,
                                           const StopCheck& stop) {
  NodeFilter filter;
  if (!in.layer().empty()) {
    DSG_ASSIGN_OR_RETURN(const Layer layer, snapshot.FindLayer(in.layer()));
    filter.layer = layer.id;
  }
  if (!in.parent_id().empty()) {
    DSG_ASSIGN_OR_RETURN(filter.parent,
                         ResolveOne(snapshot, in.parent_id(), "filter.parent_id", stop));
  }
  if (in.has_box()) {
    DSG_ASSIGN_OR_RETURN(filter.box_map, BoxFromProto(in.box(), "filter.box"));
  }
  if (in.has_at_ns()) filter.at_ns = in.at_ns();
  filter.kind = in.kind();
  filter.class_name = in.class_name();
  filter.name = in.name();
  return filter;
}

absl::StatusOr<Revision> RevisionOfTag(MapReader* map, const std::string& tag) {
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, map->Tags());
  for (const Tag& one : tags) {
    if (one.name == tag) return one.revision;
  }
  return MakeError(Reason::kTagUnknown,
                   absl::StrCat("map \"", map->spec().name, "\" has no tag \"", tag, "\"; it has ",
                                TagNames(tags)),
                   {{"map", map->spec().name}, {"tag", tag}});
}

namespace {

// The newest revision with a stamp at or before this one. Clocks of writers go back at times, so
// all that is newer has to be looked at.
absl::StatusOr<Revision> RevisionCommittedAt(MapReader* map, int64_t committed_at_ns) {
  Revision before = 0;
  for (;;) {
    DSG_ASSIGN_OR_RETURN(const auto revisions, map->ListRevisions(before, kPageSizeMax));
    for (const RevisionInfo& one : revisions) {
      if (one.committed_ns <= committed_at_ns) return one.revision;
      before = one.revision;
    }
    if (std::ssize(revisions) < kPageSizeMax) break;
  }
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
  return MakeError(Reason::kRevisionCompacted,
                   absl::StrCat("map \"", map->spec().name,
                                "\" knows no revision that was committed "
                                "at or before ",
                                FormatRfc3339(committed_at_ns),
                                "; the oldest that it knows is revision ", before),
                   {{"map", map->spec().name},
                    {"oldest", absl::StrCat(before)},
                    {"newest", absl::StrCat(head.revision)}});
}

}  // namespace

absl::StatusOr<ReadView> ReadView::Make(MapTable* maps, std::shared_ptr<MapReader> map,
                                        std::shared_ptr<const Snapshot> snapshot, Revision head) {
  ReadView view;
  DSG_ASSIGN_OR_RETURN(view.oldest_, map->OldestRevision());
  // A commit between two reads makes the head newer than the snapshot, never older.
  view.head_ = std::max(head, snapshot->revision());
  view.maps_ = maps;
  view.map_ = std::move(map);
  view.snapshot_ = std::move(snapshot);
  return view;
}

absl::StatusOr<ReadView> ReadView::OpenAt(MapTable* maps, std::shared_ptr<MapReader> reader,
                                          Revision revision) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> snapshot, reader->At(revision));
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, reader->Head());
  return Make(maps, std::move(reader), std::move(snapshot), head.revision);
}

absl::StatusOr<ReadView> ReadView::Newest(MapTable* maps, const std::string& map) {
  return Open(maps, map, v1::ReadAt::default_instance());
}

absl::StatusOr<ReadView> ReadView::Open(MapTable* maps, const std::string& map,
                                        const v1::ReadAt& read_at) {
  if (read_at.has_exact_revision() && read_at.exact_revision() < 0) {
    return FieldError("read_at.exact_revision", absl::StrCat(read_at.exact_revision()),
                      "revisions count from 0, the empty map");
  }
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> reader, maps->Reader(map));
  if (read_at.has_exact_revision()) {
    return OpenAt(maps, std::move(reader), read_at.exact_revision());
  }
  if (!read_at.tag().empty()) {
    DSG_ASSIGN_OR_RETURN(const Revision tagged, RevisionOfTag(reader.get(), read_at.tag()));
    return OpenAt(maps, std::move(reader), tagged);
  }
  if (read_at.has_committed_at_ns()) {
    DSG_ASSIGN_OR_RETURN(const Revision revision,
                         RevisionCommittedAt(reader.get(), read_at.committed_at_ns()));
    return OpenAt(maps, std::move(reader), revision);
  }
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> snapshot, reader->Latest());
  // The newest revision is the head, so it need not be asked for again.
  const Revision newest = snapshot->revision();
  DSG_ASSIGN_OR_RETURN(ReadView view, Make(maps, std::move(reader), std::move(snapshot), newest));
  const Revision wanted = read_at.at_least_revision();
  if (wanted < 0) {
    return FieldError("read_at.at_least_revision", absl::StrCat(wanted),
                      "revisions count from 0, the empty map");
  }
  if (view.snapshot().revision() < wanted) {
    return MakeError(
        Reason::kRevisionInFuture,
        absl::StrCat("map ", map, " is at revision ", view.snapshot().revision(),
                     ", older than revision ", wanted, " that was asked for; ask again later"),
        {{"map", map},
         {"oldest", absl::StrCat(view.oldest_)},
         {"newest", absl::StrCat(view.head_)}});
  }
  return view;
}

absl::StatusOr<std::shared_ptr<const GraphView>> ReadView::Graph(const StopCheck& stop) const {
  return maps_->views().Get(map_, snapshot_, stop);
}

void ReadView::FillHeader(v1::ResponseHeader* header) const {
  header->set_read_revision(snapshot_->revision());
  header->set_head_revision(head_);
  header->set_oldest_revision(oldest_);
  header->set_incarnation(map_->incarnation());
}

namespace {

// Stands first in every token; a later layout takes another.
constexpr char kLayout = '2';

// FNV-1a. A token is no secret and guards against mistakes, not against forgery: whoever forges
// one gets a page of a map that the same call could have read anyway.
uint64_t Fnv1a(std::string_view bytes, uint64_t hash = 0xcbf29ce484222325ull) {
  for (const char c : bytes) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  }
  return hash;
}

}  // namespace

uint64_t QuestionDigest(std::string_view method, const google::protobuf::MessageLite& request) {
  return Fnv1a(request.SerializeAsString(), Fnv1a(method));
}

uint64_t DigestOf(const MapReader& map) { return Fnv1a(map.incarnation()); }

void AppendWord(uint64_t word, std::string* position) {
  for (int shift = 56; shift >= 0; shift -= 8) {
    position->push_back(static_cast<char>(word >> shift & 0xff));
  }
}

bool TakeWord(std::string_view* position, uint64_t* word) {
  if (position->size() < 8) return false;
  *word = 0;
  for (int i = 0; i < 8; ++i) {
    *word = *word << 8 | static_cast<unsigned char>((*position)[static_cast<size_t>(i)]);
  }
  position->remove_prefix(8);
  return true;
}

std::string KeyPosition(NodeId id) {
  std::string position;
  AppendWord(id.value, &position);
  return position;
}

std::string KeyPosition(const EdgeKey& key) {
  return KeyPosition(key.source) + KeyPosition(key.target) + key.relation;
}

std::string KeyPosition(const BlockIndex& index) {
  std::string position;
  for (const int64_t axis : {index.x, index.y, index.z}) {
    AppendWord(static_cast<uint64_t>(axis), &position);
  }
  return position;
}

bool ReadKey(std::string_view text, NodeId* id) {
  return TakeWord(&text, &id->value) && text.empty();
}

bool ReadKey(std::string_view text, EdgeKey* key) {
  const bool ok = TakeWord(&text, &key->source.value) && TakeWord(&text, &key->target.value);
  key->relation = std::string(text);
  return ok;
}

bool ReadKey(std::string_view text, BlockIndex* index) {
  for (int32_t* axis : {&index->x, &index->y, &index->z}) {
    uint64_t word = 0;
    if (!TakeWord(&text, &word)) return false;
    *axis = static_cast<int32_t>(word);
  }
  return text.empty();
}

absl::Status PageTokenError() {
  return MakeError(Reason::kPageTokenMismatch,
                   "the page token was not given for this question, or was changed; repeat the "
                   "question that it came from, or begin again without a token",
                   {{"field", "page_token"}});
}

std::string EncodePageToken(const PageToken& token, uint64_t question) {
  std::string body(1, kLayout);
  AppendWord(token.incarnation, &body);
  AppendWord(static_cast<uint64_t>(token.revision), &body);
  body += token.position;
  std::string bytes;
  AppendWord(Fnv1a(body, question), &bytes);
  bytes += body;
  return absl::WebSafeBase64Escape(bytes);
}

absl::StatusOr<PageToken> DecodePageToken(std::string_view text, uint64_t question) {
  std::string bytes;
  if (!absl::WebSafeBase64Unescape(absl::string_view(text.data(), text.size()), &bytes)) {
    return PageTokenError();
  }
  std::string_view rest = bytes;
  uint64_t seal = 0;
  // The seal covers the body and, as its seed, the question.
  if (!TakeWord(&rest, &seal) || seal != Fnv1a(rest, question)) return PageTokenError();
  if (rest.empty() || rest.front() != kLayout) return PageTokenError();
  rest.remove_prefix(1);
  PageToken token;
  uint64_t revision = 0;
  if (!TakeWord(&rest, &token.incarnation) || !TakeWord(&rest, &revision) || rest.empty()) {
    return PageTokenError();
  }
  token.revision = static_cast<Revision>(revision);
  token.position = std::string(rest);
  return token;
}

absl::Status CheckToken(const PageToken& token, const MapReader& map) {
  if (token.incarnation == DigestOf(map)) return absl::OkStatus();
  return MakeError(Reason::kMapReplaced,
                   absl::StrCat("map \"", map.spec().name,
                                "\" was replaced since the page token was given; begin again "
                                "without it"),
                   {{"map", map.spec().name}});
}

}  // namespace dsg::query
