// Label and colour of each phase, and the phases that a method's step has.
#pragma once

#include <array>
#include <span>

#include "core/timing.hpp"
#include "model/physics.hpp"

namespace pf {

struct PhaseStyle {
  Phase phase;
  const char* label;
  std::array<std::uint8_t, 3> color;  // sRGB
};

// In the order of Phase. Colour-blind eyes can tell apart any two that are shown together: they are at least
// 20 apart in CIELAB under protanopia, deuteranopia and tritanopia (Machado, Oliveira and Fernandes 2009).
constexpr std::array<PhaseStyle, kNumPhases> kPhaseStyles = {
    {{Phase::sort, "sort", {74, 72, 180}},
     {Phase::grid, "grid", {119, 202, 250}},
     {Phase::collide_integrate, "collide", {43, 124, 91}},
     {Phase::ball, "ball", {244, 211, 64}},
     {Phase::predict, "predict", {10, 124, 90}},
     {Phase::solve, "solve", {158, 255, 86}},
     {Phase::reconcile, "reconcile", {170, 83, 31}},
     {Phase::commit, "commit", {255, 203, 157}},
     {Phase::map, "map", {193, 100, 176}},
     {Phase::unmap, "unmap", {162, 83, 255}},
     {Phase::draw, "draw", {253, 94, 140}},
     {Phase::panel, "panel", {148, 134, 237}},
     {Phase::present, "present", {94, 56, 126}},
     {Phase::encode, "encode", {237, 145, 81}}}};

constexpr bool styles_follow_enum() {
  for (std::size_t k = 0; k < kNumPhases; ++k) {
    if (static_cast<std::size_t>(kPhaseStyles[k].phase) != k) return false;
  }
  return true;
}
static_assert(styles_follow_enum());

constexpr const PhaseStyle& style_of(Phase phase) { return kPhaseStyles[static_cast<std::size_t>(phase)]; }

// The phases that take a row of the overlay: of a step by this method, and of its picture.
inline std::span<const Phase> step_phases(Method method) {
  static constexpr Phase kTimeStep[] = {Phase::sort, Phase::grid, Phase::collide_integrate, Phase::ball};
  static constexpr Phase kExact[] = {Phase::sort,  Phase::grid,      Phase::predict,
                                     Phase::solve, Phase::reconcile, Phase::commit};
  if (method == Method::exact) return kExact;
  return kTimeStep;
}

inline std::span<const Phase> picture_phases() {
  static constexpr Phase kPicture[] = {Phase::map,   Phase::unmap,   Phase::draw,
                                       Phase::panel, Phase::present, Phase::encode};
  return kPicture;
}

}  // namespace pf
