// The figures of two flights and how they differ, on a card; names at the halves or at the balls.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "app/flight_pair.hpp"
#include "view/look.hpp"
#include "view/overlay.hpp"
#include "view/split_layout.hpp"

namespace pf {

// A row of the card.
struct SplitRow {
  std::string name, distance, energy, cost;
};

// A row of heads, one for each flight, and one of the differences. pair: with a second flight.
std::vector<SplitRow> split_rows(const FlightPair& pair);

// Colours of both flights: of their methods if these differ.
struct SplitColors {
  Rgb first, second;
};
SplitColors split_colors(Theme theme, const FlightPair& pair);

class SplitCard {
 public:
  // In pixels, margins included, of the last write(); smaller letters where it would be wider than max_px.
  // scale: pixels per layout pixel.
  LegendSize fit(double max_px, float scale);
  // Takes the figures of the frame; every few frames, so that they can be read.
  void write(const FlightPair& pair, float scale);
  // Describes it to ImGui. at: upper left corner on the screen, margins included.
  void paint(ImVec2 at, const SplitColors& colors, Theme theme, float scale) const;

 private:
  static constexpr std::size_t kNumColumns = 4;
  static constexpr double kMinWidth = 340.0;

  LegendSize size(float scale) const;

  std::vector<SplitRow> rows_;
  std::array<float, kNumColumns> widths_px_{};
  float reduced_ = 1.0F;             // size of its letters, of the usual one
  double layout_width_ = kMinWidth;  // with margins, in layout pixels, rounded up
  std::int64_t written_for_ = -1;
  int frames_since_ = 0;
};

}  // namespace pf
