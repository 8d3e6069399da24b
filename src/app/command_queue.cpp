#include "app/command_queue.hpp"

namespace pf {

bool starts_anew(const Commands& c) { return c.reset || !c.scene.empty() || c.restart; }

bool changes_anything(const Commands& c) { return c.single_step || !only_steps(c); }

bool only_steps(const Commands& c) {
  const bool presses =
      c.toggle_pause || c.launch || c.hold || c.back || c.seek_s || c.time_scale_factor != 1.0;
  const bool flies = c.fly || c.compare != Comparison::none;
  return !presses && !flies && !starts_anew(c) && !c.settings && !c.split && c.save_scene.empty();
}

Commands joined(Commands all, const Commands& later) {
  if (later.settings) all.settings = later.settings;
  if (!later.scene.empty()) all.scene = later.scene;
  if (later.restart) all.restart = later.restart;
  if (later.fly) all.fly = later.fly;
  if (later.compare != Comparison::none) {
    all.compare = later.compare;
    all.next_method = later.next_method;
  }
  if (!later.save_scene.empty()) all.save_scene = later.save_scene;
  if (later.split) all.split = later.split;
  if (later.seek_s) all.seek_s = later.seek_s;
  if (later.max_steps) all.max_steps = later.max_steps;
  if (later.second_max_steps) all.second_max_steps = later.second_max_steps;
  all.toggle_pause = all.toggle_pause != later.toggle_pause;
  all.single_step = all.single_step || later.single_step;
  all.reset = all.reset || later.reset;
  all.launch = all.launch || later.launch;
  all.back = all.back || later.back;
  all.drop_future = all.drop_future || later.drop_future;
  all.time_scale_factor *= later.time_scale_factor;
  all.quit = all.quit || later.quit;
  all.hold = later.hold;  // of the current picture
  return all;
}

}  // namespace pf
