// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/config_file.h"

#include <yaml-cpp/yaml.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <istream>
#include <memory>
#include <set>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "schema/files/yaml_text.h"

namespace dsg::ingest {
namespace {

constexpr size_t kFileBytesMax = size_t{1} << 20;
constexpr size_t kCommentColumns = 96;
constexpr char kConfig[] = "config";
constexpr char kPrintConfig[] = "print-config";

// Options that a file may not have: what ends the program, and the file itself.
bool IsKey(const CLI::Option& option) {
  return !option.get_lnames().empty() && option.get_configurable();
}

// A flag takes no value on the command line, and true or false in a file.
bool IsFlag(const CLI::Option& option) { return option.get_expected_min() == 0; }

class YamlConfig : public CLI::Config {
 public:
  explicit YamlConfig(const CLI::App* app) : app_(*app) {}

  std::string to_config(const CLI::App* app, bool, bool, std::string) const override {
    return ConfigText(*app);
  }

  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override {
    try {
      const std::string text = Text(input);
      if (const auto line = FindSecondYamlDocument(text)) {
        YAML::Mark begin;
        begin.line = *line;
        throw Wrong(begin, "a second document begins here; write all options into one");
      }
      return Items(YAML::Load(text));
    } catch (const YAML::Exception& error) {
      throw Wrong(error.mark,
                  absl::StrCat("this is no YAML: ", absl::Utf8SafeCHexEscape(error.msg)));
    }
  }

 private:
  CLI::ConfigError Wrong(const YAML::Mark& mark, const std::string& what) const {
    const std::vector<std::string>& files = app_.get_config_ptr()->results();
    const std::string file = files.empty() ? "configuration" : files.back();
    return CLI::ConfigError(absl::StrCat(file, ":", mark.line + 1, ": ", what));
  }

  std::string Text(std::istream& input) const {
    std::string text(kFileBytesMax + 1, '\0');
    input.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<size_t>(input.gcount()));
    // A folder can be opened, and not read.
    if (input.bad()) throw Wrong(YAML::Mark(), "this is no file that can be read");
    if (text.size() > kFileBytesMax) {
      throw Wrong(YAML::Mark(), absl::StrCat("the file has more than ", kFileBytesMax, " bytes"));
    }
    if (YamlNestsTooDeep(text)) throw Wrong(YAML::Mark(), "brackets nest too deep");
    return text;
  }

  std::vector<CLI::ConfigItem> Items(const YAML::Node& root) const {
    if (root.IsNull()) return {};
    if (!root.IsMap()) throw Wrong(root.Mark(), "this is no map of options; write \"voxel: 0.05\"");
    std::vector<CLI::ConfigItem> found;
    std::set<std::string> seen;
    for (const auto& entry : root) {
      if (!entry.first.IsScalar()) throw Wrong(entry.first.Mark(), "a key is no name of an option");
      CLI::ConfigItem item;
      item.name = entry.first.Scalar();
      if (!seen.insert(item.name).second) {
        throw Wrong(entry.first.Mark(), absl::StrCat("key \"", item.name, "\" stands here again"));
      }
      CheckKey(entry.first, item.name);
      item.inputs = Values(entry.second, item.name, entry.first.Mark());
      found.push_back(std::move(item));
    }
    return found;
  }

  void CheckKey(const YAML::Node& key, const std::string& name) const {
    const CLI::Option* option = app_.get_option_no_throw(absl::StrCat("--", name));
    if (option != nullptr && IsKey(*option) && option->check_lname(name)) return;
    throw Wrong(key.Mark(), absl::StrCat("no option has the name \"", name, "\"; `",
                                         app_.get_name(), " --print-config` lists them"));
  }

