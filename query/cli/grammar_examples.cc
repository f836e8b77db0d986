// SPDX-License-Identifier: Apache-2.0
// One command line for each verb, shown by its help. They are about the world of ./dev demo.
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "query/cli/grammar.h"

namespace dsg::cli {
namespace {

using Example = std::pair<absl::string_view, absl::string_view>;

constexpr std::array<Example, 34> kExamples = {{
    {"where", "carol --at +100.25s"},
    {"track", "carol --from +30s --to +32s --every 500ms --png carol.png"},
    {"shape", "person-1 --from +20s --to +30s --obj bodies"},
    {"who", "--room kitchen --from +1m --to +2m"},
    {"met", "carol frank --within 1.5 --for 2s --line-of-sight"},
    {"picked", "--room \"office 3\" --why"},
    {"predict", "carol --at +84s --horizon 2s"},
    {"ls", "--kind room"},
    {"edges", "--source R9 --relation CONTAINS"},
    {"show", "O9"},
    {"near", "3,2,0 --k 3 --layer objects"},
    {"find", "'laptop on (desk in (room \"office 4\"))' --near 10,10,1"},
    {"around", "\"desk 10\" --relation ON"},
    {"subgraph", "\"table 2\" --relation ON --both --depth 1"},
    {"path", "carol \"nearest fridge\" --at +30s --radius 0.2"},
    {"collide", "--capsule 0.25,1.2 --pose 10,7,0.9 5,7,0.9 --at +89s"},
    {"log", "--limit 5"},
    {"diff", "0 1 --layer rooms"},
    {"watch", "--after 8 --changes"},
    {"stats", "--revision 3"},
    {"maps", ""},
    {"version", "--server unix:dsg.sock"},
    {"import", "--store store --map house house.json"},
    {"verify", "--store store --map office"},
    {"upgrade", "--store store --map office"},
    {"tag", "before-moving --note \"desks as built\""},
    {"compact", "--keep-from before-moving"},
    {"revert", "before-moving --dry-run"},
    {"backup", "backup"},
    {"restore", "backup --store elsewhere"},
    {"merge", "office-later --dry-run --png both.png"},
    {"prune", "--branch \"office 4\" --dry-run"},
    {"export", "--gltf office.glb"},
    {"map", "--png office.png"},
}};

}  // namespace

std::string ExampleOf(const std::string& verb) {
  for (const auto& [name, arguments] : kExamples) {
    if (name != verb) continue;
    return absl::StrCat("Example: dsg ", name, arguments.empty() ? "" : " ", arguments, "\n");
  }
  return "";
}

}  // namespace dsg::cli
