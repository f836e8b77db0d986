// SPDX-License-Identifier: Apache-2.0
// The parser of command lines. Each verb describes itself to it; see verb_factors.cc.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "query/cli/arguments.h"

namespace dsg::cli {

/// Which of the common options a verb takes; all verbs take --store.
enum Takes : unsigned {
  kServer = 1,
  kMap = 2,
  /// --map without DSG_MAP as its default: for verbs that by default work on all maps.
  kMapFilter = 4,
  kRevision = 8,
  kJson = 16,
  kLimit = 32,
  /// The answer is one list, which has --format.
  kFormat = 64,
  kQuestion = kServer | kMap | kRevision | kJson,
};

inline constexpr char kTimeHelp[] =
    "TIME is +12.5s from the map's epoch, RFC 3339, or nanoseconds.\n"
    "Exit codes: 0 found, 1 not found, 2 usage, 3 unavailable, 4 data loss.";
inline constexpr char kAgentHelp[] = "Node id (H12) or the name in the log (12)";
inline constexpr char kNodeHelp[] = "Node id (O42) or a unique name";
inline constexpr char kMapFromHelp[] = "First TIME; default the first pose of the map";
inline constexpr char kMapToHelp[] = "TIME to stop before; default after the last pose";
inline constexpr char kContentAtHelp[] = "The world at this TIME; default all that has not ended";
inline constexpr char kFloorHelp[] =
    "Draw only this floor: a level or room by id or name, or a height in metres";

/// A verb. `V` holds its own options.
template <class V>
struct VerbSpec {
  std::string name{};
  /// One line for the list of verbs.
  std::string what{};
  /// Arguments of an example that works in the world of ./dev demo.
  std::string example{};
  unsigned takes = kQuestion;
  Opens opens = Opens::kMap;
  /// Writes the answer to `out`; on an error nothing, or what a list had written until then.
  absl::Status (*run)(Session* session, const V& verb, std::ostream& out) = nullptr;
  /// Checks options that depend on each other, before anything is opened.
  absl::Status (*check)(const V& verb, const CommonOptions& common) = nullptr;
  /// The end of the help, after the example.
  std::string footer = kTimeHelp;
};

/// INVALID_ARGUMENT that refers to the help; `verb` may be empty.
absl::Status Usage(const std::string& message, const std::string& verb);

class Grammar {
 public:
  /// `version`: of this program, for its manual.
  explicit Grammar(const std::string& version);

  /// Adds a verb. The verb's own options are added to the first, and write to the second, which
  /// lives as long as the first.
  template <class V>
  std::pair<CLI::App*, V*> Add(const VerbSpec<V>& spec) {
    CLI::App* app = AddApp(spec.name, spec.what, spec.example, spec.footer, spec.takes);
    const auto verb = std::make_shared<V>();
    app->callback([this, verb, spec] {
      command_.opens = spec.opens;
      command_.uses_map_variable = (spec.takes & kMap) != 0;
      command_.verb = *verb;
      if (spec.check != nullptr) {
        command_.check = [verb, check = spec.check](const CommonOptions& common) {
          return check(*verb, common);
        };
      }
      command_.run = [verb, run = spec.run](Session* session, std::ostream& out) {
        return run(session, *verb, out);
      };
    });
    return {app, verb.get()};
  }

  /// The heading of the help under which the verbs stand that are added from now on.
  void set_heading(std::string heading) { heading_ = std::move(heading); }

  /// Of other options and arguments an empty text is refused.
  void AllowEmpty(const CLI::Option* option) { may_be_empty_.insert(option); }

  CommonOptions* common() { return &command_.common; }

  absl::Status Parse(std::vector<std::string> arguments);
  const Command& command() const { return command_; }
  /// All verbs and their options.
  const CLI::App& app() const { return app_; }

 private:
  CLI::App* AddApp(const std::string& name, const std::string& what, const std::string& example,
                   const std::string& footer, unsigned takes);

  // Something that is there and empty comes from an unset variable of a script. It must not count
  // as left out: another store would be taken, or the whole list.
  absl::Status CheckNothingIsEmpty(const std::string& verb) const;

  CLI::App app_{"Asks a store of dynamic scene graphs, or a server."};
  std::string heading_;
  std::set<const CLI::Option*> may_be_empty_;
  Command command_;
};

// Options that several verbs have.
void AddFilter(CLI::App* app, FilterOptions* filter);
void AddPicture(CLI::App* app, const std::string& what, PictureOptions* picture);
/// An option, or an argument, that takes the number of a revision or a tag.
CLI::Option* AddRevision(CLI::App* app, const std::string& name, const std::string& what,
                         RevisionOption* revision);

// Checks of numbers. They refuse NaN and infinities, which the checks of CLI11 let through or print
// with 309 digits.
CLI::Validator AboveZero();
CLI::Validator ZeroOrMore();
CLI::Validator WholeAboveZero();
CLI::Validator WholeZeroOrMore();
/// Both ends are allowed.
CLI::Validator Between(double low, double high);

/// The name of a file that ends in one of these, which say its format; letters of either case.
CLI::Validator EndsIn(const std::vector<std::string>& endings);

}  // namespace dsg::cli
