// SPDX-License-Identifier: Apache-2.0
// Words that are near in spelling to one that is not known.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dsg {

/// Insertions, deletions, replacements and swaps of neighbours that turn one into the other.
int EditDistance(std::string_view a, std::string_view b);

/// At most five of `known` that are near to `word`, nearest first, then by spelling; case ignored.
std::vector<std::string> NearInSpelling(std::string_view word,
                                        const std::vector<std::string>& known);

/// `; near in spelling: "cup", "cap"`; empty if nothing is near.
std::string NearHint(std::string_view word, const std::vector<std::string>& known);

/// As NearHint; if nothing is near, `; known: ...` with the first ten in spelling and how many more
/// there are; empty if none is known.
std::string SpellingHint(std::string_view word, std::vector<std::string> known);

}  // namespace dsg
