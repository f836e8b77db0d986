// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/pattern.h"

#include "query/engine/search/compiled_pattern.h"

namespace dsg::query {

bool NodePattern::operator==(const NodePattern& other) const {
  return kind == other.kind && layer == other.layer && class_name == other.class_name &&
         name == other.name && color == other.color && id == other.id &&
         attributes == other.attributes && relations == other.relations && word == other.word &&
         word_is_quoted == other.word_is_quoted;
}

const NodePattern& Pattern::source() const { return compiled_->source; }

}  // namespace dsg::query
