// SPDX-License-Identifier: Apache-2.0
#include "ingest/config/option_flags.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Groups of options of single stages, which few runs need.
constexpr absl::string_view kTuning = "Tuning: ";

// Help with one line for each group of tuning, unless all is asked for.
class ShortHelp : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    shows_all_ = mode == CLI::AppFormatMode::All;
    return CLI::Formatter::make_help(app, std::move(name), mode);
  }

  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    if (shows_all_ || !absl::StartsWith(group, kTuning)) {
      return CLI::Formatter::make_group(std::move(group), is_positional, std::move(options));
    }
    return absl::StrCat("\n", group, ": ", options.size(), " options, see --help-all\n");
  }

 private:
  mutable bool shows_all_ = false;
};

// As BoundOption::Check has it, so that all ways say the same.
CLI::Validator InRange(const BoundOption& field) {
  return CLI::Validator(
      [field](const std::string& text) {
        double number = 0.0;
        if (!absl::SimpleAtod(text, &number)) return absl::StrCat(text, " is no number");
        return std::string(field.Check(number).message());
      },
      absl::StrCat("in [", field.min, " - ", field.max, "]"));
}

void AddFlag(const BoundOption& field, const std::string& group, CLI::App* app) {
  app->add_option_function<double>(
         absl::StrCat("--", field.name), [field](double number) { field.Set(number); }, field.help)
      ->type_name(field.IsCount() ? "INT" : "FLOAT")
      ->check(InRange(field))
      ->default_str(field.Text())
      ->group(group);
}

}  // namespace

void UseShortHelp(CLI::App* app) {
  app->formatter(std::make_shared<ShortHelp>());
  app->set_help_all_flag("--help-all", "Print the options of all groups");
}

void AddTuning(std::span<const OptionGroup> groups, CLI::App* app) {
  for (const OptionGroup& group : groups) {
    const std::string name = absl::StrCat(kTuning, group.name);
    for (const BoundOption& field : group.fields) AddFlag(field, name, app);
  }
}

absl::Status NeedsOther(const std::string& flag, const std::string& other) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--", flag, " changes nothing without --", other, "; give --",
                                other, ", or leave --", flag, " out"),
                   {{"field", flag}, {"needs", other}});
}

}  // namespace dsg::ingest
