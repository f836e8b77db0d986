// SPDX-License-Identifier: Apache-2.0
// w2_store FOLDER: makes a store with W2 as its map "w2", for measurements of other programs.
#include <cstdio>
#include <cstdlib>

#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/w2_graph.h"

namespace {

absl::Status MakeStore(const std::string& folder) {
  dsg::StoreOptions options;
  options.create = true;
  DSG_ASSIGN_OR_RETURN(const auto store, dsg::GraphStore::Open(folder, options));
  dsg::MapSpec spec;
  spec.name = "w2";
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(spec.name));
  dsg::GraphDelta delta = dsg::bench::W2Graph();
  delta.map = spec.name;
  delta.session_id = "w2";
  delta.sequence = 1;
  delta.author = "w2_store";
  return writer->Commit(std::move(delta)).status();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: w2_store FOLDER\n");
    return 2;
  }
  const absl::Status made = MakeStore(argv[1]);
  if (made.ok()) return EXIT_SUCCESS;
  std::fprintf(stderr, "w2_store: %s\n", made.ToString().c_str());
  return EXIT_FAILURE;
}
