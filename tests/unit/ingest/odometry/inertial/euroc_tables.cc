// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/odometry/inertial/euroc_tables.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

namespace dsg::ingest {
namespace {

struct TableRow {
  TimeNs time_ns = 0;
  std::vector<double> values;
};

std::vector<TableRow> ReadRows(const std::filesystem::path& path) {
  std::vector<TableRow> rows;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream fields(line);
    TableRow row;
    fields >> row.time_ns;
    char comma = 0;
    double value = 0.0;
    while (fields >> comma >> value) row.values.push_back(value);
    rows.push_back(std::move(row));
  }
  return rows;
}

Eigen::Vector3d ThreeOf(const std::vector<double>& values, size_t first) {
  return {values.at(first), values.at(first + 1), values.at(first + 2)};
}

}  // namespace

EurocTables ReadEuroc(const std::string& folder) {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path data =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  EurocTables tables;
  for (const TableRow& row : ReadRows(data / folder / "imu0" / "data.csv")) {
    tables.samples.push_back({row.time_ns, ThreeOf(row.values, 0), ThreeOf(row.values, 3)});
  }
  const auto path = data / folder / "state_groundtruth_estimate0" / "data.csv";
  for (const TableRow& row : ReadRows(path)) {
    const std::vector<double>& v = row.values;
    const Eigen::Quaterniond turn(v.at(3), v.at(4), v.at(5), v.at(6));
    tables.truth.push_back(
        {row.time_ns,
         {{ThreeOf(v, 0), turn.normalized()}, ThreeOf(v, 7), {ThreeOf(v, 10), ThreeOf(v, 13)}}});
  }
  return tables;
}

}  // namespace dsg::ingest
