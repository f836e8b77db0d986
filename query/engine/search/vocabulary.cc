// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/vocabulary.h"

#include <algorithm>
#include <set>
#include <unordered_map>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "query/engine/search/words.h"
#include "schema/base/spelling.h"
#include "schema/base/status.h"
#include "schema/model/known_names.h"

namespace dsg::query {
namespace {

constexpr int kNodesPerStop = 512;

bool EndsWith(std::string_view text, std::string_view end) {
  return text.size() > end.size() && text.substr(text.size() - end.size()) == end;
}

}  // namespace

std::vector<std::string> SingularsOf(std::string_view word) {
  std::vector<std::string> singulars;
  const std::string folded = FoldCase(word);
  const auto add = [&](size_t dropped, const char* end) {
    singulars.push_back(std::string(word.substr(0, word.size() - dropped)) + end);
  };
  if (EndsWith(folded, "s")) add(1, "");
  if (EndsWith(folded, "es")) add(2, "");
  if (EndsWith(folded, "ies")) add(3, "y");
  if (EndsWith(folded, "ves")) {
    add(3, "f");
    add(3, "fe");
  }
  return singulars;
}

std::string Vocabulary::ModelKind(std::string_view word) {
  for (const kinds::Kind& kind : kinds::kAll) {
    if (EqualsIgnoringCase(kind.name, word)) return std::string(kind.name);
  }
  return "";
}

const Layer* Vocabulary::FindLayer(std::string_view word) const {
  for (const Layer& layer : view_.layers()) {
    if (EqualsIgnoringCase(layer.name, word)) return &layer;
  }
  return nullptr;
}

std::vector<ClassRange> Vocabulary::FindClass(std::string_view name) const {
  std::vector<ClassRange> ranges;
  for (const Layer& layer : view_.layers()) {
    for (const auto& [symbol, count] : view_.ClassesOf(layer.id)) {
      if (symbol == 0 || !EqualsIgnoringCase(view_.symbols().Text(symbol), name)) continue;
      ranges.push_back({layer.id, symbol, count});
    }
  }
  std::sort(ranges.begin(), ranges.end(), [](const ClassRange& a, const ClassRange& b) {
    return std::pair(a.layer, a.class_name) < std::pair(b.layer, b.class_name);
  });
  return ranges;
}

absl::StatusOr<std::vector<std::string>> Vocabulary::Labels() const {
  std::vector<std::string> names;
  if (snapshot_ == nullptr) return names;
  DSG_ASSIGN_OR_RETURN(const std::vector<SemanticLabel> labels, snapshot_->Labels());
  for (const SemanticLabel& label : labels) names.push_back(label.name);
  return names;
}

absl::StatusOr<bool> Vocabulary::HasLabel(std::string_view name) const {
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> labels, Labels());
  return std::any_of(labels.begin(), labels.end(),
                     [name](const std::string& label) { return EqualsIgnoringCase(label, name); });
}

absl::StatusOr<std::vector<Symbol>> Vocabulary::RelationSymbols(
    std::optional<Symbol> wanted) const {
  std::set<Symbol> found;
  bool is_found = false;
  absl::Status status;
  int64_t node_count = 0;
  view_.ForEachNode(NodeId(), [&](const ViewNode& node) {
    if (++node_count % kNodesPerStop == 0 && stop_) status = stop_();
    view_.ForEachEdgeFrom(node.id, [&](const ViewEdge& edge) {
      found.insert(edge.relation);
      is_found = wanted.has_value() && edge.relation == *wanted;
      return !is_found;
    });
    return status.ok() && !is_found;
  });
  DSG_RETURN_IF_ERROR(status);
  if (wanted.has_value()) return is_found ? std::vector<Symbol>{*wanted} : std::vector<Symbol>();
  return std::vector<Symbol>(found.begin(), found.end());
}

absl::StatusOr<std::string> Vocabulary::FindRelation(std::string_view word) const {
  const std::string exact(word);
  const std::string capitals = absl::AsciiStrToUpper(exact);
  for (const std::string& spelling : {exact, capitals}) {
    if (IsModelRelation(spelling)) return spelling;
    const std::optional<Symbol> symbol = view_.symbols().Find(spelling);
    if (!symbol.has_value()) continue;
    // Another revision of the map may have given the symbol.
    DSG_ASSIGN_OR_RETURN(const std::vector<Symbol> found, RelationSymbols(symbol));
    if (!found.empty()) return spelling;
  }
  return std::string();
}

absl::StatusOr<bool> Vocabulary::HasNode(const std::function<bool(const ViewNode&)>& is_it) const {
  bool is_found = false;
  absl::Status status;
  int64_t node_count = 0;
  view_.ForEachNode(NodeId(), [&](const ViewNode& node) {
    if (++node_count % kNodesPerStop == 0 && stop_) status = stop_();
    is_found = is_it(node);
    return status.ok() && !is_found;
  });
  DSG_RETURN_IF_ERROR(status);
  return is_found;
}

absl::StatusOr<bool> Vocabulary::HasKind(std::string_view kind) const {
  if (!ModelKind(kind).empty()) return true;
  const std::optional<Symbol> symbol = view_.symbols().Find(kind);
  if (!symbol.has_value()) return false;
  return HasNode([&](const ViewNode& node) { return node.kind == *symbol; });
}

