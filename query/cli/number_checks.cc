// SPDX-License-Identifier: Apache-2.0
#include "query/cli/number_checks.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace dsg::cli {
namespace {

// CLI11 puts the option's name before what a check says; empty means that the text passes.
CLI::Validator Check(const std::string& form, const std::string& what,
                     const std::function<bool(const std::string&)>& passes) {
  return CLI::Validator(
      [what, passes](const std::string& text) {
        return passes(text) ? std::string() : absl::StrCat("\"", text, "\" is not ", what);
      },
      form);
}

CLI::Validator Real(const std::string& form, const std::string& what,
                    const std::function<bool(double)>& passes) {
  return Check(form, what, [passes](const std::string& text) {
    double number = 0.0;
    return absl::SimpleAtod(text, &number) && std::isfinite(number) && passes(number);
  });
}

CLI::Validator Whole(const std::string& form, const std::string& what, int64_t low) {
  return Check(form, what, [low](const std::string& text) {
    int64_t number = 0;
    return absl::SimpleAtoi(text, &number) && number >= low;
  });
}

}  // namespace

CLI::Validator AboveZero() {
  return Real("POSITIVE", "a number above zero", [](double number) { return number > 0.0; });
}

CLI::Validator ZeroOrMore() {
  return Real("NONNEGATIVE", "a number of at least zero",
              [](double number) { return number >= 0.0; });
}

CLI::Validator WholeAboveZero() { return Whole("POSITIVE", "a whole number above zero", 1); }

CLI::Validator WholeZeroOrMore() {
  return Whole("NONNEGATIVE", "a whole number of at least zero", 0);
}

CLI::Validator Between(double low, double high) {
  return Real(absl::StrCat("in [", low, " - ", high, "]"),
              absl::StrCat("a number from ", low, " to ", high),
              [low, high](double number) { return number >= low && number <= high; });
}

}  // namespace dsg::cli
