// SPDX-License-Identifier: Apache-2.0
// Toilets, washbasins, bathtubs. They stand with -y to the wall.
#include "ingest/simulator/scene/models.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

void DrawToilet(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float seat = 0.5f * m->height;
  m->Use(Material::kPlastic, m->color);
  m->Box({-x, -y, seat - 0.03f}, {x, -y + 0.28f * m->depth, m->height - 0.02f}, 0.02f);
  m->Box({-0.45f * x, -y + 0.02f, 0.0f}, {0.45f * x, 0.3f * y, seat}, 0.03f);
  const Vector3f middle(0.0f, 0.28f * y, 0.0f);
  AddTurned({{0.0f, 0.0f},
             {0.55f, 0.0f},
             {0.6f, 0.4f * seat},
             {1.0f, 0.9f * seat},
             {1.0f, seat},
             {0.7f, seat},
             {0.45f, 0.6f * seat},
             {0.0f, 0.5f * seat}},
            middle, Vector2f(0.95f * x, 0.72f * y), 20, m->mesh());
  m->Use(Material::kPlastic, Scaled(m->color, 0.85));
  AddTurned({{0.66f, seat}, {1.0f, seat}, {1.0f, seat + 0.025f}, {0.66f, seat + 0.025f}}, middle,
            Vector2f(0.97f * x, 0.72f * y), 20, m->mesh());
  m->Use(Material::kMetal, kSteel);
  m->Cylinder({0.0f, -y + 0.14f * m->depth, m->height - 0.02f}, 0.03f, 0.02f);
}

void DrawWashbasin(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float rim = 0.9f * m->height;
  m->Use(Material::kPlastic, Scaled(m->color, 0.9));
  AddTurned({{0.0f, 0.0f}, {1.0f, 0.0f}, {0.7f, 0.75f * rim}, {0.0f, 0.75f * rim}},
            {0.0f, -0.3f * y, 0.0f}, Vector2f(0.28f * x, 0.4f * y), 14, m->mesh());
  m->Use(Material::kPlastic, m->color);
  AddTurned({{0.4f, 0.78f * rim},
             {0.95f, 0.93f * rim},
             {1.0f, rim},
             {0.86f, rim},
             {0.7f, 0.9f * rim},
             {0.0f, 0.85f * rim}},
            Vector3f::Zero(), Vector2f(x, y), 24, m->mesh());
  m->Use(Material::kMetal, kSteel);
  m->Cylinder({0.0f, -0.84f * y, rim - 0.02f}, 0.02f, 0.12f * m->height);
  m->Box({-0.015f, -0.84f * y, m->height - 0.03f}, {0.015f, -0.3f * y, m->height});
  for (const float side : {-1.0f, 1.0f}) {
    m->Cylinder({side * 0.1f, -0.84f * y, rim - 0.01f}, 0.018f, 0.05f, 8);
  }
}

void DrawBathtub(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float top = 0.92f * m->height;
  const float rim = 0.07f;
  m->Use(Material::kTiles, Scaled(m->color, 0.8));
  m->Box({-x, y - 0.03f, 0.0f}, {x, y, top - 0.03f});
  m->Box({-x, -y, 0.0f}, {-x + 0.03f, y, top - 0.03f});
  m->Box({x - 0.03f, -y, 0.0f}, {x, y, top - 0.03f});
  m->Use(Material::kPlastic, m->color);
  m->Box({-x, -y, top - 0.04f}, {x, -y + rim, top}, 0.01f);
  m->Box({-x, y - rim, top - 0.04f}, {x, y, top}, 0.01f);
  m->Box({-x, -y, top - 0.04f}, {-x + rim, y, top}, 0.01f);
  m->Box({x - rim, -y, top - 0.04f}, {x, y, top}, 0.01f);
  AddTurned({{1.02f, top - 0.01f}, {0.9f, 0.3f * top}, {0.6f, 0.15f * top}, {0.0f, 0.13f * top}},
            Vector3f::Zero(), Vector2f(1.08f * (x - rim), 1.2f * (y - rim)), 24, m->mesh());
  m->Use(Material::kMetal, kSteel);
  m->Box({-x + 0.02f, -0.03f, top - 0.01f}, {-x + 0.06f, 0.03f, m->height});
  m->Box({-x + 0.02f, -0.02f, m->height - 0.03f}, {-x + 0.2f, 0.02f, m->height});
}

}  // namespace

std::span<const ModelMaker> BathModels() {
  static constexpr ModelMaker kModels[] = {
      {"toilet", DrawToilet}, {"washbasin", DrawWashbasin}, {"bathtub", DrawBathtub}};
  return kModels;
}

}  // namespace dsg::simulator
