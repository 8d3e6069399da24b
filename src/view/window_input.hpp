// Keys and mouse of a window, collected per frame. Keys come from GLFW's callbacks: Dear ImGui 1.86 has no
// queue, and a short press between two frames must not be lost.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "app/simulation.hpp"
#include "core/vec2.hpp"

struct GLFWwindow;

namespace pf {

class Gui;

struct InputFrame {
  Commands commands;
  bool escape = false;
  bool toggle_panel = false;
  bool next_overlay = false;
  bool toggle_path = false;
  bool toggle_ghosts = false;
  bool next_color_map = false;
  bool next_theme = false;
  bool toggle_vsync = false;
  bool toggle_full_screen = false;
  int larger_text = 0;  // steps
  bool fit = false;
  bool toggle_keys = false;  // the card of keys
  bool toggle_film = false;
  bool take_picture = false;
  bool take_paths = false;  // as SVG
  bool toggle_follow = false;
  bool toggle_magnifier = false;
  bool next_split = false;  // off, two halves, one picture
  bool measure_terms = false;
  int go_to_cue = 0;  // 1 to 9; 0: none
  int next_cue = 0;   // places further
  bool undo = false;
  bool redo = false;
  bool take_clip = false;
  std::vector<std::string> dropped;  // files
  bool is_new_gesture = false;       // a key or a button went down, or files were dropped
  bool pressed_left = false;         // in the scene, in this frame
  bool drags_left = false;           // a drag that began in the scene goes on, or ended in this frame
  bool released = false;             // it ended
  bool shift = false;
  Vec2d drag_px;      // since the last frame, upwards positive, of a drag that began in the scene
  double zoom = 1.0;  // > 1: nearer
  Vec2d pointer_px;   // from the lower left corner
};

// Every key that does something, as the table of keys names it: "space", "Shift+M", "F9", "[".
std::vector<std::string> bound_keys();

class WindowInput {
 public:
  // To be made before the Gui, which calls the callbacks that it finds. Takes the window's user pointer.
  explicit WindowInput(GLFWwindow* window);
  ~WindowInput();
  WindowInput(const WindowInput&) = delete;
  WindowInput& operator=(const WindowInput&) = delete;

  // All input since the last call, without the panel's.
  InputFrame take(const Gui& gui);

 private:
  static void on_key(GLFWwindow* window, int key, int scancode, int action, int mods);
  static void on_char(GLFWwindow* window, unsigned int letter);
  static void on_scroll(GLFWwindow* window, double x, double y);
  static void on_button(GLFWwindow* window, int button, int action, int mods);

  static void on_drop(GLFWwindow* window, int num_files, const char* files[]);

  Vec2d pointer_px() const;
  void drag(const Gui& gui, InputFrame& input);

  GLFWwindow* window_;
  std::vector<std::pair<int, int>> keys_;  // key, modifiers
  std::vector<unsigned int> letters_;
  std::vector<std::string> dropped_;
  double scrolled_ = 0.0;
  bool pressed_ = false;
  int pressed_button_ = 0;
  bool double_clicked_ = false;
  double pressed_at_s_ = -1.0;
  Vec2d pressed_at_px_;  // in GLFW's screen coordinates
  bool dragging_ = false;
  int dragged_button_ = 0;
  Vec2d dragged_from_px_;
};

}  // namespace pf
