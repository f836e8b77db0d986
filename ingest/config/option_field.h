// SPDX-License-Identifier: Apache-2.0
// Real numbers that change results, as tables: name, unit, range, meaning and reason of each in one
// place. Checks, digests, flags and files of options are made from the tables.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace dsg::ingest {

/// A row of the table of a struct of options. The default is that of the member.
template <typename Options>
struct OptionField {
  /// As in the command line, without "--": "segment-cell".
  const char* name;
  double Options::*value;
  double min;
  double max;
  /// A phrase: meaning and unit, and after a colon why the default is what it is.
  const char* help;
};

/// A row with the number that it stands for, which has to outlive it.
struct BoundOption {
  const char* name;
  double* value;
  double min;
  double max;
  const char* help;
};

template <typename Options>
void BindFields(std::span<const OptionField<Options>> fields, Options* options,
                std::vector<BoundOption>* bound) {
  for (const OptionField<Options>& field : fields) {
    bound->push_back({field.name, &(options->*field.value), field.min, field.max, field.help});
  }
}

/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming field, value and bounds; also for NaN.
absl::Status ValidateFields(std::span<const BoundOption> fields);

/// The values that differ from `defaults`, by name, as text; each value reads back as the same
/// number. `defaults`: the same rows of another struct; without, all values are told.
std::string DigestFields(std::span<const BoundOption> fields,
                         std::span<const BoundOption> defaults);

/// The same of a struct with a function Bind() that returns its rows. A digest is empty for the
/// defaults, so that a new option leaves what is known by a digest known; a change of a default
/// has to show elsewhere.
template <typename Options>
absl::Status ValidateOptions(Options options) {
  return ValidateFields(options.Bind());
}
template <typename Options>
std::string DigestOptions(Options options) {
  Options defaults;
  return DigestFields(options.Bind(), defaults.Bind());
}

}  // namespace dsg::ingest
