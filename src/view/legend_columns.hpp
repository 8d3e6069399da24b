// The columns of the legend of flights, and which of them are left where there is little room.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "view/look.hpp"

namespace pf {

// One flight as the legend shows it.
struct FlightRow {
  std::string number, method, speed, spin, apart, energy, cost;
  std::string name;         // of the method alone
  std::string apart_end;    // the final distance alone
  bool has_remark = false;  // beyond the method and its step; a star behind the name stands for it
  bool is_current = false;
  Rgb color{};
};

struct LegendColumn {
  std::string FlightRow::*cell;
  const char* head;
  bool is_number;  // aligned at the right
};

// Level 0 has all columns, kMaxLegendLevel only number and method. The compared figures are dropped last.
constexpr int kMaxLegendLevel = 8;
constexpr int kNamesAlone = 3;  // from this level on a method is its name, without remarks
std::vector<LegendColumn> legend_columns(int level);

// The first level from min_level on whose width is at most max_width_px, else the last.
int fitting_legend_level(int min_level, float max_width_px, const std::function<float(int level)>& width_of);

}  // namespace pf
