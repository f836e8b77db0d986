// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_prune.h"

#include <array>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/render_maps.h"
#include "query/cli/table.h"

namespace dsg::cli {
namespace {

using Count = std::pair<const char*, int64_t (v1::Amount::*)() const>;

constexpr std::array<Count, 9> kCounts = {{{"nodes", &v1::Amount::node_count},
                                           {"edges", &v1::Amount::edge_count},
                                           {"poses", &v1::Amount::pose_count},
                                           {"shapes", &v1::Amount::shape_count},
                                           {"factors", &v1::Amount::factor_count},
                                           {"stays", &v1::Amount::stay_count},
                                           {"mesh blocks", &v1::Amount::mesh_block_count},
                                           {"assets", &v1::Amount::asset_count},
                                           {"revisions", &v1::Amount::revision_count}}};

using Row = std::pair<std::string, const v1::Amount*>;

// Kinds of rows that the map does not have are left out.
Table TableOf(const std::vector<Row>& rows) {
  std::vector<Count> shown;
  for (const Count& count : kCounts) {
    bool is_used = false;
    for (const auto& [name, amount] : rows) is_used |= (amount->*count.second)() != 0;
    if (is_used) shown.push_back(count);
  }
  std::vector<Column> columns = {{""}};
  for (const Count& count : shown) columns.push_back({count.first, Align::kRight});
  columns.push_back({"payload", Align::kRight});
  Table table(std::move(columns));
  for (const auto& [name, amount] : rows) {
    std::vector<std::string> cells = {Printable(name)};
    for (const Count& count : shown) cells.push_back(absl::StrCat((amount->*count.second)()));
    cells.push_back(BytesText(amount->byte_count()));
    table.AddRow(std::move(cells));
  }
  return table;
}

// What is kept but for a part of it is no row that goes.
std::string StaysText(const v1::PolicyReport& policy) {
  const int64_t count = policy.matched().stay_edit_count();
  if (count == 0) return "";
  return absl::StrCat(Printable(policy.name()), ": ", Counted(count, "stay"),
                      count == 1 ? " loses its place, room or beginning and stays\n"
                                 : " lose their place, room or beginning and stay\n");
}

std::string FilesText(const v1::PruneResponse& reply) {
  return absl::StrCat("database: ", BytesText(reply.file_bytes_before() - reply.log_bytes_before()),
                      " before, ", BytesText(reply.file_bytes_after() - reply.log_bytes_after()),
                      " now; log, used again: ", BytesText(reply.log_bytes_before()), " before, ",
                      BytesText(reply.log_bytes_after()), " now\n");
}

template <typename Names>
std::string NamesText(const Names& names, int64_t count) {
  std::string text;
  for (const std::string& name : names) {
    absl::StrAppend(&text, text.empty() ? "" : " ", Printable(name));
  }
  return count > static_cast<int64_t>(names.size()) ? text + " ..." : text;
}

std::string ErasedText(const v1::PruneResponse& reply) {
  std::string text;
  if (reply.rewritten_count() > 0) {
    absl::StrAppend(&text, Counted(reply.rewritten_count(), "node"),
                    " written again by others meanwhile: the past of these is erased, but they are "
                    "believed now: ",
                    NamesText(reply.rewritten_ids(), reply.rewritten_count()), "\n");
  }
  if (reply.erased()) {
    // Of what was retired before, or by another policy of the same call, nothing is claimed.
    absl::StrAppend(&text, "erased: what this call found to erase is in no ",
                    reply.rewritten_count() > 0 ? "older " : "",
                    "revision and in no byte of the map's files; backups made before still have "
                    "it, and older revisions what was only retired\n");
    return text;
  }
  if (reply.left_count() == 0) {
    return text + "not erased for good: a reader kept the log; do the same again\n";
  }
  absl::StrAppend(&text, "not erased for good: others went on writing ",
                  Counted(reply.left_count(), "thing"), ": ",
                  NamesText(reply.left_ids(), reply.left_count()),
                  "; stop these writers, and do the same again\n");
  return text;
}

std::string DoubtsText(const v1::PruneResponse& reply) {
  std::string text;
  for (const std::string& note : reply.notes()) absl::StrAppend(&text, "clocks: ", note, "\n");
  if (!reply.refusal().empty()) {
    absl::StrAppend(&text, "the run would be refused: ", Printable(reply.refusal()), "\n");
  }
  return text;
}

// Something but history went.
bool HasRows(const v1::PruneResponse& reply) {
  const v1::Amount& before = reply.map_before();
  const v1::Amount& after = reply.map_after();
  return reply.revision() > 0 && before.byte_count() > after.byte_count();
}

}  // namespace

std::string RenderPrune(const v1::PruneResponse& reply, bool is_dry_run, bool is_erase) {
  std::vector<Row> rows;
  for (const v1::PolicyReport& policy : reply.policies()) {
    rows.emplace_back(policy.name(), &policy.matched());
  }
  rows.emplace_back(is_dry_run ? "map" : "map before", &reply.map_before());
  if (!is_dry_run) rows.emplace_back("map after", &reply.map_after());
  std::string text = TableOf(rows).Render();
  for (const v1::PolicyReport& policy : reply.policies()) text += StaysText(policy);
  text += DoubtsText(reply);
  if (is_dry_run) return text + "nothing was changed\n";
  text += FilesText(reply);
  if (reply.revision() == 0) {
    absl::StrAppend(&text, "no new revision\n");
  } else {
    absl::StrAppend(&text, "newest revision: ", reply.revision(), "\n");
  }
  if (is_erase) {
    text += ErasedText(reply);
  } else if (HasRows(reply)) {
    text += "older revisions still know it: `dsg compact` gives their bytes back\n";
  }
  return text;
}

}  // namespace dsg::cli
