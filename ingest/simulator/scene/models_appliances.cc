// SPDX-License-Identifier: Apache-2.0
// Machines: fridges, printers, screens, lamps.
#include <algorithm>

#include "ingest/simulator/scene/models.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

void DrawFridge(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float gap = 0.66f * m->height;
  m->Use(Material::kPlastic, m->color);
  m->Box({-x, -y, 0.04f}, {x, y - 0.1f, m->height}, 0.01f);
  m->Box({-x, y - 0.095f, 0.05f}, {x, y - 0.04f, gap - 0.006f}, 0.012f);
  m->Box({-x, y - 0.095f, gap + 0.006f}, {x, y - 0.04f, m->height}, 0.012f);
  m->Use(Material::kPlastic, kDark);
  m->Box({-x + 0.02f, -y + 0.02f, 0.0f}, {x - 0.02f, y - 0.12f, 0.04f});
  m->Use(Material::kMetal, kSteel);
  m->Box({-x + 0.05f, y - 0.04f, 0.4f * gap}, {-x + 0.08f, y, gap - 0.05f}, 0.006f);
  m->Box({-x + 0.05f, y - 0.04f, gap + 0.05f}, {-x + 0.08f, y, gap + 0.35f}, 0.006f);
  m->Use(Material::kPaper, {224, 214, 190, 255});
  m->Box({0.1f * x, y - 0.041f, gap + 0.1f}, {0.6f * x, y - 0.038f, gap + 0.35f});
}

void DrawMicrowave(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kMetal, m->color);
  m->Box({-x, -y, 0.01f}, {x, y - 0.04f, m->height}, 0.008f);
  m->Use(Material::kPlastic, kDark);
  m->Legs(0.012f, 0.03f, 0.02f);
  m->Box({-x + 0.01f, y - 0.05f, 0.02f}, {0.4f * x, y - 0.025f, m->height - 0.01f}, 0.006f);
  m->Use(Material::kPaper, {120, 126, 130, 255});
  m->Box({0.45f * x, y - 0.05f, 0.02f}, {x - 0.01f, y - 0.03f, m->height - 0.01f}, 0.004f);
  m->Use(Material::kMetal, kSteel);
  m->Box({0.3f * x, y - 0.03f, 0.06f}, {0.36f * x, y, m->height - 0.05f}, 0.004f);
}

void DrawCoffeeMachine(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kPlastic, m->color);
  m->Box({-x, -y, 0.0f}, {x, 0.1f * y, m->height}, 0.02f);
  m->Box({-x, -y, 0.68f * m->height}, {x, y, m->height}, 0.02f);
  m->Box({-x, -y, 0.0f}, {x, y, 0.08f * m->height}, 0.008f);
  m->Use(Material::kMetal, kSteel);
  m->Cylinder({0.0f, 0.5f * y, 0.56f * m->height}, 0.03f, 0.12f * m->height);
  m->Box({-0.8f * x, 0.15f * y, 0.08f * m->height}, {0.8f * x, 0.95f * y, 0.1f * m->height});
  m->Use(Material::kPlastic, kWhite);
  m->Cylinder({0.0f, 0.5f * y, 0.1f * m->height}, 0.035f, 0.2f * m->height);
  m->Use(Material::kPaper, {90, 140, 150, 255});
  m->Box({-0.5f * x, y - 0.01f, 0.76f * m->height}, {0.5f * x, y, 0.92f * m->height});
}

void DrawPrinter(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kPlastic, m->color);
  m->Box({-x, -y, 0.04f}, {x, y - 0.04f, 0.68f * m->height}, 0.015f);
  m->Box({-x, -y, 0.68f * m->height}, {0.3f * x, 0.6f * y, 0.8f * m->height}, 0.01f);
  m->Box({-x, -y, 0.8f * m->height}, {x, y, m->height}, 0.02f);
  m->Use(Material::kPlastic, kDark);
  m->Legs(0.05f, 0.06f, 0.02f);
  for (int i = 0; i < 3; ++i) {
    const float z = m->height * (0.1f + 0.18f * static_cast<float>(i));
    m->Box({-0.9f * x, y - 0.05f, z}, {0.9f * x, y - 0.03f, z + 0.14f * m->height}, 0.006f);
  }
  m->Use(Material::kPaper, {236, 236, 230, 255});
  m->Box({-0.7f * x, -0.6f * y, 0.69f * m->height}, {0.8f * x, 0.4f * y, 0.71f * m->height});
  m->Box({0.3f * x, 0.7f * y, 0.985f * m->height}, {0.8f * x, 0.98f * y, m->height});
}

// A screen on a foot; its picture is on the +y side.
void DrawScreen(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const float low = 0.1f * m->height;
  m->Use(Material::kPlastic, m->color);
  m->Box({-x, -0.3f * y, low}, {x, 0.3f * y, m->height}, 0.006f);
  m->Box({-0.08f * x, -0.4f * y, 0.01f}, {0.08f * x, 0.0f, low + 0.1f});
  m->Box({-0.4f * x, -y, 0.0f}, {0.4f * x, y, 0.015f}, 0.004f);
  m->Use(Material::kPaper, {70, 82, 104, 255});
  m->Box({-x + 0.015f, 0.2f * y, low + 0.02f}, {x - 0.015f, 0.31f * y, m->height - 0.015f});
}

void DrawLamp(Model* m) {
  const float radius = 0.5f * std::min(m->width, m->depth);
  const float low = m->height - std::min(0.35f, 0.3f * m->height);
  m->Use(Material::kMetal, kDark);
  m->Cylinder(Vector3f::Zero(), 0.75f * radius, 0.03f, 16);
  m->Cylinder({0.0f, 0.0f, 0.03f}, 0.015f, low, 8);
  m->Use(Material::kFabric, m->color);
  AddTurned({{radius, low},
             {0.65f * radius, m->height},
             {0.6f * radius, m->height},
             {0.95f * radius, low}},
            Vector3f::Zero(), Vector2f::Ones(), 20, m->mesh());
  m->Use(Material::kPlastic, {250, 244, 214, 255});
  AddTurned({{0.0f, low + 0.05f}, {0.04f, low + 0.1f}, {0.03f, low + 0.18f}, {0.0f, low + 0.2f}},
            Vector3f::Zero(), Vector2f::Ones(), 8, m->mesh());
}

}  // namespace

std::span<const ModelMaker> ApplianceModels() {
  static constexpr ModelMaker kModels[] = {
      {"fridge", DrawFridge},   {"microwave", DrawMicrowave}, {"coffee machine", DrawCoffeeMachine},
      {"printer", DrawPrinter}, {"tv", DrawScreen},           {"monitor", DrawScreen},
      {"lamp", DrawLamp}};
  return kModels;
}

}  // namespace dsg::simulator
