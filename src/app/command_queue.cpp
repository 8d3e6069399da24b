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

// Takes every member by its name: a new one does not compile until it is joined here.
Commands joined(Commands all, const Commands& later) {
  const auto& [settings, scene, restart, toggle_pause, single_step, reset, launch, fly, compare, next_method,
               hold, back, seek_s, time_scale_factor, save_scene, max_steps, quit, split, second_max_steps,
               drop_future] = later;
  if (settings) all.settings = settings;
  if (!scene.empty()) all.scene = scene;
  if (restart) all.restart = restart;
  all.toggle_pause = all.toggle_pause != toggle_pause;
  all.single_step = all.single_step || single_step;
  all.reset = all.reset || reset;
  all.launch = all.launch || launch;
  if (fly) all.fly = fly;
  if (compare != Comparison::none) {
    all.compare = compare;
    all.next_method = next_method;
  }
  all.hold = hold;  // of the current picture
  all.back = all.back || back;
  if (seek_s) all.seek_s = seek_s;
  all.time_scale_factor *= time_scale_factor;
  if (!save_scene.empty()) all.save_scene = save_scene;
  if (max_steps) all.max_steps = max_steps;
  all.quit = all.quit || quit;
  if (split) all.split = split;
  if (second_max_steps) all.second_max_steps = second_max_steps;
  all.drop_future = all.drop_future || drop_future;
  return all;
}

}  // namespace pf
