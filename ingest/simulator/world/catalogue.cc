// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/catalogue.h"

#include <map>

#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

PlanSpec MakeWing() {
  return {"office",
          "corridor",
          2.4,
          5.2,
          6.4,
          2.8,
          1.0,
          {{"office", 7, 4.2, 5.4},
           {"meeting room", 3, 5.0, 6.0},
           {"kitchen", 1, 5.0, 5.6},
           {"lounge", 1, 6.0, 7.0},
           {"library", 1, 5.4, 6.4},
           {"copy room", 1, 3.0, 3.6},
           {"storage room", 1, 3.0, 3.6},
           {"restroom", 1, 3.2, 3.8}}};
}

PlanSpec MakeApartment() {
  return {"apartment",
          "hallway",
          1.6,
          5.0,
          5.3,
          2.5,
          0.9,
          {{"living room", 1, 7.0, 7.5},
           {"kitchen", 1, 5.2, 5.8},
           {"bathroom", 1, 3.3, 3.7},
           {"bedroom", 1, 6.0, 6.5},
           {"study", 1, 5.0, 5.5}}};
}

}  // namespace

const std::vector<SemanticLabel>& Labels() {
  static const std::vector<SemanticLabel> labels = {
      {1, "wall"},
      {2, "floor"},
      {3, "ceiling"},
      {4, "glass"},
      {5, "pillar"},
      {10, "desk"},
      {11, "chair"},
      {12, "table"},
      {13, "couch"},
      {14, "coffee table"},
      {15, "armchair"},
      {16, "counter"},
      {17, "fridge"},
      {18, "microwave"},
      {19, "coffee machine"},
      {20, "cup"},
      {21, "bowl"},
      {22, "laptop"},
      {23, "book"},
      {24, "shelf"},
      {25, "cabinet"},
      {26, "plant"},
      {27, "printer"},
      {28, "bin"},
      {29, "lamp"},
      {30, "tv stand"},
      {31, "tv"},
      {32, "bed"},
      {33, "nightstand"},
      {34, "wardrobe"},
      {35, "toilet"},
      {36, "washbasin"},
      {37, "bathtub"},
      {38, "whiteboard"},
      {39, "picture"},
      {40, "bottle"},
      {41, "phone"},
      {42, "office chair"},
      {90, "human"},
      {100, "corridor"},
      {101, "hallway"},
      {102, "office"},
      {103, "meeting room"},
      {104, "kitchen"},
      {105, "lounge"},
      {106, "library"},
      {107, "copy room"},
      {108, "storage room"},
      {109, "restroom"},
      {110, "bathroom"},
      {111, "living room"},
      {112, "bedroom"},
      {113, "study"},
      {114, "open office"},
      {115, "lobby"},
      {200, "office building"},
      {201, "apartment building"},
  };
  return labels;
}

int32_t ClassId(std::string_view class_name) {
  for (const SemanticLabel& label : Labels()) {
    if (label.name == class_name) return label.id;
  }
  DSG_CHECK(false && "a class name that is not in the catalogue");
  return -1;
}

std::vector<Color> ColorsOf(std::string_view class_name) {
  static const std::map<std::string, std::vector<Color>, std::less<>> colors = {
      {"chair", {{70, 78, 92, 255}, {44, 98, 128, 255}, {52, 56, 60, 255}}},
      {"office chair", {{40, 44, 50, 255}, {120, 44, 50, 255}}},
      {"couch", {{142, 84, 72, 255}, {78, 104, 132, 255}, {118, 112, 96, 255}}},
      {"armchair", {{164, 116, 68, 255}, {96, 124, 104, 255}}},
      {"cup", {{236, 236, 230, 255}, {196, 62, 52, 255}, {58, 106, 178, 255}}},
      {"bowl", {{226, 214, 186, 255}, {92, 150, 160, 255}}},
      {"book", {{150, 52, 58, 255}, {48, 88, 112, 255}, {84, 118, 70, 255}}},
      {"fridge", {{222, 228, 232, 255}}},
      {"counter", {{188, 184, 176, 255}}},
      {"microwave", {{96, 100, 104, 255}}},
      {"coffee machine", {{58, 50, 48, 255}}},
      {"laptop", {{62, 66, 72, 255}}},
      {"plant", {{74, 138, 72, 255}, {96, 154, 84, 255}}},
      {"printer", {{206, 206, 200, 255}}},
      {"bin", {{110, 114, 118, 255}}},
      {"lamp", {{232, 204, 120, 255}}},
      {"tv", {{30, 32, 36, 255}}},
      {"bed", {{192, 198, 212, 255}, {206, 186, 178, 255}}},
      {"cabinet", {{150, 154, 158, 255}}},
      {"toilet", {{238, 240, 240, 255}}},
      {"washbasin", {{232, 236, 238, 255}}},
      {"bathtub", {{228, 234, 238, 255}}},
      {"whiteboard", {{244, 246, 248, 255}}},
      {"picture", {{178, 92, 60, 255}, {66, 110, 140, 255}, {128, 138, 82, 255}}},
      {"bottle", {{70, 140, 96, 255}, {90, 160, 200, 255}}},
      {"phone", {{34, 36, 42, 255}}},
  };
  if (const auto found = colors.find(class_name); found != colors.end()) return found->second;
  // Wood, for desks, tables, shelves and the like.
  return {{176, 134, 90, 255}, {154, 112, 72, 255}, {196, 158, 112, 255}};
}

const PlanSpec& PlanSpecOf(WorldKind kind) {
  static const PlanSpec wing = MakeWing();
  static const PlanSpec apartment = MakeApartment();
  DSG_CHECK(kind != WorldKind::kOffice);
  return kind == WorldKind::kWing ? wing : apartment;
}

}  // namespace dsg::simulator