absl::StatusOr<bool> Vocabulary::HasName(std::string_view name) const {
  if (name.empty()) return false;
  if (name.find('*') == std::string_view::npos) {
    return !view_.NodesNamedIgnoringCase(name).empty();
  }
  const NameMatcher matcher(name);
  std::unordered_map<Symbol, bool> known;
  return HasNode([&](const ViewNode& node) {
    if (node.name == 0) return false;
    const auto [it, is_new] = known.try_emplace(node.name, false);
    if (is_new) it->second = matcher.Matches(view_.symbols().Text(node.name));
    return it->second;
  });
}

absl::StatusOr<std::optional<Symbol>> Vocabulary::FindAttribute(std::string_view name) const {
  const std::optional<Symbol> symbol = view_.symbols().Find(name);
  if (!symbol.has_value()) return symbol;
  DSG_ASSIGN_OR_RETURN(const bool is_known, HasNode([&](const ViewNode& node) {
                         return std::ranges::any_of(node.attributes(), [&](const auto& one) {
                           return one.name == *symbol;
                         });
                       }));
  return is_known ? symbol : std::nullopt;
}

std::vector<std::string> Vocabulary::ClassNames() const {
  std::vector<std::string> names;
  for (const Layer& layer : view_.layers()) {
    for (const auto& [symbol, count] : view_.ClassesOf(layer.id)) {
      if (symbol != 0) names.push_back(view_.symbols().Text(symbol));
    }
  }
  return names;
}

absl::StatusOr<std::vector<std::string>> Vocabulary::NodeNames(std::optional<LayerId> layer) const {
  std::set<Symbol> symbols;
  const auto note_name = [&](const ViewNode& node) {
    if (node.name != 0 && (!layer.has_value() || node.layer == *layer)) symbols.insert(node.name);
    return false;
  };
  DSG_RETURN_IF_ERROR(HasNode(note_name).status());
  std::vector<std::string> names;
  for (const Symbol symbol : symbols) names.push_back(view_.symbols().Text(symbol));
  return names;
}

absl::Status Vocabulary::ClassUnknown(std::string_view word, bool is_noun) const {
  std::vector<std::string> known = ClassNames();
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> labels, Labels());
  known.insert(known.end(), labels.begin(), labels.end());
  if (is_noun) {
    for (const kinds::Kind& kind : kinds::kAll) known.emplace_back(kind.name);
    for (const Layer& layer : view_.layers()) known.push_back(layer.name);
    DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, NodeNames(std::nullopt));
    // Of the thousands that are not near none is worth a line.
    for (std::string& name : NearInSpelling(word, names)) known.push_back(std::move(name));
  }
  const std::string text(word);
  return MakeError(
      Reason::kClassUnknown,
      absl::StrCat(is_noun ? "no kind, class or node of the map is called \""
                           : "no node of the map is of class \"",
                   text, "\" at revision ", view_.revision(), SpellingHint(word, std::move(known))),
      {{"class", text}});
}

absl::Status Vocabulary::LayerUnknown(std::string_view word) const {
  std::vector<std::string> known;
  for (const Layer& layer : view_.layers()) known.push_back(layer.name);
  const std::string text(word);
  return MakeError(Reason::kLayerUnknown,
                   absl::StrCat("the map has no layer \"", text, "\" at revision ",
                                view_.revision(), SpellingHint(word, std::move(known))),
                   {{"layer", text}});
}

absl::Status Vocabulary::RelationUnknown(std::string_view word) const {
  std::vector<std::string> known = ModelRelations();
  DSG_ASSIGN_OR_RETURN(const std::vector<Symbol> symbols, RelationSymbols(std::nullopt));
  for (const Symbol symbol : symbols) {
    if (!IsModelRelation(view_.symbols().Text(symbol))) {
      known.push_back(view_.symbols().Text(symbol));
    }
  }
  const std::string text(word);
  return MakeError(Reason::kRelationUnknown,
                   absl::StrCat("no edge of the map is called \"", text, "\" at revision ",
                                view_.revision(), SpellingHint(word, std::move(known))),
                   {{"relation", text}});
}

absl::Status Vocabulary::KindUnknown(std::string_view word) const {
  std::vector<std::string> known;
  for (const kinds::Kind& kind : kinds::kAll) known.emplace_back(kind.name);
  const std::string text(word);
  return MakeError(Reason::kClassUnknown,
                   absl::StrCat("no node of the map is of kind \"", text, "\" at revision ",
                                view_.revision(), SpellingHint(word, std::move(known))),
                   {{"kind", text}});
}

absl::Status Vocabulary::NameUnknown(std::string_view name, std::optional<LayerId> layer) const {
  DSG_ASSIGN_OR_RETURN(std::vector<std::string> known, NodeNames(layer));
  const std::string text(name);
  return MakeError(Reason::kNodeUnknown,
                   absl::StrCat("no node of the map is called \"", text, "\" at revision ",
                                view_.revision(), SpellingHint(name, std::move(known))),
                   {{"node", text}});
}

absl::Status Vocabulary::AttributeUnknown(std::string_view name) const {
  // What a slip of the fingers in `class = cup` leaves is read as an attribute.
  std::set<std::string> known = {"kind", "layer", "class", "name", "color", "id"};
  const auto note_names = [&](const ViewNode& node) {
    for (const ViewAttribute& one : node.attributes()) {
      known.insert(view_.symbols().Text(one.name));
    }
    return false;
  };
  DSG_RETURN_IF_ERROR(HasNode(note_names).status());
  const std::string text(name);
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("no node of the map has an attribute \"", text, "\" at revision ",
                                view_.revision(), SpellingHint(name, {known.begin(), known.end()})),
                   {{"field", "pattern.attributes.name"}, {"value", text}});
}

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
