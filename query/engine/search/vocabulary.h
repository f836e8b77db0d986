// SPDX-License-Identifier: Apache-2.0
// The words that one revision of a map knows: kinds, layers, classes, relations, names. Answers
// only from the view and its snapshot, so that the same revision always knows the same words.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/search/pattern.h"
#include "query/view/graph_view.h"

namespace dsg::query {

/// Threads: one caller at a time. Lives as long as a question.
class Vocabulary {
 public:
  /// `snapshot` may be null; `view` and `stop` must outlive this.
  Vocabulary(const GraphView& view, const Snapshot* snapshot, const StopCheck& stop)
      : view_(view), snapshot_(snapshot), stop_(stop) {}

  /// The kinds of the model, in their one spelling; empty if it is none.
  static std::string ModelKind(std::string_view word);
  /// Case ignored; null if there is none.
  const Layer* FindLayer(std::string_view word) const;
  /// Where nodes of a class are, whatever its letter case. Ascending layer, then symbol.
  std::vector<ClassRange> FindClass(std::string_view name) const;
  /// A label that no node has any more, or yet.
  absl::StatusOr<bool> HasLabel(std::string_view name) const;
  /// The relation in the map's spelling: of the model in any letter case, of the map exactly or in
  /// capitals; empty if there is none.
  /// Cost: a walk over all edges for one that the map does not have.
  absl::StatusOr<std::string> FindRelation(std::string_view word) const;
  /// Some node is of this kind; the model's kinds always are.
  absl::StatusOr<bool> HasKind(std::string_view kind) const;
  /// Some node has this name, case ignored.
  absl::StatusOr<bool> HasName(std::string_view name) const;
  /// nullopt if no node has this attribute.
  /// Cost: a walk over the nodes up to the first that has it.
  absl::StatusOr<std::optional<Symbol>> FindAttribute(std::string_view name) const;

  absl::Status ClassUnknown(std::string_view word, bool is_noun) const;
  absl::Status LayerUnknown(std::string_view word) const;
  absl::Status RelationUnknown(std::string_view word) const;
  absl::Status KindUnknown(std::string_view word) const;
  /// `layer`: where the name was looked for; nullopt = everywhere.
  absl::Status NameUnknown(std::string_view name, std::optional<LayerId> layer) const;
  absl::Status AttributeUnknown(std::string_view name) const;

 private:
  absl::StatusOr<std::vector<std::string>> Labels() const;
  std::vector<std::string> ClassNames() const;
  absl::StatusOr<std::vector<std::string>> NodeNames(std::optional<LayerId> layer) const;
  /// Symbols of all relations, or only whether `wanted` is one of them.
  absl::StatusOr<std::vector<Symbol>> RelationSymbols(std::optional<Symbol> wanted) const;
  absl::StatusOr<bool> HasNode(const std::function<bool(const ViewNode&)>& is_it) const;

  const GraphView& view_;
  const Snapshot* snapshot_;
  const StopCheck& stop_;
};

/// Singular forms that an English plural may have: "cups": "cup"; "benches": "benche", "bench".
std::vector<std::string> SingularsOf(std::string_view word);

/// The relations that a question follows, as symbols of a view.
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
