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

// Jacobi: each disc responds to the state before the step.
void PlainStepper::collide() {
  for (std::uint32_t i = 0; i < discs_.num(); ++i) collide_one(i);
  std::swap(discs_, next_);
}

void PlainStepper::collide_one(std::uint32_t i) {
  const float x = discs_.x[i], y = discs_.y[i], vx = discs_.vx[i], vy = discs_.vy[i];
  float push_x = 0.0F, push_y = 0.0F, change_x = 0.0F, change_y = 0.0F;
  const int column = cell_of(x), row = cell_of(y);
  const int last = cells_per_side_ - 1;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, last); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, last); ++c) {
      const auto cell = static_cast<std::size_t>(r * cells_per_side_ + c);
      for (std::uint32_t j = cell_start_[cell]; j < cell_start_[cell + 1]; ++j) {
        const float dx = discs_.x[j] - x, dy = discs_.y[j] - y;
        const float distance2 = dx * dx + dy * dy;
        if (distance2 >= 1.0F || j == i || distance2 == 0.0F) continue;
        const float distance = std::sqrt(distance2);
        const float nx = dx / distance, ny = dy / distance;
        push_x -= 0.5F * (1.0F - distance) * nx;
        push_y -= 0.5F * (1.0F - distance) * ny;
        const float approach = (discs_.vx[j] - vx) * nx + (discs_.vy[j] - vy) * ny;
        if (approach >= 0.0F) continue;
        change_x += approach * nx;  // equal masses, elastic: the normal components are exchanged
        change_y += approach * ny;
        ++num_seen_;
      }
    }
  }
  next_.x[i] = x + push_x;
  next_.y[i] = y + push_y;
  next_.vx[i] = vx + change_x;
  next_.vy[i] = vy + change_y;
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
