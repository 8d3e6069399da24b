#include "view/window_input.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "view/gui.hpp"

namespace pf {
namespace {

WindowInput& self(GLFWwindow* window) { return *static_cast<WindowInput*>(glfwGetWindowUserPointer(window)); }

// Two presses between two frames cancel each other.
void flip(bool& value) { value = !value; }

template <int Number>
void go_to_cue(InputFrame& input) {
  input.go_to_cue = Number;
}

struct KeyAction {
  int key;
  void (*apply)(InputFrame& input);
  int mods = 0;
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
    {GLFW_KEY_X, [](InputFrame& input) { input.next_split = true; }},
    {GLFW_KEY_E, [](InputFrame& input) { input.measure_terms = true; }},
    {GLFW_KEY_F1, [](InputFrame& input) { flip(input.toggle_keys); }},
    {GLFW_KEY_F9, [](InputFrame& input) { flip(input.toggle_film); }},
    {GLFW_KEY_F10, [](InputFrame& input) { input.take_clip = true; }},
    {GLFW_KEY_F12, [](InputFrame& input) { input.take_picture = true; }},
    {GLFW_KEY_F12, [](InputFrame& input) { input.take_paths = true; }, GLFW_MOD_SHIFT},
    {GLFW_KEY_N, [](InputFrame& input) { flip(input.toggle_magnifier); }},
    {GLFW_KEY_M, [](InputFrame& input) { input.commands.compare = Comparison::next_method; }},
    {GLFW_KEY_M, [](InputFrame& input) { input.commands.compare = Comparison::half_step; }, GLFW_MOD_SHIFT},
    {GLFW_KEY_Z, [](InputFrame& input) { flip(input.toggle_follow); }},
    {GLFW_KEY_Z, [](InputFrame& input) { input.undo = true; }, GLFW_MOD_CONTROL},
    {GLFW_KEY_Z, [](InputFrame& input) { input.redo = true; }, GLFW_MOD_CONTROL | GLFW_MOD_SHIFT},
    {GLFW_KEY_Y, [](InputFrame& input) { input.redo = true; }, GLFW_MOD_CONTROL},
    {GLFW_KEY_PAGE_DOWN, [](InputFrame& input) { ++input.next_cue; }},
    {GLFW_KEY_PAGE_UP, [](InputFrame& input) { --input.next_cue; }},
    {GLFW_KEY_1, go_to_cue<1>},
    {GLFW_KEY_2, go_to_cue<2>},
    {GLFW_KEY_3, go_to_cue<3>},
    {GLFW_KEY_4, go_to_cue<4>},
    {GLFW_KEY_5, go_to_cue<5>},
    {GLFW_KEY_6, go_to_cue<6>},
    {GLFW_KEY_7, go_to_cue<7>},
    {GLFW_KEY_8, go_to_cue<8>},
    {GLFW_KEY_9, go_to_cue<9>}};

const KeyAction* action_of(int key, int mods) {
  for (const KeyAction& action : kKeyActions) {
    if (action.key == key && action.mods == mods) return &action;
  }
  return nullptr;
}

// Shift changes only some keys; a key with Ctrl is another one.
void apply_key(int key, int mods, InputFrame& input) {
  const KeyAction* action = action_of(key, mods & (GLFW_MOD_CONTROL | GLFW_MOD_SHIFT));
  if (action == nullptr && (mods & GLFW_MOD_CONTROL) == 0) action = action_of(key, 0);
  if (action != nullptr) action->apply(input);
}

// The key that bears the letter, whatever the keyboard's layout. One that bears a sign where others have a
// letter is no key: its sign comes as a letter. Where keys bear other scripts, their places count.
int key_of(int key, int scancode) {
  const char* name = glfwGetKeyName(key, scancode);
  if (name == nullptr || name[0] == '\0' || name[1] != '\0') return key;
  if (name[0] >= 'a' && name[0] <= 'z') return GLFW_KEY_A + (name[0] - 'a');
  return key >= GLFW_KEY_A && key <= GLFW_KEY_Z ? GLFW_KEY_UNKNOWN : key;
}

struct SignAction {
  unsigned char sign;
  void (*apply)(InputFrame& input);
};

// Signs come as letters, independent of the keyboard's layout. Comma and point replace brackets that are hard
// to reach, and the equals sign is a plus without Shift.
constexpr SignAction kSignActions[] = {
    {'?', [](InputFrame& input) { flip(input.toggle_keys); }},
    {'+', [](InputFrame& input) { ++input.larger_text; }},
    {'=', [](InputFrame& input) { ++input.larger_text; }},
    {'-', [](InputFrame& input) { --input.larger_text; }},
    {'[', [](InputFrame& input) { input.commands.time_scale_factor *= 0.5; }},
    {',', [](InputFrame& input) { input.commands.time_scale_factor *= 0.5; }},
    {']', [](InputFrame& input) { input.commands.time_scale_factor *= 2.0; }},
    {'.', [](InputFrame& input) { input.commands.time_scale_factor *= 2.0; }}};

bool is_bound(unsigned int letter) {
  return std::any_of(std::begin(kSignActions), std::end(kSignActions),
                     [letter](const SignAction& action) { return action.sign == letter; });
}

void apply_letter(unsigned int letter, InputFrame& input) {
  for (const SignAction& action : kSignActions) {
    if (action.sign == letter) action.apply(input);
  }
}

std::string name_of(const KeyAction& action) {
  std::string name;
  if ((action.mods & GLFW_MOD_CONTROL) != 0) name += "Ctrl+";
  if ((action.mods & GLFW_MOD_SHIFT) != 0) name += "Shift+";
  const int key = action.key;
  if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F25) return name + "F" + std::to_string(key - GLFW_KEY_F1 + 1);
  if (key == GLFW_KEY_SPACE) return name + "space";
  if (key == GLFW_KEY_ESCAPE) return name + "Esc";
  if (key == GLFW_KEY_PAGE_UP) return name + "PgUp";
  if (key == GLFW_KEY_PAGE_DOWN) return name + "PgDn";
  return name + static_cast<char>(key);  // letters and digits are as in ASCII
}

}  // namespace

