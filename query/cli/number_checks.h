// SPDX-License-Identifier: Apache-2.0
// What options of numbers accept, in words that name what was given.
// Refuses NaN and infinities, which the checks of CLI11 let through or show as a number of 309
// digits.
#pragma once

#include <CLI/CLI.hpp>

namespace dsg::cli {

CLI::Validator AboveZero();
CLI::Validator ZeroOrMore();
CLI::Validator WholeAboveZero();
CLI::Validator WholeZeroOrMore();
/// Both ends belong to it.
CLI::Validator Between(double low, double high);

}  // namespace dsg::cli
