// SPDX-License-Identifier: Apache-2.0
// The verb view: the maps of a store folder in a browser. It becomes a dsg-server that serves the
// viewer, so that what is shown is what a server shows.
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

constexpr char kServerName[] = "dsg-server";

struct ViewVerb {
  /// Empty = --store.
  std::string folder;
  std::string http = "127.0.0.1:0";
};

std::string StoreOf(const ViewVerb& verb, const CommonOptions& common) {
  return verb.folder.empty() ? common.store : verb.folder;
}

absl::Status CheckView(const ViewVerb& verb, const CommonOptions& common) {
  if (!StoreOf(verb, common).empty()) return absl::OkStatus();
  return Usage("view needs a store folder: dsg view DIR", "view");
}

// A server would make a store of any folder, and serve a page without maps.
absl::Status CheckStore(const std::string& folder) {
  const auto refuse = [&](const std::string& what) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("folder ", Printable(folder), " ", what,
                                  "; name the folder of a store, or make a map there with "
                                  "dsg-ingest --store DIR --map NAME LOG"),
                     {{"field", "DIR"}, {"value", folder}});
  };
  if (!std::filesystem::is_directory(folder)) return refuse("is not there");
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> maps, store->MapNames());
  return maps.empty() ? refuse("has no maps") : absl::OkStatus();
}

// The server beside this program, which has its version; else the one on PATH.
std::string ServerProgram() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path beside = self.parent_path() / kServerName;
  return !error && std::filesystem::exists(beside, error) ? beside.string() : kServerName;
}

absl::Status RunView(Session* session, const ViewVerb& verb, std::ostream& out) {
  const std::string store = StoreOf(verb, session->common());
  DSG_RETURN_IF_ERROR(CheckStore(store));
  out.flush();
  std::vector<std::string> words = {ServerProgram(), "--store", store, "--http", verb.http};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execvp(arguments[0], arguments.data());
  return absl::UnavailableError(absl::StrCat("cannot start ", words[0], ": ", std::strerror(errno),
                                             "; put dsg-server beside dsg"));
}

}  // namespace

void AddViewVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<ViewVerb>(
      {.name = "view",
       .what = "Serve a store to a browser until Ctrl-C, and print the address of its viewer",
       .example = "store",
       .takes = 0,
       .opens = Opens::kNothing,
       .run = RunView,
       .check = CheckView,
       .footer = "Starts dsg-server with --http; docs/viewer.md says what the page shows."});
  app->add_option("DIR", verb->folder, "Folder of the store; default --store");
  app->add_option("--http", verb->http, "Address of the page; port 0 = one that is free")
      ->capture_default_str();
}

}  // namespace dsg::cli
