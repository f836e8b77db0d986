// SPDX-License-Identifier: Apache-2.0
// Numbers that change results, as tables: name, unit, range, meaning and reason of each in one
// place. Checks, digests, flags and files of options are made from the tables.
#pragma once

#include <span>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Real numbers, counts, and times, which users see in seconds.
template <typename Options>
using OptionMember = std::variant<double Options::*, int Options::*, TimeNs Options::*>;

/// A row of the table of a struct of options. The default is that of the member.
template <typename Options>
struct OptionField {
  /// As in the command line, without "--": "segment-cell".
  const char* name;
  OptionMember<Options> value;
  double min;
  double max;
  /// A phrase: meaning and unit, and after a colon why the default is what it is.
  const char* help;
  /// Name of the row of the same struct that this one must not be below: the other end of a range.
  const char* lower_end = nullptr;
};

/// A row with the number that it stands for, which has to outlive it.
struct BoundOption {
  const char* name;
  std::variant<double*, int*, TimeNs*> value;
  double min;
  double max;
  const char* help;
  const char* lower_end = nullptr;

  double Get() const;
  /// The shortest text that reads back as the same number.
  std::string Text() const;
  bool IsCount() const { return std::holds_alternative<int*>(value); }

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming field, value and bounds; also for NaN, and for a
  /// count that is not whole.
  absl::Status Check(double number) const;
  /// Requires: Check(number).ok().
  void Set(double number) const;
};

template <typename Options>
void BindFields(std::type_identity_t<std::span<const OptionField<Options>>> fields,
                Options* options, std::vector<BoundOption>* bound) {
  for (const OptionField<Options>& field : fields) {
    std::visit(
        [&](auto member) {
          bound->push_back(
              {field.name, &(options->*member), field.min, field.max, field.help, field.lower_end});
        },
        field.value);
  }
}

/// Errors: of BoundOption::Check; FIELD_INVALID, naming both rows and their values, for a range
/// whose lower end is above its upper one.
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

/// What belongs together for users: a group of --help.
struct OptionGroup {
  /// "rooms".
  const char* name;
  std::vector<BoundOption> fields;
};

/// The same of all groups together.
absl::Status ValidateGroups(std::span<const OptionGroup> groups);
std::string DigestGroups(std::span<const OptionGroup> groups,
                         std::span<const OptionGroup> defaults);

}  // namespace dsg::ingest
