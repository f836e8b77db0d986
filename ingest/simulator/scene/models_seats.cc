// SPDX-License-Identifier: Apache-2.0
// Chairs, couches, armchairs, beds.
#include <algorithm>

#include "ingest/simulator/scene/models.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector3f;

void DrawChair(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float seat = 0.5f * m->height;
  m->Use(Material::kMetal, kDark);
  m->Legs(seat - 0.04f, 0.03f, 0.02f);
  // Posts that carry the back.
  for (const float side : {-1.0f, 1.0f}) {
    const float middle = side * (x - 0.06f);
    m->Box({middle - 0.015f, -y, seat - 0.06f}, {middle + 0.015f, -y + 0.03f, m->height - 0.04f});
  }
  m->Use(Material::kFabric, m->color);
  m->Box({-x, -y + 0.02f, seat - 0.05f}, {x, y, seat + 0.03f}, 0.025f);
  m->Box({-x + 0.02f, -y, 0.62f * m->height}, {x - 0.02f, -y + 0.06f, m->height}, 0.02f);
}

// A seat for `count` people with arms and a back; the back stands at -y.
void DrawSofa(Model* m, int count) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float arm = 0.11f * std::min(m->width, 1.6f);
  const float back = 0.24f * m->depth;
  const float seat = 0.52f * m->height;
  const float base = 0.3f * m->height;
  m->Use(Material::kWood, {82, 62, 46, 255});
  m->Legs(0.08f, 0.05f, 0.03f);
  m->Use(Material::kFabric, m->color);
  m->Box({-x + 0.5f * arm, -y, 0.07f}, {x - 0.5f * arm, y - 0.03f, base}, 0.02f);
  m->Box({-x, -y + 0.02f, 0.07f}, {-x + arm, y, 0.72f * m->height}, 0.05f);
  m->Box({x - arm, -y + 0.02f, 0.07f}, {x, y, 0.72f * m->height}, 0.05f);
  m->Box({-x + 0.02f, -y, 0.07f}, {x - 0.02f, -y + back, 0.94f * m->height}, 0.06f);
  m->Use(Material::kFabric, Scaled(m->color, 1.18));
  const float step = (m->width - 2.0f * arm) / static_cast<float>(count);
  for (int i = 0; i < count; ++i) {
    const float low = -x + arm + step * static_cast<float>(i) + 0.01f;
    const float high = low + step - 0.02f;
    m->Box({low, -y + back, base}, {high, y - 0.02f, seat}, 0.04f);
    m->Box({low + 0.02f, -y + 0.7f * back, seat}, {high - 0.02f, -y + 1.6f * back, m->height},
           0.06f);
  }
}

void DrawCouch(Model* m) { DrawSofa(m, m->width > 2.1f ? 3 : 2); }
void DrawArmchair(Model* m) { DrawSofa(m, 1); }

// The head stands at -y, against the wall.
void DrawBed(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float top = 0.8f * m->height;
  m->Use(Material::kWood, {120, 88, 58, 255});
  m->Legs(0.12f, 0.06f, 0.0f);
  m->Box({-x, -y, 0.1f}, {x, y, 0.4f * m->height}, 0.01f);
  m->Box({-x, -y, 0.1f}, {x, -y + 0.06f, m->height}, 0.02f);
  m->Use(Material::kFabric, kWhite);
  m->Box({-x + 0.03f, -y + 0.06f, 0.4f * m->height}, {x - 0.03f, y - 0.02f, top - 0.04f}, 0.05f);
  for (const float side : {-0.5f, 0.5f}) {
    const float middle = side * x;
    m->Box({middle - 0.38f * x, -y + 0.1f, top - 0.05f},
           {middle + 0.38f * x, -y + 0.48f, top + 0.06f}, 0.05f);
  }
  m->Use(Material::kFabric, m->color);
  m->Box({-x + 0.01f, -y + 0.62f, 0.36f * m->height}, {x - 0.01f, y - 0.01f, top}, 0.03f);
}

void DrawStool(Model* m) {
  const float radius = 0.5f * std::min(m->width, m->depth);
  m->Use(Material::kWood, m->color);
  m->Legs(m->height - 0.04f, 0.03f, 0.2f * radius);
  m->Cylinder({0.0f, 0.0f, m->height - 0.05f}, radius, 0.05f, 16);
}

void DrawBench(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kWood, m->color);
  m->Legs(m->height - 0.04f, 0.06f, 0.05f);
  for (int i = 0; i < 3; ++i) {
    const float low = -y + m->depth * static_cast<float>(i) / 3.0f;
    m->Box({-x, low, m->height - 0.04f}, {x, low + m->depth / 3.0f - 0.015f, m->height}, 0.005f);
  }
}

}  // namespace

std::span<const ModelMaker> SeatModels() {
  static constexpr ModelMaker kModels[] = {{"chair", DrawChair},       {"couch", DrawCouch},
                                           {"armchair", DrawArmchair}, {"bed", DrawBed},
                                           {"stool", DrawStool},       {"bench", DrawBench}};
  return kModels;
}

}  // namespace dsg::simulator
