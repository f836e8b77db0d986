// SPDX-License-Identifier: Apache-2.0
// Options of a program in a YAML file: one key an option, named as on the command line.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace dsg::ingest {

/// Gives `app` the options --config FILE and --print-config, and all its named options as keys of
/// that file. Real numbers have to be finite. The command line goes before the file, the file
/// before the environment.
/// --print-config writes all options as they are in force, in the form of such a file, and ends the
/// program with success; it needs none of the options that are required otherwise.
///
/// Call after all other options are added. Errors end `app.parse` with a CLI::ParseError that names
/// file and line: an unknown or repeated key, a value that is no scalar or list of scalars, text
/// that is no YAML, a file above 1 MiB.
void AddConfigFile(CLI::App* app);

/// What --print-config writes. Options that have no value stand as comments.
std::string ConfigText(const CLI::App& app);

}  // namespace dsg::ingest
