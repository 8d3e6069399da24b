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
Commands joined(Commands earlier, const Commands& later) {
  const auto& [settings, scene, restart, toggle_pause, single_step, reset, launch, fly, compare, next_method,
               hold, back, seek_s, time_scale_factor, save_scene, max_steps, quit, split, second_max_steps,
               drop_future] = later;
  if (restart || !scene.empty()) {  // they replace the flight that these were for
    earlier.settings.reset();
    earlier.fly.reset();
    earlier.seek_s.reset();
    earlier.compare = Comparison::none;
    earlier.launch = earlier.back = false;
    earlier.time_scale_factor = 1.0;
  }
  if (settings) earlier.settings = settings;
  if (!scene.empty()) earlier.scene = scene;
  if (restart) earlier.restart = restart;
  earlier.toggle_pause = earlier.toggle_pause != toggle_pause;
  earlier.single_step = earlier.single_step || single_step;
  earlier.reset = earlier.reset || reset;
  earlier.launch = earlier.launch || launch;
  if (fly) earlier.fly = fly;
  if (compare != Comparison::none) {
    earlier.compare = compare;
    earlier.next_method = next_method;
  }
  earlier.hold = hold;  // of the current picture
  earlier.back = earlier.back || back;
  if (seek_s) earlier.seek_s = seek_s;
  earlier.time_scale_factor *= time_scale_factor;
  if (!save_scene.empty()) earlier.save_scene = save_scene;
  if (max_steps) earlier.max_steps = max_steps;
  earlier.quit = earlier.quit || quit;
  if (split) earlier.split = split;
  if (second_max_steps) earlier.second_max_steps = second_max_steps;
  earlier.drop_future = earlier.drop_future || drop_future;
  return earlier;
}

}  // namespace pf
