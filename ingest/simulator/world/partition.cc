// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/partition.h"

#include <algorithm>
#include <cmath>

#include "ingest/simulator/world/shell.h"

namespace dsg::simulator {
namespace {

constexpr double kHallM2Max = 420.0;
constexpr double kSmallHallM2Max = 160.0;
constexpr double kHallM2Min = 100.0;
constexpr double kHallEdgeMinM = 6.5;
constexpr double kRoomM2Max = 60.0;
constexpr double kRoomM2Min = 12.0;
constexpr double kRoomEdgeMinM = 3.2;
constexpr int kRoomCountMin = 30;
constexpr int kRoomCountMax = 50;

/// From low to high on one axis.
struct Band {
  double low = 0.0;
  double high = 0.0;
};

Band BandAt(double low, Random* random) {
  return {Centimetres(low), Centimetres(low + random->Uniform(2.0, 2.4))};
}

/// Corridors across one axis: the two sides of the loop and one or two between them.
std::vector<Band> DrawBands(Random* random) {
  const Band first = BandAt(random->Uniform(6.9, 7.7), random);
  const Band last = BandAt(kOfficeEdgeM - random->Uniform(9.1, 9.9), random);
  const double inside = last.low - first.high;
  const auto between = [&](double share) { return BandAt(first.high + share * inside, random); };
  if (random->Chance(0.35)) return {first, between(random->Uniform(0.38, 0.58)), last};
  const Band second = between(random->Uniform(0.26, 0.36));
  return {first, second, between(random->Uniform(0.6, 0.7)), last};
}

Rect Across(const Band& x, const Band& y) {
  return Rect(Point(x.low, y.low), Point(x.high, y.high));
}

/// What is left beside the corridors: around the loop, like the arms of a pinwheel, and inside.
std::vector<Rect> BlocksBetween(const std::vector<Band>& columns, const std::vector<Band>& rows) {
  const double west = columns.front().low;
  const double east = columns.back().high;
  const double south = rows.front().low;
  const double north = rows.back().high;
  std::vector<Rect> blocks = {Across({0.0, east}, {0.0, south}),
                              Across({east, kOfficeEdgeM}, {0.0, north}),
                              Across({west, kOfficeEdgeM}, {north, kOfficeEdgeM}),
                              Across({0.0, west}, {south, kOfficeEdgeM})};
  for (size_t row = 0; row + 1 < rows.size(); ++row) {
    for (size_t column = 0; column + 1 < columns.size(); ++column) {
      blocks.push_back(Across({columns[column].high, columns[column + 1].low},
                              {rows[row].high, rows[row + 1].low}));
    }
  }
  return blocks;
}

std::vector<Rect> CorridorsOf(const std::vector<Band>& columns, const std::vector<Band>& rows) {
  std::vector<Rect> corridors;
  for (const Band& row : rows) {
    corridors.push_back(Across({columns.front().low, columns.back().high}, row));
  }
  for (const Band& column : columns) {
    for (size_t row = 0; row + 1 < rows.size(); ++row) {
      corridors.push_back(Across(column, {rows[row].high, rows[row + 1].low}));
    }
  }
  return corridors;
}

double Slenderness(const Rect& rect) { return rect.sizes().maxCoeff() / rect.sizes().minCoeff(); }

/// Across its longer edge, `share` of it first.
std::pair<Rect, Rect> Cut(const Rect& rect, double share) {
  const int axis = rect.sizes().x() >= rect.sizes().y() ? 0 : 1;
  const double line = Centimetres(rect.min()[axis] + share * rect.sizes()[axis]);
  Rect first = rect;
  Rect second = rect;
  first.max()[axis] = line;
  second.min()[axis] = line;
  return {first, second};
}

/// Pieces that may become one hall or several rooms.
void CutToPlots(const Rect& rect, Random* random, std::vector<Rect>* plots) {
  if (rect.volume() <= kHallM2Max && Slenderness(rect) <= 2.6) {
    plots->push_back(rect);
    return;
  }
  const auto [first, second] = Cut(rect, random->Uniform(0.4, 0.6));
  CutToPlots(first, random, plots);
  CutToPlots(second, random, plots);
}

bool IsRoomSize(const Rect& rect) {
  return rect.volume() >= kRoomM2Min && rect.volume() <= kRoomM2Max &&
         rect.sizes().minCoeff() >= kRoomEdgeMinM && Slenderness(rect) <= 3.0;
}

/// Into `count` rooms of about equal size. False when a piece came out that is no room.
bool CutToRooms(const Rect& rect, int count, Random* random, std::vector<Rect>* rooms) {
  if (count == 1) {
    rooms->push_back(rect);
    return IsRoomSize(rect);
  }
  const int first_count = count / 2;
  const double even = static_cast<double>(first_count) / count;
  const auto [first, second] = Cut(rect, even * random->Uniform(0.87, 1.13));
  return CutToRooms(first, first_count, random, rooms) &&
         CutToRooms(second, count - first_count, random, rooms);
}

/// Into about `count` rooms.
bool DrawRooms(const Rect& plot, int count, Random* random, std::vector<Rect>* rooms) {
  constexpr int kTryCount = 20;
  for (int i = 0; i < kTryCount; ++i) {
    std::vector<Rect> drawn;
    // The last tries with smaller rooms.
    if (!CutToRooms(plot, i < kTryCount / 2 ? count : count + 1, random, &drawn)) continue;
    rooms->insert(rooms->end(), drawn.begin(), drawn.end());
    return true;
  }
  return false;
}

/// A piece of ground that becomes one hall or `room_count` rooms.
struct Plot {
  Rect rect;
  int room_count = 1;
  /// Plots become halls in the order of this.
  double rank = 0.0;

