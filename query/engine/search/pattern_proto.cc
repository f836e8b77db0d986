// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "absl/strings/str_cat.h"
#include "dsg/v1/search.pb.h"
#include "query/engine/search/color_name.h"
#include "query/engine/search/pattern.h"
#include "query/engine/search/text_match.h"
#include "schema/base/status.h"

namespace dsg::query {
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

absl::Status FillFromProto(const v1::NodePattern& in, int depth, int* condition_count,
                           NodePattern* out) {
  if (depth > kPatternDepthMax) {
    return PatternFieldError("relations", absl::StrCat(depth, " levels deep"),
                             absl::StrCat("give at most ", kPatternDepthMax));
  }
  *condition_count += in.attributes_size() + in.relations_size();
  if (*condition_count > kPatternConditionsMax) {
    return PatternFieldError("relations", absl::StrCat(*condition_count, " conditions long"),
                             absl::StrCat("give at most ", kPatternConditionsMax));
  }
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

}  // namespace dsg::query
