// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/pattern.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/search.pb.h"
#include "query/engine/search/vocabulary.h"
#include "query/engine/search/words.h"
#include "schema/base/spelling.h"
#include "schema/base/status.h"
#include "schema/model/known_names.h"

namespace dsg::query {

bool NodePattern::operator==(const NodePattern& other) const {
  return kind == other.kind && layer == other.layer && class_name == other.class_name &&
         name == other.name && color == other.color && id == other.id &&
         attributes == other.attributes && relations == other.relations &&
         alternatives == other.alternatives && word == other.word &&
         word_is_quoted == other.word_is_quoted;
}

bool IsOnlyAlternatives(const NodePattern& pattern) {
  if (pattern.alternatives.size() != 1 || pattern.alternatives.front().negated) return false;
  NodePattern only;
  only.alternatives = pattern.alternatives;
  return pattern == only;
}

void AddAlternatives(NodePattern operand, bool negated, NodePattern* pattern) {
  Alternatives added{{}, negated};
  if (IsOnlyAlternatives(operand)) {
    added.any_of = std::move(operand.alternatives.front().any_of);
  } else {
    added.any_of.push_back(std::move(operand));
  }
  pattern->alternatives.push_back(std::move(added));
}

const NodePattern& Pattern::source() const { return compiled_->source; }

namespace {

absl::Status PatternFieldError(const std::string& field, const std::string& value,
                               const std::string& rule) {
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("pattern.", field, " is ", value.empty() ? "empty" : value, "; ", rule),
      {{"field", absl::StrCat("pattern.", field)}, {"value", value}});
}

absl::StatusOr<AttributeCondition> ConditionFromProto(const v1::AttributeCondition& in) {
  AttributeCondition out;
  out.name = in.name();
  if (out.name.empty()) return PatternFieldError("attributes.name", "", "name the attribute");
  const int comparison = in.comparison() == 0 ? static_cast<int>(v1::EQUAL) : in.comparison();
  if (!v1::Comparison_IsValid(comparison)) {
    return PatternFieldError("attributes.comparison", absl::StrCat(comparison),
                             "give EQUAL, NOT_EQUAL, LESS, LESS_OR_EQUAL, GREATER, "
                             "GREATER_OR_EQUAL or EXISTS");
  }
  out.comparison = static_cast<Comparison>(comparison);
  if (out.comparison == Comparison::kExists) return out;
  switch (in.value().value_case()) {
    case v1::AttributeValue::kNumber:
      if (!std::isfinite(in.value().number())) {
        return MakeError(Reason::kNumberNotFinite,
                         absl::StrCat("pattern.attributes.value of ", out.name, " is ",
                                      in.value().number(), "; give a finite number"),
                         {{"field", "pattern.attributes.value"}});
      }
      out.value = in.value().number();
      return out;
    case v1::AttributeValue::kText:
      out.value = in.value().text();
      return out;
    case v1::AttributeValue::kFlag:
      if (out.comparison > Comparison::kNotEqual) {
        return PatternFieldError("attributes.comparison", absl::StrCat(comparison),
                                 "flags have no order; give EQUAL or NOT_EQUAL");
      }
      out.value = in.value().flag();
      return out;
    case v1::AttributeValue::VALUE_NOT_SET:
      break;
  }
  return PatternFieldError(
      "attributes.value", "",
      absl::StrCat("give a number, a text or a flag to compare ", out.name, " with, or EXISTS"));
}

// Alternatives count one by one, so that a pattern of nothing else is bounded too.
absl::Status CheckSize(const v1::NodePattern& in, int depth, int* condition_count) {
  if (depth > kPatternDepthMax) {
    return PatternFieldError("relations", absl::StrCat(depth, " levels deep"),
                             absl::StrCat("give at most ", kPatternDepthMax));
  }
  *condition_count += in.attributes_size() + in.relations_size();
  for (const v1::Alternatives& alternatives : in.alternatives()) {
    *condition_count += alternatives.any_of_size();
  }
  if (*condition_count <= kPatternConditionsMax) return absl::OkStatus();
  return PatternFieldError("relations", absl::StrCat(*condition_count, " conditions long"),
                           absl::StrCat("give at most ", kPatternConditionsMax));
}

absl::Status FillFromProto(const v1::NodePattern& in, int depth, int* condition_count,
                           NodePattern* out);

absl::Status AddFromProto(const v1::Alternatives& in, int depth, int* condition_count,
                          NodePattern* out) {
  if (in.any_of().empty()) {
    return PatternFieldError("alternatives.any_of", "", "give at least one pattern");
  }
  NodePattern either;
  Alternatives& alternatives = either.alternatives.emplace_back();
  for (const v1::NodePattern& pattern : in.any_of()) {
    DSG_RETURN_IF_ERROR(
        FillFromProto(pattern, depth + 1, condition_count, &alternatives.any_of.emplace_back()));
  }
  const bool is_one = alternatives.any_of.size() == 1;
  AddAlternatives(is_one ? NodePattern(alternatives.any_of.front()) : std::move(either),
                  in.negated(), out);
  return absl::OkStatus();
}

absl::Status FillFromProto(const v1::NodePattern& in, int depth, int* condition_count,
                           NodePattern* out) {
  DSG_RETURN_IF_ERROR(CheckSize(in, depth, condition_count));
  out->kind = in.kind();
  out->layer = in.layer();
  out->class_name = in.class_name();
  out->name = in.name();
  out->id = in.id();
  if (!in.color().empty()) {
    out->color = CanonicalColor(in.color());
    if (out->color.empty()) {
      return PatternFieldError(
          "color", in.color(),
          absl::StrCat("it is no colour that has a name", SpellingHint(in.color(), ColorNames())));
    }
  }
  for (const v1::AttributeCondition& condition : in.attributes()) {
    DSG_ASSIGN_OR_RETURN(AttributeCondition attribute, ConditionFromProto(condition));
    out->attributes.push_back(std::move(attribute));
  }
  for (const v1::RelationCondition& condition : in.relations()) {
    RelationCondition relation;
    relation.relation = condition.relation();
    if (relation.relation.empty()) {
      return PatternFieldError("relations.relation", "", "name the relation");
    }
    relation.reversed = condition.reversed();
    relation.negated = condition.negated();
    DSG_RETURN_IF_ERROR(
        FillFromProto(condition.other(), depth + 1, condition_count, &relation.other));
    out->relations.push_back(std::move(relation));
  }
  for (const v1::Alternatives& alternatives : in.alternatives()) {
    DSG_RETURN_IF_ERROR(AddFromProto(alternatives, depth, condition_count, out));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<NodePattern> NodePatternFromProto(const v1::NodePattern& in) {
  NodePattern pattern;
  int condition_count = 0;
  DSG_RETURN_IF_ERROR(FillFromProto(in, 0, &condition_count, &pattern));
  return pattern;
}

absl::StatusOr<Pattern> PatternFromProto(const v1::NodePattern& in, const GraphView& view,
                                         const Snapshot* snapshot, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const NodePattern pattern, NodePatternFromProto(in));
  return ResolvePattern(pattern, view, snapshot, stop);
}

namespace {

bool HasInView(const GraphView& view, std::string_view id_text) {
  const absl::StatusOr<NodeId> id = ParseNodeId(id_text);
  return id.ok() && view.FindNode(*id) != nullptr;
}

// What the word of a query means goes into the pattern's fields.
class WordResolver {
 public:
  WordResolver(const GraphView& view, const Vocabulary& vocabulary, NodePattern* pattern)
      : view_(view), vocabulary_(vocabulary), pattern_(pattern) {}

  absl::Status Run() {
    const std::string word = std::exchange(pattern_->word, "");
    const bool is_quoted = std::exchange(pattern_->word_is_quoted, false);
    if (!is_quoted) {
      if (HasInView(view_, word)) return Set("id", word, &pattern_->id);
      DSG_ASSIGN_OR_RETURN(const bool is_kind, TryKindOrLayer(word));
      if (is_kind) return status_;
    }
    DSG_ASSIGN_OR_RETURN(const bool is_class, TryClass(word));
    if (is_class) return status_;
    if (!is_quoted) {
      for (const std::string& singular : SingularsOf(word)) {
        DSG_ASSIGN_OR_RETURN(const bool is_one, TryClass(singular));
        if (is_one) return status_;
      }
    }
    DSG_ASSIGN_OR_RETURN(const bool is_name, vocabulary_.HasName(word));
    if (is_name) return Set("name", word, &pattern_->name);
    if (!is_quoted && (EqualsIgnoringCase(word, "people") || EqualsIgnoringCase(word, "person"))) {
      return Set("kind", kinds::kHuman, &pattern_->kind);
    }
    if (!is_quoted && !CanonicalColor(word).empty()) {
      return Set("color", CanonicalColor(word), &pattern_->color);
    }
    return Unknown(word, is_quoted);
  }

 private:
  absl::StatusOr<bool> TryKindOrLayer(const std::string& word) {
    std::string kind = Vocabulary::ModelKind(word);
    const Layer* layer = vocabulary_.FindLayer(word);
    if (kind.empty() && layer == nullptr) {
      for (const std::string& singular : SingularsOf(word)) {
        if (kind.empty()) kind = Vocabulary::ModelKind(singular);
      }
    }
    if (!kind.empty()) {
      status_ = Set("kind", kind, &pattern_->kind);
    } else if (layer != nullptr) {
      status_ = Set("layer", layer->name, &pattern_->layer);
    }
    return !kind.empty() || layer != nullptr;
  }

  absl::StatusOr<bool> TryClass(const std::string& word) {
    bool is_known = !vocabulary_.FindClass(word).empty();
    if (!is_known) {
      DSG_ASSIGN_OR_RETURN(is_known, vocabulary_.HasLabel(word));
    }
    if (is_known) status_ = Set("class", word, &pattern_->class_name);
    return is_known;
  }

  absl::Status Set(const char* what, const std::string& value, std::string* field) {
    if (!field->empty() && *field != value) {
      return MakeError(Reason::kQueryMalformed,
                       absl::StrCat("\"", value, "\" is a ", what, ", but the query also says ",
                                    what, " = \"", *field, "\"; say it once"),
                       {{"position", absl::StrCat(pattern_->word_position)},
                        {"expected", absl::StrCat(what, " only once")}});
    }
    *field = value;
    return absl::OkStatus();
  }

  absl::Status Unknown(const std::string& word, bool is_quoted) const {
    if (is_quoted || !ParseNodeId(word).ok()) return vocabulary_.ClassUnknown(word, true);
    return MakeError(Reason::kNodeUnknown,
                     absl::StrCat("no node of the map has the id or name \"", word,
                                  "\" at revision ", view_.revision()),
                     {{"node", word}});
  }

  const GraphView& view_;
  const Vocabulary& vocabulary_;
  NodePattern* pattern_;
  absl::Status status_;
};

class Compiler {
 public:
  Compiler(const GraphView& view, const Snapshot* snapshot, const StopCheck& stop)
      : view_(view), vocabulary_(view, snapshot, stop) {}

  absl::StatusOr<std::shared_ptr<const CompiledPattern>> Compile(const NodePattern& pattern) {
    auto out = std::make_shared<CompiledPattern>();
    out->source = pattern;
    out->index = next_index_++;
    if (!pattern.word.empty()) {
      DSG_RETURN_IF_ERROR(WordResolver(view_, vocabulary_, &out->source).Run());
    }
    out->source.word_position = 0;
    DSG_RETURN_IF_ERROR(CompileKindAndLayer(out.get()));
    DSG_RETURN_IF_ERROR(CompileClass(out.get()));
    DSG_RETURN_IF_ERROR(CompileId(out.get()));
    DSG_RETURN_IF_ERROR(CompileAttributes(out.get()));
    DSG_RETURN_IF_ERROR(CompileName(out.get()));
    out->contains = view_.symbols().Find(relations::kContains);
    for (RelationCondition& relation : out->source.relations) {
      DSG_RETURN_IF_ERROR(CompileRelation(&relation, out.get()));
    }
    for (Alternatives& alternatives : out->source.alternatives) {
      DSG_RETURN_IF_ERROR(CompileAlternatives(&alternatives, out.get()));
    }
    return std::shared_ptr<const CompiledPattern>(std::move(out));
  }

 private:
  absl::Status CompileKindAndLayer(CompiledPattern* out) {
    NodePattern& source = out->source;
    if (!source.kind.empty()) {
      if (const std::string model = Vocabulary::ModelKind(source.kind); !model.empty()) {
        source.kind = model;
      }
      DSG_ASSIGN_OR_RETURN(const bool is_known, vocabulary_.HasKind(source.kind));
      if (!is_known) return vocabulary_.KindUnknown(source.kind);
      out->kind = view_.symbols().Find(source.kind);
      out->is_never = !out->kind.has_value();
      out->layer = LayerOfKind(source.kind);
      out->asks_for_agents = out->may_be_agent = IsAgentKind(source.kind);
    }
    if (source.layer.empty()) return absl::OkStatus();
    const Layer* layer = vocabulary_.FindLayer(source.layer);
    if (layer == nullptr) return vocabulary_.LayerUnknown(source.layer);
    source.layer = layer->name;
    // No node of a kind that lives in another layer can be there.
    if (out->layer.has_value() && *out->layer != layer->id) out->is_never = true;
    out->layer = layer->id;
    out->asks_for_agents = out->asks_for_agents || layer->id == layers::kAgents;
    out->may_be_agent = out->may_be_agent && layer->id == layers::kAgents;
    return absl::OkStatus();
  }

  absl::Status CompileClass(CompiledPattern* out) {
    if (!out->has_class()) return absl::OkStatus();
    out->classes = vocabulary_.FindClass(out->source.class_name);
    if (out->classes.empty()) {
      DSG_ASSIGN_OR_RETURN(const bool has_label, vocabulary_.HasLabel(out->source.class_name));
      if (!has_label) return vocabulary_.ClassUnknown(out->source.class_name, false);
    }
    if (out->layer.has_value()) {
      std::erase_if(out->classes,
                    [&](const ClassRange& range) { return range.layer != *out->layer; });
    }
    if (out->classes.empty()) out->is_never = true;
    out->may_be_agent = out->may_be_agent && std::any_of(out->classes.begin(), out->classes.end(),
                                                         [](const ClassRange& range) {
                                                           return range.layer == layers::kAgents;
                                                         });
    return absl::OkStatus();
  }

  absl::Status CompileName(CompiledPattern* out) {
    const std::string& name = out->source.name;
    out->name = NameMatcher(name);
    // With "*" it is a question whether there are any.
    if (name.empty() || name.find('*') != std::string::npos) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const bool is_known, vocabulary_.HasName(name));
    return is_known ? absl::OkStatus() : vocabulary_.NameUnknown(name, out->layer);
  }

  absl::Status CompileId(CompiledPattern* out) {
    if (out->source.id.empty()) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const NodeId id, ParseNodeId(out->source.id));
    const ViewNode* node = view_.FindNode(id);
    if (node == nullptr) {
      return MakeError(
          Reason::kNodeUnknown,
          absl::StrCat("node ", out->source.id, " is unknown at revision ", view_.revision()),
          {{"node", out->source.id}});
    }
    out->id = id;
    const bool is_agent = IsAgentKind(view_.symbols().Text(node->kind));
    out->asks_for_agents = out->asks_for_agents || is_agent;
    out->may_be_agent = out->may_be_agent && is_agent;
    return absl::OkStatus();
  }

  absl::Status CompileAttributes(CompiledPattern* out) {
    for (const AttributeCondition& condition : out->source.attributes) {
      if (attributes::IsFileRest(condition.name)) {
        return PatternFieldError("attributes.name", condition.name,
                                 "it holds what an imported file said besides, for an export; "
                                 "search for another attribute, or read it with dsg show");
      }
      DSG_ASSIGN_OR_RETURN(const auto name, vocabulary_.FindAttribute(condition.name));
      if (!name.has_value()) return vocabulary_.AttributeUnknown(condition.name);
      out->attribute_names.push_back(*name);
    }
    return absl::OkStatus();
  }

  absl::Status CompileRelation(RelationCondition* condition, CompiledPattern* out) {
    DSG_ASSIGN_OR_RETURN(std::string name, vocabulary_.FindRelation(condition->relation));
    if (name.empty()) return vocabulary_.RelationUnknown(condition->relation);
    condition->relation = std::move(name);
    CompiledRelation relation;
    relation.symmetric = IsSymmetricRelation(condition->relation);
    // One way to write it.
    if (relation.symmetric) condition->reversed = false;
    relation.reversed = condition->reversed;
    relation.negated = condition->negated;
    if (condition->relation == kInsideRelation) {
      relation.how = CompiledRelation::How::kInside;
    } else if (condition->relation == relations::kIn) {
      relation.how = CompiledRelation::How::kEdgeOrInside;
    }
    relation.symbol = view_.symbols().Find(condition->relation);
    DSG_ASSIGN_OR_RETURN(relation.other, Compile(condition->other));
    condition->other = relation.other->source;
    out->relations.push_back(std::move(relation));
    return absl::OkStatus();
  }

  absl::Status CompileAlternatives(Alternatives* alternatives, CompiledPattern* out) {
    CompiledAlternatives compiled;
    compiled.negated = alternatives->negated;
    bool is_never = true;
    bool may_be_agent = false;
    for (NodePattern& pattern : alternatives->any_of) {
      DSG_ASSIGN_OR_RETURN(auto one, Compile(pattern));
      pattern = one->source;
      is_never = is_never && one->is_never;
      may_be_agent = may_be_agent || one->may_be_agent;
      if (!compiled.negated && one->asks_for_agents) out->asks_for_agents = true;
      compiled.any_of.push_back(std::move(one));
    }
    if (!compiled.negated) {
      out->is_never = out->is_never || is_never;
      out->may_be_agent = out->may_be_agent && may_be_agent;
    }
    out->alternatives.push_back(std::move(compiled));
    return absl::OkStatus();
  }

  const GraphView& view_;
  Vocabulary vocabulary_;
  int next_index_ = 0;
};

}  // namespace

absl::StatusOr<Pattern> ResolvePattern(const NodePattern& pattern, const GraphView& view,
                                       const Snapshot* snapshot, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const CompiledPattern> compiled,
                       Compiler(view, snapshot, stop).Compile(pattern));
  return Pattern(std::move(compiled));
}

}  // namespace dsg::query
