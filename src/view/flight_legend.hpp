// The legend of the flights: a row of figures for each, with the colour of its path.
#pragma once

#include <imgui.h>

#include <string>
#include <vector>

#include "app/simulation.hpp"
#include "view/legend_columns.hpp"
#include "view/legend_place.hpp"
#include "view/look.hpp"
#include "view/px_rect.hpp"

namespace pf {

// The flights of a frame: the reference of the current launch, the current one, then the others, newest
// first. If several belong to the current launch, their columns apart and energy are filled; apart: the
// distance from the reference, final and largest, over the duration that it and all complete ones have in
// common. Where there are several flights at all, each has its cost.
std::vector<FlightRow> flight_rows(const FrameView& frame, Theme theme = Theme::dark);

class FlightLegend {
 public:
  static bool is_shown(const FrameView& frame, const Look& look);

  // Room for at least three flights, so that the world does not move with each; {0, 0} if it is not shown.
  // The width is that of the last frame. scale: pixels per layout pixel.
  LegendSize size(const FrameView& frame, const Look& look, float scale) const;

  // Takes the figures of the frame, every few frames, and chooses columns that fit into a width.
  void write(const FrameView& frame, const Look& look, float scale, float max_width_px);
  // Describes it to ImGui with its upper left corner there, margins included. Returns what it covers.
  PxRect paint(ImVec2 at, const FrameView& frame, const Look& look, float scale) const;

 private:
  void choose_columns();
  float columns_width(const std::vector<LegendColumn>& columns) const;
  float column_width(const LegendColumn& column) const;
  std::size_t num_rows(const std::vector<Ghost>* ghosts) const;
  void paint_cells(ImVec2 at, const Look& look, float scale) const;
  void paint_ghosts(ImVec2 at, const std::vector<Ghost>& ghosts, const Look& look, float scale) const;

  std::vector<FlightRow> rows_;
  std::string foot_;  // below the rows, or empty
  std::size_t num_foot_lines_ = 0;
  int level_ = 0;  // of legend_columns()
  float max_width_px_ = 0.0F;
  float scale_ = 0.0F;
  bool is_resized_ = false;
  std::vector<LegendColumn> columns_;
  std::vector<float> widths_px_;  // of the columns; 0: an empty one
  float text_width_px_ = 0.0F;    // of all columns
  double layout_width_ = 320.0;   // with margins, in layout pixels, rounded up
  std::int64_t written_flight_ = -1;
  int frames_since_ = 0;
};

}  // namespace pf
