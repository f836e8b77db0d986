// SPDX-License-Identifier: Apache-2.0
// Relations that a question follows, as symbols of a view. Refuses names that no edge has.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/view/graph_view.h"

namespace dsg::query {

class RelationSet {
 public:
  /// No names: all relations.
  /// Errors: RELATION_UNKNOWN with those near in spelling; what `stop` returned.
  static absl::StatusOr<RelationSet> Resolve(const std::vector<std::string>& names,
                                             const GraphView& view, const StopCheck& stop);

  bool Has(Symbol relation) const;

 private:
  bool has_all_ = true;
  // Ascending.
  std::vector<Symbol> symbols_;
};

}  // namespace dsg::query
