// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/relation_set.h"

#include <algorithm>

#include "query/engine/search/vocabulary.h"
#include "schema/base/status.h"

namespace dsg::query {

absl::StatusOr<RelationSet> RelationSet::Resolve(const std::vector<std::string>& names,
                                                 const GraphView& view, const StopCheck& stop) {
  RelationSet set;
  set.has_all_ = names.empty();
  const Vocabulary vocabulary(view, nullptr, stop);
  for (const std::string& name : names) {
    DSG_ASSIGN_OR_RETURN(const std::string known, vocabulary.FindRelation(name));
    // No edge is called INSIDE.
    if (known.empty() || known == kInsideRelation) return vocabulary.RelationUnknown(name);
    const std::optional<Symbol> symbol = view.symbols().Find(known);
    if (symbol.has_value()) set.symbols_.push_back(*symbol);
  }
  std::sort(set.symbols_.begin(), set.symbols_.end());
  return set;
}

bool RelationSet::Has(Symbol relation) const {
  return has_all_ || std::binary_search(symbols_.begin(), symbols_.end(), relation);
}

}  // namespace dsg::query
