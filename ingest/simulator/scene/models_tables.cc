// SPDX-License-Identifier: Apache-2.0
// Desks, tables, counters: what other things stand on. Their tops are flat and as high as the box.
#include "ingest/simulator/scene/models.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector3f;

constexpr float kTopM = 0.035f;

void DrawTop(Model* m, float thickness) {
  m->Box({-0.5f * m->width, -0.5f * m->depth, m->height - thickness},
         {0.5f * m->width, 0.5f * m->depth, m->height}, 0.006f);
}

// Fronts of drawers or doors side by side on the +y face, with a grip on each.
void DrawFronts(Model* m, float low, float high, int columns, int rows) {
  const float y = 0.5f * m->depth;
  const float step_x = m->width / static_cast<float>(columns);
  const float step_z = (high - low) / static_cast<float>(rows);
  for (int column = 0; column < columns; ++column) {
    for (int row = 0; row < rows; ++row) {
      const float x = -0.5f * m->width + step_x * static_cast<float>(column);
      const float z = low + step_z * static_cast<float>(row);
      m->Use(Material::kWood, m->color);
      m->Box({x + 0.006f, y - 0.03f, z + 0.006f},
             {x + step_x - 0.006f, y - 0.012f, z + step_z - 0.006f}, 0.003f);
      m->Use(Material::kMetal, kSteel);
      const float middle = x + 0.5f * step_x;
      m->Box({middle - 0.06f, y - 0.012f, z + step_z - 0.06f},
             {middle + 0.06f, y, z + step_z - 0.045f});
    }
  }
}

void DrawDesk(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kWood, m->color);
  DrawTop(m, kTopM);
  // Knees go in from +y; the panel is at the wall.
  m->Use(Material::kWood, Scaled(m->color, 0.8));
  m->Box({-x + 0.06f, -y + 0.05f, 0.35f * m->height}, {x - 0.06f, -y + 0.07f, m->height - kTopM});
  const float box = x - 0.42f;
  m->Box({box, -y + 0.08f, 0.3f * m->height}, {x - 0.05f, y - 0.08f, m->height - kTopM});
  m->Use(Material::kMetal, kSteel);
  m->Legs(m->height - kTopM, 0.045f, 0.02f);
  for (int i = 0; i < 2; ++i) {
    const float z = m->height * (0.45f + 0.25f * static_cast<float>(i));
    m->Box({box + 0.1f, y - 0.08f, z}, {x - 0.15f, y - 0.065f, z + 0.015f});
  }
}

void DrawTable(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kWood, m->color);
  DrawTop(m, kTopM);
  m->Use(Material::kWood, Scaled(m->color, 0.75));
  m->Legs(m->height - kTopM, 0.06f, 0.03f);
  const float low = m->height - kTopM - 0.07f;
  for (const float side : {-1.0f, 1.0f}) {
    const float at_y = side * (y - 0.06f);
    m->Box({-x + 0.09f, at_y - 0.01f, low}, {x - 0.09f, at_y + 0.01f, m->height - kTopM});
    const float at_x = side * (x - 0.06f);
    m->Box({at_x - 0.01f, -y + 0.09f, low}, {at_x + 0.01f, y - 0.09f, m->height - kTopM});
  }
}

void DrawCoffeeTable(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kWood, m->color);
  DrawTop(m, 0.04f);
  m->Box({-x + 0.05f, -y + 0.05f, 0.12f}, {x - 0.05f, y - 0.05f, 0.14f});
  m->Use(Material::kMetal, kDark);
  m->Legs(m->height - 0.04f, 0.04f, 0.02f);
  m->Use(Material::kPaper, {206, 198, 186, 255});
  m->Box({-0.6f * x, -0.5f * y, 0.14f}, {-0.2f * x, 0.4f * y, 0.17f});
}

void DrawCounter(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kWood, m->color);
  m->Box({-x, -y, 0.1f}, {x, y - 0.03f, m->height - 0.04f});
  DrawFronts(m, 0.1f, m->height - 0.05f, 4, 2);
  m->Use(Material::kPlastic, kDark);
  m->Box({-x + 0.02f, -y, 0.0f}, {x - 0.02f, y - 0.08f, 0.1f});
  m->Use(Material::kTiles, {188, 184, 178, 255});
  DrawTop(m, 0.04f);
}

void DrawTvStand(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kWood, m->color);
  DrawTop(m, 0.025f);
  m->Box({-x, -y, 0.06f}, {x, y - 0.03f, 0.085f});
  m->Box({-x, -y, 0.06f}, {x, -y + 0.02f, m->height - 0.025f});
  for (int i = 0; i < 4; ++i) {
    const float at = -x + (m->width - 0.02f) * static_cast<float>(i) / 3.0f;
    m->Box({at, -y, 0.06f}, {at + 0.02f, y - 0.03f, m->height - 0.025f});
  }
  m->Use(Material::kMetal, kDark);
  m->Legs(0.06f, 0.04f, 0.04f);
  m->Box({-0.25f * x, -0.6f * y, 0.085f}, {0.25f * x, 0.5f * y, 0.17f}, 0.005f);
  m->Use(Material::kBooks, {150, 120, 100, 255});
  m->Box({-0.9f * x, -0.6f * y, 0.085f}, {-0.45f * x, 0.3f * y, 0.28f});
}

void DrawNightstand(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kWood, m->color);
  DrawTop(m, 0.02f);
  m->Box({-x, -y, 0.1f}, {x, y - 0.03f, m->height - 0.02f});
  m->Legs(0.1f, 0.03f, 0.01f);
  DrawFronts(m, 0.1f, m->height - 0.02f, 1, 2);
}

void DrawCabinet(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kMetal, m->color);
  m->Box({-x, -y, 0.05f}, {x, y - 0.03f, m->height}, 0.005f);
  m->Use(Material::kPlastic, kDark);
  m->Box({-x + 0.03f, -y, 0.0f}, {x - 0.03f, y - 0.06f, 0.05f});
  DrawFronts(m, 0.06f, m->height - 0.02f, 2, 3);
}

void DrawWardrobe(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kWood, m->color);
  m->Box({-x, -y, 0.06f}, {x, y - 0.03f, m->height}, 0.008f);
  m->Use(Material::kWood, Scaled(m->color, 0.6));
  m->Box({-x + 0.02f, -y, 0.0f}, {x - 0.02f, y - 0.05f, 0.06f});
  DrawFronts(m, 0.07f, 0.3f * m->height, 2, 1);
  DrawFronts(m, 0.3f * m->height, m->height - 0.03f, 3, 1);
}

}  // namespace

std::span<const ModelMaker> TableModels() {
  static constexpr ModelMaker kModels[] = {
      {"desk", DrawDesk},       {"table", DrawTable},      {"coffee table", DrawCoffeeTable},
      {"counter", DrawCounter}, {"tv stand", DrawTvStand}, {"nightstand", DrawNightstand},
      {"cabinet", DrawCabinet}, {"wardrobe", DrawWardrobe}};
  return kModels;
}

}  // namespace dsg::simulator
