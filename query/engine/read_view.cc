// SPDX-License-Identifier: Apache-2.0
#include "query/engine/read_view.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/store/tags.h"

namespace dsg::query {

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

}  // namespace dsg::query
