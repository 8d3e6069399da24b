// Two flights at once in the window: begins and ends the second one, lays out its picture, takes the mouse
// over it.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "app/flight_pair.hpp"
#include "view/gui.hpp"
#include "view/split_picture.hpp"
#include "view/window_input.hpp"

namespace pf {

class SplitView {
 public:
  using MakeTarget = std::function<std::unique_ptr<GlDrawTarget>(Backend& backend)>;

  // mode: of a second flight that a log begins.
  SplitView(FlightPair& pair, SplitMode mode, MakeTarget make)
      : pair_(pair), begun_mode_(mode), make_(std::move(make)) {}

  // There is a second flight.
  bool is_on() const { return pair_.second() != nullptr; }

  // Keys and panel: sets Commands::split when the choice has changed. A log's commands come later.
  void follow(const InputFrame& input, SplitSwitches& switches, Commands& commands);
  // After admit() of the pair: the switches show what flies now.
  void adopt(SplitSwitches& switches);
  // Takes drags of the divider out of the input, and moves input over the second half to the same place in
  // the first one.
  void take_mouse(InputFrame& input, const Camera& camera, Gui& gui, float scale);

  // The second flight's draw target; null: there is none.
  DrawTarget* target();
  // The window's region for the first flight, in the part that is free.
  ViewRegion lay_out(const ViewRegion& free, const Look& look, float scale);

  // For the film's picture; null: one flight alone. Valid until the next picture.
  const SplitScene* scene() const { return is_on() ? &scene_ : nullptr; }

  void draw_air(const Look& look, const Camera& camera, const Viewport& viewport);
  // All pictures of the frame have drawn the parcels.
  void air_is_drawn();
  void draw_flight(const Camera& camera, const Viewport& viewport);
  void describe(const Camera& camera, float height_px, float scale);
  // Height that the card of figures and the halves' names cover in the middle of the window's top; 0: none.
  float covered_at_top_px(const OverlayPlace& place, float height_px) const;
  // Rectangles of divider, card and halves for tests.
  void note(ControlMap& controls, float height_px) const;

 private:
  void take_divider(InputFrame& input, Gui& gui, float scale);

  FlightPair& pair_;
  SplitMode begun_mode_;
  MakeTarget make_;
  std::unique_ptr<GlDrawTarget> target_;
  std::string target_backend_;
  SplitPicture picture_;
  SplitScene scene_;
  SplitSwitches asked_;  // the choice that the pair was last asked for
  std::int64_t num_begun_ = 0;
  bool is_waiting_ = false;  // for the pair to begin or end it
  bool in_second_ = false;   // a drag that began over the second half
};

}  // namespace pf