  bool MayBeHall() const {
    return rect.volume() >= kHallM2Min && rect.sizes().minCoeff() >= kHallEdgeMinM;
  }
};

std::vector<Plot> DrawPlots(const std::vector<Rect>& blocks, Random* random) {
  std::vector<Rect> rects;
  for (const Rect& block : blocks) CutToPlots(block, random, &rects);
  std::vector<Plot> plots;
  for (const Rect& rect : rects) {
    const double room_m2 = random->Uniform(46.0, 57.0);
    const int room_count = std::max(1, static_cast<int>(std::lround(rect.volume() / room_m2)));
    // The larger sooner, so that few halls do.
    plots.push_back({rect, room_count, -rect.volume() * random->Uniform(0.5, 1.0)});
  }
  // One of the smaller ones sooner than all, and some of the larger ones last, for variety.
  for (Plot& plot : plots) {
    if (plot.rect.volume() > kSmallHallM2Max && random->Chance(0.2)) plot.rank *= 0.1;
  }
  Plot& any = plots[random->Index(static_cast<int>(plots.size()))];
  if (any.rect.volume() <= kSmallHallM2Max) any.rank *= 10.0;
  std::sort(plots.begin(), plots.end(),
            [](const Plot& a, const Plot& b) { return a.rank < b.rank; });
  return plots;
}

/// So many halls that the rest makes no more rooms than were asked for; at least one.
bool DrawHallsAndRooms(const std::vector<Plot>& plots, int room_count_max, Random* random,
                       Partition* partition) {
  int room_count = 0;
  for (const Plot& plot : plots) room_count += plot.room_count;
  for (const Plot& plot : plots) {
    if (plot.MayBeHall() && (room_count > room_count_max || partition->halls.empty())) {
      partition->halls.push_back(plot.rect);
      room_count -= plot.room_count - 1;
    } else if (!DrawRooms(plot.rect, plot.room_count, random, &partition->rooms)) {
      return false;
    }
  }
  return true;
}

/// Now and then a room is cut into a room and what it keeps its things in.
void CutOffClosets(Random* random, std::vector<Rect>* rooms) {
  constexpr double kShare = 0.12;
  const size_t count = rooms->size();
  for (size_t i = 0; i < count; ++i) {
    if (!random->Chance(kShare)) continue;
    const auto [first, second] = Cut((*rooms)[i], random->Uniform(0.35, 0.65));
    if (!IsRoomSize(first) || !IsRoomSize(second)) continue;
    (*rooms)[i] = first;
    rooms->push_back(second);
  }
}

void Transpose(std::vector<Rect>* rects) {
  for (Rect& rect : *rects) {
    std::swap(rect.min().x(), rect.min().y());
    std::swap(rect.max().x(), rect.max().y());
  }
}

}  // namespace

std::optional<Partition> DrawPartition(Random* random) {
  const std::vector<Band> columns = DrawBands(random);
  const std::vector<Band> rows = DrawBands(random);
  Partition partition;
  partition.corridors = CorridorsOf(columns, rows);
  const std::vector<Plot> plots = DrawPlots(BlocksBetween(columns, rows), random);
  // Cutting in two may yet add some.
  if (!DrawHallsAndRooms(plots, random->Integer(42, 46), random, &partition)) return std::nullopt;
  CutOffClosets(random, &partition.rooms);
  const auto count = static_cast<int>(partition.halls.size() + partition.rooms.size());
  if (count < kRoomCountMin || count > kRoomCountMax) return std::nullopt;
  if (random->Chance(0.5)) {
    for (auto* rects : {&partition.corridors, &partition.halls, &partition.rooms}) {
      Transpose(rects);
    }
  }
  return partition;
}

std::vector<SharedWall> SharedWallsOf(const std::vector<Rect>& cells) {
  // Cells are in whole centimetres, so this only forgives rounding.
  constexpr double kNothingM = 1e-6;
  std::vector<SharedWall> walls;
  for (int a = 0; a < static_cast<int>(cells.size()); ++a) {
    for (int b = a + 1; b < static_cast<int>(cells.size()); ++b) {
      for (const int across : {0, 1}) {
        const int along = 1 - across;
        const bool a_first = std::abs(cells[a].max()[across] - cells[b].min()[across]) < kNothingM;
        const bool b_first = std::abs(cells[b].max()[across] - cells[a].min()[across]) < kNothingM;
        const double from = std::max(cells[a].min()[along], cells[b].min()[along]);
        const double to = std::min(cells[a].max()[along], cells[b].max()[along]);
        if ((!a_first && !b_first) || to - from < kNothingM) continue;
        const double line = a_first ? cells[a].max()[across] : cells[b].max()[across];
        walls.push_back({a, b, across == 1, line, from, to});
      }
    }
  }
  return walls;
}

}  // namespace dsg::simulator
