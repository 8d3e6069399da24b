#include "view/window_input.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <cmath>

#include "view/gui.hpp"

namespace pf {
namespace {

WindowInput& self(GLFWwindow* window) { return *static_cast<WindowInput*>(glfwGetWindowUserPointer(window)); }

// A switch pressed twice between two frames is as it was.
void flip(bool& value) { value = !value; }

struct KeyAction {
  int key;
  void (*apply)(InputFrame& input);
};

constexpr KeyAction kKeyActions[] = {
    {GLFW_KEY_SPACE, [](InputFrame& input) { flip(input.commands.toggle_pause); }},
    {GLFW_KEY_S, [](InputFrame& input) { input.commands.single_step = true; }},
    {GLFW_KEY_R, [](InputFrame& input) { input.commands.reset = true; }},
    {GLFW_KEY_L, [](InputFrame& input) { input.commands.launch = true; }},
    {GLFW_KEY_B, [](InputFrame& input) { input.commands.back = true; }},
    {GLFW_KEY_ESCAPE, [](InputFrame& input) { input.escape = true; }},
    {GLFW_KEY_H, [](InputFrame& input) { flip(input.toggle_panel); }},
    {GLFW_KEY_O, [](InputFrame& input) { input.next_overlay = true; }},
    {GLFW_KEY_T, [](InputFrame& input) { flip(input.toggle_path); }},
    {GLFW_KEY_G, [](InputFrame& input) { flip(input.toggle_ghosts); }},
    {GLFW_KEY_F, [](InputFrame& input) { input.fit = true; }},
    {GLFW_KEY_C, [](InputFrame& input) { input.next_color_map = true; }},
    {GLFW_KEY_D, [](InputFrame& input) { flip(input.next_theme); }},
    {GLFW_KEY_V, [](InputFrame& input) { flip(input.toggle_vsync); }},
    {GLFW_KEY_F11, [](InputFrame& input) { flip(input.toggle_full_screen); }},
    {GLFW_KEY_E, [](InputFrame& input) { input.measure_terms = true; }},
    {GLFW_KEY_F1, [](InputFrame& input) { flip(input.toggle_keys); }},
    {GLFW_KEY_F9, [](InputFrame& input) { flip(input.toggle_film); }},
    {GLFW_KEY_N, [](InputFrame& input) { flip(input.toggle_magnifier); }}};

void apply_key(int key, int mods, InputFrame& input) {
  if (key == GLFW_KEY_M)
    input.commands.compare = (mods & GLFW_MOD_SHIFT) != 0 ? Comparison::half_step : Comparison::next_method;
  if (key == GLFW_KEY_Z && (mods & GLFW_MOD_CONTROL) == 0) flip(input.toggle_follow);
  if (key == GLFW_KEY_F12) ((mods & GLFW_MOD_SHIFT) != 0 ? input.take_paths : input.take_picture) = true;
  for (const KeyAction& action : kKeyActions) {
    if (action.key == key) action.apply(input);
  }
}

// Signs come as letters, independent of the keyboard's layout. Comma and point replace brackets that are hard
// to reach.
void apply_letter(unsigned int letter, InputFrame& input) {
  switch (letter) {
    case '?':
      flip(input.toggle_keys);
      break;
    case '+':
    case '=':
      ++input.larger_text;
      break;
    case '-':
      --input.larger_text;
      break;
    case '[':
    case ',':
      input.commands.time_scale_factor *= 0.5;
      break;
    case ']':
    case '.':
      input.commands.time_scale_factor *= 2.0;
      break;
    default:
      break;
  }
}

}  // namespace

WindowInput::WindowInput(GLFWwindow* window) : window_(window) {
  glfwSetWindowUserPointer(window, this);
  glfwSetKeyCallback(window, on_key);
  glfwSetCharCallback(window, on_char);
  glfwSetScrollCallback(window, on_scroll);
  glfwSetMouseButtonCallback(window, on_button);
}

WindowInput::~WindowInput() {
  glfwSetKeyCallback(window_, nullptr);
  glfwSetCharCallback(window_, nullptr);
  glfwSetScrollCallback(window_, nullptr);
  glfwSetMouseButtonCallback(window_, nullptr);
}

void WindowInput::on_key(GLFWwindow* window, int key, int, int action, int mods) {
  if (action == GLFW_PRESS) self(window).keys_.emplace_back(key, mods);
}

void WindowInput::on_char(GLFWwindow* window, unsigned int letter) {
  self(window).letters_.push_back(letter);
}

void WindowInput::on_scroll(GLFWwindow* window, double, double y) { self(window).scrolled_ += y; }

void WindowInput::on_button(GLFWwindow* window, int button, int action, int) {
  if (action != GLFW_PRESS || button == GLFW_MOUSE_BUTTON_MIDDLE) return;
  constexpr double kDoubleClick_s = 0.3;
  WindowInput& input = self(window);
  const double now_s = glfwGetTime();
  input.pressed_ = true;
  input.pressed_button_ = button;
  input.double_clicked_ = now_s - input.pressed_at_s_ < kDoubleClick_s;
  input.pressed_at_s_ = now_s;
}

InputFrame WindowInput::take(const Gui& gui) {
  InputFrame input;
  input.pointer_px = pointer_px();
  if (!gui.wants_text()) {
    for (const auto& [key, mods] : keys_) apply_key(key, mods, input);
    for (const unsigned int letter : letters_) apply_letter(letter, input);
  }
  if (!gui.wants_mouse()) {
    constexpr double kZoomPerNotch = 1.15;
    input.zoom = std::pow(kZoomPerNotch, scrolled_);
    input.fit = input.fit || double_clicked_;
  }
  drag(gui, input);
  keys_.clear();
  letters_.clear();
  scrolled_ = 0.0;
  pressed_ = double_clicked_ = false;
  return input;
}

// A drag that began in the scene stays there even when the pointer crosses the panel.
void WindowInput::drag(const Gui& gui, InputFrame& input) {
  input.shift = glfwGetKey(window_, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
                glfwGetKey(window_, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
  if (pressed_ && !dragging_ && !gui.wants_mouse()) {
    dragging_ = true;
    dragged_button_ = pressed_button_;
    dragged_from_px_ = input.pointer_px;
    input.pressed_left = dragged_button_ == GLFW_MOUSE_BUTTON_LEFT;
  }
  if (!dragging_) return;
  input.drags_left = dragged_button_ == GLFW_MOUSE_BUTTON_LEFT;
  input.drag_px = input.pointer_px - dragged_from_px_;
  dragged_from_px_ = input.pointer_px;
  dragging_ = glfwGetMouseButton(window_, dragged_button_) == GLFW_PRESS;
  input.released = !dragging_;
}

// The cursor counts in screen units from the top left; a framebuffer may have more pixels than that.
Vec2d WindowInput::pointer_px() const {
  double x = 0.0;
  double y = 0.0;
  glfwGetCursorPos(window_, &x, &y);
  int window_width = 1;
  int window_height = 1;
  int width = 1;
  int height = 1;
  glfwGetWindowSize(window_, &window_width, &window_height);
  glfwGetFramebufferSize(window_, &width, &height);
  if (window_width <= 0 || window_height <= 0) return {};
  return {x * width / window_width, height - y * height / window_height};
}

}  // namespace pf
