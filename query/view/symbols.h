// SPDX-License-Identifier: Apache-2.0
// Names as small numbers: every kind, class, relation and node name of a map once, shared by all
// views of it. Never forgets, so that a number means the same in every revision.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dsg::query {

/// 0 is the empty text.
using Symbol = uint32_t;

/// Threads: safe from many threads; Text waits for nobody.
class SymbolTable {
 public:
  SymbolTable();
  ~SymbolTable();

  /// The number of a text, a new one if it has none yet.
  Symbol Intern(std::string_view text);
  /// nullopt if no view of this map has ever held the text.
  std::optional<Symbol> Find(std::string_view text) const;
  /// The texts that are equal to this one but for the case of the letters A to Z. Ascending.
  std::vector<Symbol> FindIgnoringCase(std::string_view text) const;
  /// Valid as long as the table. Requires: `symbol` came from here.
  const std::string& Text(Symbol symbol) const;

  size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::query