  // `mark`: of the key, since a value that is not there has none.
  std::vector<std::string> Values(const YAML::Node& value, const std::string& name,
                                  const YAML::Mark& mark) const {
    const bool is_flag = IsFlag(*app_.get_option_no_throw(absl::StrCat("--", name)));
    if (is_flag && (!value.IsScalar() || (value.Scalar() != "true" && value.Scalar() != "false"))) {
      throw Wrong(mark, absl::StrCat("\"", name, "\" is true or false"));
    }
    if (value.IsScalar()) return {value.Scalar()};
    std::vector<std::string> values;
    for (const YAML::Node& one : value) {
      if (!value.IsSequence() || !one.IsScalar()) break;
      values.push_back(one.Scalar());
    }
    if (!values.empty() && values.size() == value.size()) return values;
    throw Wrong(mark, absl::StrCat("\"", name,
                                   "\" has no value, or one that is neither a scalar nor a "
                                   "list of scalars"));
  }

  const CLI::App& app_;
};

std::string Quoted(const std::string& value) {
  YAML::Emitter emitter;
  emitter << value;
  return emitter.c_str();
}

// Unset options have none.
std::vector<std::string> ValuesInForce(const CLI::Option& option) {
  if (option.count() > 0) return option.results();
  if (IsFlag(option)) return {"false"};
  const std::string text = option.get_default_str();
  return text.empty() ? std::vector<std::string>() : std::vector<std::string>{text};
}

std::string Comment(const std::string& text) {
  std::string comment = "#";
  size_t column = 1;
  for (const absl::string_view word : absl::StrSplit(text, ' ')) {
    if (column + 1 + word.size() > kCommentColumns) {
      absl::StrAppend(&comment, "\n#");
      column = 1;
    }
    absl::StrAppend(&comment, " ", word);
    column += 1 + word.size();
  }
  return comment;
}

std::string EntryText(const CLI::Option& option) {
  const std::string& name = option.get_lnames().front();
  std::string text = absl::StrCat(Comment(option.get_description()), "\n");
  std::vector<std::string> values = ValuesInForce(option);
  if (values.empty()) return absl::StrCat(text, "# ", name, ":\n");
  for (std::string& value : values) value = Quoted(value);
  if (values.size() == 1) return absl::StrCat(text, name, ": ", values.front(), "\n");
  return absl::StrCat(text, name, ": [", absl::StrJoin(values, ", "), "]\n");
}

// CLI11 tells of a file that is not there only after all options were looked at.
void CheckIsThere(const CLI::App& app) {
  const CLI::Option& option = *app.get_config_ptr();
  if (option.count() == 0) return;
  const std::string& file = option.results().back();
  std::error_code error;
  if (!std::filesystem::exists(file, error) || std::filesystem::is_directory(file, error)) {
    throw CLI::FileError::Missing(file);
  }
}

}  // namespace

void AddConfigFile(CLI::App* app) {
  // Comparisons with "nan" are all false, those of range checks too.
  for (CLI::Option* option : app->get_options()) {
    if (option->get_type_name().rfind("FLOAT", 0) != 0) continue;
    option->check([](const std::string& text) {
      double number = 0.0;
      if (!absl::SimpleAtod(text, &number) || std::isfinite(number)) return std::string();
      return absl::StrCat(text, " is no finite number");
    });
  }
  app->set_config(absl::StrCat("--", kConfig), "",
                  "YAML file of options by their long names; the command line goes before it");
  app->config_formatter(std::make_shared<YamlConfig>(app));
  app->allow_config_extras(CLI::config_extras_mode::error);
  // Options are looked at in their order: by now all others have got their values.
  app->add_flag_callback(
         absl::StrCat("--", kPrintConfig),
         [app] {
           CheckIsThere(*app);
           std::fputs(ConfigText(*app).c_str(), stdout);
           throw CLI::Success();
         },
         "Write all options as they are in force, as a file for --config")
      ->configurable(false);
}

std::string ConfigText(const CLI::App& app) {
  std::string text =
      absl::StrCat("# Options of ", app.get_name(), "; ", app.get_name(), " --config FILE.\n");
  std::string group;
  for (const CLI::Option* option : app.get_options()) {
    if (!IsKey(*option)) continue;
    if (option->get_group() != group) {
      group = option->get_group();
      absl::StrAppend(&text, "\n# ---- ", group, "\n");
    }
    absl::StrAppend(&text, "\n", EntryText(*option));
  }
  return text;
}

}  // namespace dsg::ingest