std::vector<std::string> bound_keys() {
  std::vector<std::string> names;
  for (const KeyAction& action : kKeyActions) names.push_back(name_of(action));
  for (const SignAction& action : kSignActions) names.emplace_back(1, static_cast<char>(action.sign));
  return names;
}

WindowInput::WindowInput(GLFWwindow* window) : window_(window) {
  glfwSetWindowUserPointer(window, this);
  glfwSetKeyCallback(window, on_key);
  glfwSetCharCallback(window, on_char);
  glfwSetScrollCallback(window, on_scroll);
  glfwSetMouseButtonCallback(window, on_button);
  glfwSetDropCallback(window, on_drop);
}

WindowInput::~WindowInput() {
  glfwSetKeyCallback(window_, nullptr);
  glfwSetCharCallback(window_, nullptr);
  glfwSetScrollCallback(window_, nullptr);
  glfwSetMouseButtonCallback(window_, nullptr);
  glfwSetDropCallback(window_, nullptr);
}

void WindowInput::on_key(GLFWwindow* window, int key, int scancode, int action, int mods) {
  if (action == GLFW_PRESS) self(window).keys_.emplace_back(key_of(key, scancode), mods);
}

// Its key came before. On some keyboards digits write signs that do something, as AltGr with 8 does on a
// German one.
void WindowInput::on_char(GLFWwindow* window, unsigned int letter) {
  WindowInput& input = self(window);
  input.letters_.push_back(letter);
  const bool is_of_digit = !input.keys_.empty() && input.keys_.back().first >= GLFW_KEY_0 &&
                           input.keys_.back().first <= GLFW_KEY_9;
  if (is_of_digit && is_bound(letter)) input.keys_.pop_back();
}

void WindowInput::on_scroll(GLFWwindow* window, double, double y) { self(window).scrolled_ += y; }

void WindowInput::on_button(GLFWwindow* window, int button, int action, int) {
  if (action != GLFW_PRESS || button == GLFW_MOUSE_BUTTON_MIDDLE) return;
  constexpr double kDoubleClick_s = 0.3, kSamePlace_px = 8.0;
  WindowInput& input = self(window);
  const double now_s = glfwGetTime();
  Vec2d at_px;
  glfwGetCursorPos(window, &at_px.x, &at_px.y);
  const bool is_again =
      button == input.pressed_button_ && length(at_px - input.pressed_at_px_) < kSamePlace_px;
  input.pressed_ = true;
  input.pressed_button_ = button;
  input.double_clicked_ = is_again && now_s - input.pressed_at_s_ < kDoubleClick_s;
  input.pressed_at_px_ = at_px;
  input.pressed_at_s_ = now_s;
}

void WindowInput::on_drop(GLFWwindow* window, int num_files, const char* files[]) {
  self(window).dropped_.assign(files, files + num_files);
}

InputFrame WindowInput::take(const Gui& gui) {
  InputFrame input;
  input.pointer_px = pointer_px();
  input.is_new_gesture = pressed_ || !keys_.empty() || !letters_.empty() || !dropped_.empty();
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
  input.dropped = std::exchange(dropped_, {});
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
