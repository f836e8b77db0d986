// SPDX-License-Identifier: Apache-2.0
// What became of a log, in words for people and as JSON for programs.
#pragma once

#include <string>

#include "ingest/log/log_source.h"
#include "ingest/pipeline/ingest_log.h"

namespace dsg::ingest {

struct RunReport {
  /// As the command line named the log.
  std::string path;
  LogInfo info;
  IngestSummary summary;
  double seconds = 0.0;
  bool is_dry_run = false;
};

/// On standard output, with warnings on standard error. `has_timings`: what each stage has cost,
/// too.
void PrintReport(const RunReport& report, bool has_timings);

/// One line: an object with the counts of PrintReport. Parts that the log has no use for are left
/// out.
std::string ReportJson(const RunReport& report);

}  // namespace dsg::ingest
