// SPDX-License-Identifier: Apache-2.0
// The words that the query language keeps for itself, for its parser and its writer alike.
#pragma once

#include <optional>
#include <string_view>

#include "query/engine/search/pattern.h"

namespace dsg::query {

namespace words {
inline constexpr char kAnd[] = "and";
inline constexpr char kNot[] = "not";
inline constexpr char kHas[] = "has";
inline constexpr char kAny[] = "any";
inline constexpr char kReversed[] = "reversed";
inline constexpr char kRelation[] = "relation";
}  // namespace words

/// Means something by itself, so that a class, a name or a relation of that spelling needs quotes.
/// Case ignored.
bool IsReservedWord(std::string_view word);

/// "the", "a", "an". Case ignored.
bool IsArticle(std::string_view word);

/// The text field that `word` names ("class", "color", ...), or null. Case ignored.
std::string NodePattern::*FindField(std::string_view word);

std::optional<Comparison> ComparisonOf(std::string_view text);
/// "=", "!=", ... Requires: not kExists.
std::string_view TextOf(Comparison comparison);

}  // namespace dsg::query
