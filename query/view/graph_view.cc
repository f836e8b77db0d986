// SPDX-License-Identifier: Apache-2.0
#include "query/view/graph_view.h"

#include <algorithm>

#include "query/view/indexed_view.h"
#include "schema/base/status.h"

namespace dsg::query {

absl::StatusOr<std::shared_ptr<const GraphView>> GraphView::Load(
    const Snapshot& snapshot, std::shared_ptr<SymbolTable> symbols, const StopCheck& stop) {
  return IndexedView::Load(snapshot, std::move(symbols), stop);
}

absl::StatusOr<std::shared_ptr<const GraphView>> GraphView::Derive(
    std::shared_ptr<const GraphView> from, MapReader* map, const Snapshot& snapshot,
    const StopCheck& stop) {
  // There is no other kind of view.
  const auto& indexed = static_cast<const IndexedView&>(*from);
  const Revision older = std::min(from->revision(), snapshot.revision());
  const Revision newer = std::max(from->revision(), snapshot.revision());
  DSG_ASSIGN_OR_RETURN(const Touched touched, map->TouchedBetween(older, newer, stop));
  return IndexedView::Derive(indexed, touched, snapshot, stop);
}

}  // namespace dsg::query
