#include "view/legend_columns.hpp"

namespace pf {
namespace {

// A column, shown at levels from there_from up to, not including, gone_from.
struct Leaving {
  LegendColumn column;
  int gone_from;
  int there_from = 0;
};

constexpr int kNever = kMaxLegendLevel + 1;

const Leaving kLeaving[] = {
    {{&FlightRow::number, "", false}, kNever},
    {{&FlightRow::method, "method", false}, kNamesAlone},
    {{&FlightRow::name, "method", false}, kNever, kNamesAlone},
    {{&FlightRow::speed, "m/s", true}, 2},
    {{&FlightRow::spin, "rad/s", true}, 1},
    {{&FlightRow::apart, "distance: final, max", true}, 4},
    {{&FlightRow::apart_end, "distance", true}, 8, 4},
    {{&FlightRow::energy, "energy drift", true}, 5},
    {{&FlightRow::energy, "drift", true}, 7, 5},
    {{&FlightRow::cost, "cost / s", true}, 6},
};

}  // namespace

std::vector<LegendColumn> legend_columns(int level) {
  std::vector<LegendColumn> columns;
  for (const Leaving& leaving : kLeaving) {
    if (level >= leaving.there_from && level < leaving.gone_from) columns.push_back(leaving.column);
  }
  return columns;
}

int fitting_legend_level(int min_level, float max_width_px, const std::function<float(int level)>& width_of) {
  int level = min_level;
  while (level < kMaxLegendLevel && width_of(level) > max_width_px) ++level;
  return level;
}

}  // namespace pf
