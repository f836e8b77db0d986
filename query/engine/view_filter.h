// SPDX-License-Identifier: Apache-2.0
// A NodeFilter in the symbols of a view. Refuses to differ from NodeFilter::Matches.
#pragma once

#include <optional>

#include "query/view/graph_view.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

class ViewFilter {
 public:
  /// `graph` must outlive this.
  ViewFilter(const NodeFilter& filter, const GraphView& graph);

  /// Also whether it is a child of the filter's parent.
  bool Matches(const ViewNode& node) const;
  /// False if no node can match.
  bool CanMatch() const { return can_match_; }
  SpaceFilter space() const { return {filter_.layer, class_name_}; }

 private:
  bool IsChild(NodeId node) const;

  NodeFilter filter_;
  const GraphView& graph_;
  bool can_match_ = true;
  std::optional<Symbol> kind_;
  std::optional<Symbol> class_name_;
  std::optional<Symbol> name_;
};

}  // namespace dsg::query
