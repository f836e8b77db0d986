// SPDX-License-Identifier: Apache-2.0
// How readers of files say what is wrong: errors that name the place, and what was skipped, counted
// by kind. A file of 2,241 edges is worth reading when 6 of them lead nowhere.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"

namespace dsg {

/// INVALID_ARGUMENT/FILE_MALFORMED "`file`: `where`: `what`"; `where` is a field or a byte offset.
absl::Status FileError(const std::string& file, const std::string& where, std::string_view what);

enum class SkipKind {
  kNode,
  kRepeatedNode,
  kUnknownClass,
  kNodeField,
  kEdge,
  kDanglingEdge,
  kLoopEdge,
  kRepeatedEdge,
  kEdgeField,
  kMeshVertex,
  kMeshFace,
};

/// All of a kind that were skipped.
struct Skipped {
  /// "edges to nodes that are not in the file".
  std::string what;
  int64_t count = 0;
  /// Each "where: what is wrong", the first ones of the file only.
  std::vector<std::string> first;
};

/// "skipped 6 edges ...: edge p1 to p9: node p9 is not in the file; ...; and 3 more".
std::string ToString(const Skipped& skipped);

/// INVALID_ARGUMENT/FILE_MALFORMED: "`file`: skipped 6 edges ...; `end`".
absl::Status SkipError(const std::string& file, const std::vector<Skipped>& all,
                       const std::string& end);

class Skips {
 public:
  void Add(SkipKind kind, const std::string& where, const std::string& what);

  bool empty() const { return all_.empty(); }
  /// In the order of SkipKind.
  std::vector<Skipped> all() const;

 private:
  struct OfKind {
    SkipKind kind;
    Skipped skipped;
  };

  /// Ordered by kind; few.
  std::vector<OfKind> all_;
};

}  // namespace dsg
