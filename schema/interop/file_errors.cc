// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/file_errors.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/status.h"

namespace dsg {

absl::Status FileError(const std::string& file, const std::string& where, std::string_view what) {
  return MakeError(Reason::kFileMalformed, absl::StrCat(file, ": ", where, ": ", std::string(what)),
                   {{"file", file}, {"where", where}});
}

namespace {

constexpr size_t kNamedMax = 3;
// What stands in a file can be of any length.
constexpr size_t kNameBytesMax = 300;

const char* WhatOf(SkipKind kind) {
  switch (kind) {
    case SkipKind::kNode:
      return "nodes that a map cannot hold";
    case SkipKind::kRepeatedNode:
      return "nodes whose id appears twice, the first one stands";
    case SkipKind::kUnknownClass:
      return "classes of attributes that are not known, the fields that are known were read";
    case SkipKind::kNodeField:
      return "fields of nodes that cannot be read";
    case SkipKind::kEdge:
      return "edges that cannot be read";
    case SkipKind::kDanglingEdge:
      return "edges to nodes that are not there";
    case SkipKind::kLoopEdge:
      return "edges that end where they begin";
    case SkipKind::kRepeatedEdge:
      return "edges that appear twice, the first one stands";
    case SkipKind::kEdgeField:
      return "fields of edges that cannot be kept";
    case SkipKind::kMeshVertex:
      return "mesh vertices, and the faces at them";
    case SkipKind::kMeshFace:
      return "mesh faces";
  }
  return "";
}

}  // namespace

std::string ToString(const Skipped& skipped) {
  std::string text = absl::StrCat("skipped ", skipped.count, " ", skipped.what, ": ",
                                  absl::StrJoin(skipped.first, "; "));
  const int64_t more = skipped.count - static_cast<int64_t>(skipped.first.size());
  if (more > 0) absl::StrAppend(&text, "; and ", more, " more");
  return text;
}

absl::Status SkipError(const std::string& file, const std::vector<Skipped>& all,
                       const std::string& end) {
  std::string text = absl::StrCat(file, ": ");
  for (const Skipped& skipped : all) absl::StrAppend(&text, ToString(skipped), "; ");
  return MakeError(Reason::kFileMalformed, absl::StrCat(text, end), {{"file", file}});
}

void Skips::Add(SkipKind kind, const std::string& where, const std::string& what) {
  auto found = std::lower_bound(all_.begin(), all_.end(), kind,
                                [](const OfKind& one, SkipKind value) { return one.kind < value; });
  if (found == all_.end() || found->kind != kind) {
    found = all_.insert(found, {kind, {WhatOf(kind), 0, {}}});
  }
  if (++found->skipped.count > static_cast<int64_t>(kNamedMax)) return;
  found->skipped.first.push_back(absl::StrCat(where, ": ", what).substr(0, kNameBytesMax));
}

std::vector<Skipped> Skips::all() const {
  std::vector<Skipped> all;
  for (const OfKind& one : all_) all.push_back(one.skipped);
  return all;
}

}  // namespace dsg
