#include "bench/plain_stepper.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pf::test {

PlainStepper::PlainStepper(float side, PlainDiscs discs)
    : side_(side),
      cells_per_side_(std::max(1, static_cast<int>(side))),
      cells_per_diameter_(static_cast<float>(cells_per_side_) / side),
      discs_(std::move(discs)),
      next_(discs_.num()),
      cell_(discs_.num()),
      cell_start_(static_cast<std::size_t>(cells_per_side_) * static_cast<std::size_t>(cells_per_side_) + 1),
      cursor_(cell_start_.size()) {}

void PlainStepper::step(float dt_s) {
  sort_into_cells();
  collide();
  move(dt_s);
}

int PlainStepper::cell_of(float position) const {
  return std::clamp(static_cast<int>(position * cells_per_diameter_), 0, cells_per_side_ - 1);
}

void PlainStepper::sort_into_cells() {
  std::fill(cell_start_.begin(), cell_start_.end(), 0U);
  for (std::size_t i = 0; i < discs_.num(); ++i) {
    cell_[i] = static_cast<std::uint32_t>(cell_of(discs_.y[i]) * cells_per_side_ + cell_of(discs_.x[i]));
    ++cell_start_[cell_[i] + 1];
  }
  for (std::size_t c = 1; c < cell_start_.size(); ++c) cell_start_[c] += cell_start_[c - 1];
  cursor_ = cell_start_;
  for (std::size_t i = 0; i < discs_.num(); ++i) {
    const std::uint32_t to = cursor_[cell_[i]]++;
    next_.x[to] = discs_.x[i];
    next_.y[to] = discs_.y[i];
    next_.vx[to] = discs_.vx[i];
    next_.vy[to] = discs_.vy[i];
  }
  std::swap(discs_, next_);
}

// Jacobi: each disc responds to the state before the step. Each pair is met once: in the same cell, or from
// the lower left of two neighbouring cells.
void PlainStepper::collide() {
  next_ = discs_;
  const int last = cells_per_side_ - 1;
  for (int row = 0; row <= last; ++row) {
    for (int column = 0; column <= last; ++column) {
      const int cell = row * cells_per_side_ + column;
      for (std::uint32_t i = cell_start_[cell]; i < cell_start_[cell + 1]; ++i) {
        for (std::uint32_t j = i + 1; j < cell_start_[cell + 1]; ++j) collide_pair(i, j);
        if (column < last) collide_with(i, cell + 1, cell + 1);
        if (row < last) {
          const int above = cell + cells_per_side_;
          collide_with(i, column > 0 ? above - 1 : above, column < last ? above + 1 : above);
        }
      }
    }
  }
  std::swap(discs_, next_);
}

void PlainStepper::collide_with(std::uint32_t i, int first_cell, int last_cell) {
  for (std::uint32_t j = cell_start_[first_cell]; j < cell_start_[last_cell + 1]; ++j) collide_pair(i, j);
}

inline void PlainStepper::collide_pair(std::uint32_t i, std::uint32_t j) {
  const float dx = discs_.x[j] - discs_.x[i], dy = discs_.y[j] - discs_.y[i];
  const float distance2 = dx * dx + dy * dy;
  if (distance2 >= 1.0F || distance2 == 0.0F) return;
  const float distance = std::sqrt(distance2);
  const float nx = dx / distance, ny = dy / distance;
  const float push = 0.5F * (1.0F - distance);
  next_.x[i] -= push * nx;
  next_.y[i] -= push * ny;
  next_.x[j] += push * nx;
  next_.y[j] += push * ny;
  const float approach = (discs_.vx[j] - discs_.vx[i]) * nx + (discs_.vy[j] - discs_.vy[i]) * ny;
  if (approach >= 0.0F) return;
  next_.vx[i] += approach * nx;  // equal masses, elastic: the normal components are exchanged
  next_.vy[i] += approach * ny;
  next_.vx[j] -= approach * nx;
  next_.vy[j] -= approach * ny;
  ++num_collisions_;
}

// Walls reflect centres at half a diameter.
void PlainStepper::move(float dt_s) {
  const auto along = [&](float& position, float& velocity) {
    position += velocity * dt_s;
    const float low = 0.5F, high = side_ - 0.5F;
    if ((position < low && velocity < 0.0F) || (position > high && velocity > 0.0F)) velocity = -velocity;
    position = std::clamp(position, low, high);
  };
  for (std::size_t i = 0; i < discs_.num(); ++i) {
    along(discs_.x[i], discs_.vx[i]);
    along(discs_.y[i], discs_.vy[i]);
  }
}

}  // namespace pf::test
