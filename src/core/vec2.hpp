// Two-component vectors of one scalar type. Plain data, the same on host and device.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/host_device.hpp"

namespace pf {

template <class T>
struct Vec2 {
  T x{};
  T y{};

  PF_HD constexpr Vec2 operator+(Vec2 o) const { return {x + o.x, y + o.y}; }
  PF_HD constexpr Vec2 operator-(Vec2 o) const { return {x - o.x, y - o.y}; }
  PF_HD constexpr Vec2 operator-() const { return {-x, -y}; }
  PF_HD constexpr Vec2 operator*(T s) const { return {x * s, y * s}; }
  PF_HD constexpr Vec2& operator+=(Vec2 o) { return *this = *this + o; }
  PF_HD constexpr Vec2& operator-=(Vec2 o) { return *this = *this - o; }
  constexpr bool operator==(const Vec2&) const = default;
};

using Vec2d = Vec2<double>;
using Vec2f = Vec2<float>;
using Vec2i = Vec2<std::int32_t>;

template <class T>
PF_HD constexpr T dot(Vec2<T> a, Vec2<T> b) {
  return a.x * b.x + a.y * b.y;
}

PF_HD inline double length(Vec2d a) { return sqrt(dot(a, a)); }

// z component of the three-dimensional cross product.
template <class T>
PF_HD constexpr T cross(Vec2<T> a, Vec2<T> b) {
  return a.x * b.y - a.y * b.x;
}

// z-hat cross a, which turns a left by a right angle.
template <class T>
PF_HD constexpr Vec2<T> perpendicular(Vec2<T> a) {
  return {-a.y, a.x};
}

template <class T>
PF_HD constexpr Vec2d to_double(Vec2<T> a) {
  return {static_cast<double>(a.x), static_cast<double>(a.y)};
}

PF_HD constexpr Vec2f to_float(Vec2d a) { return {static_cast<float>(a.x), static_cast<float>(a.y)}; }

}  // namespace pf
