// Dear ImGui for one context: style, font, input, drawing; and the rectangle of each control.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "view/context.hpp"
#include "view/look.hpp"

struct ImGuiContext;

namespace pf {

// Rectangles of the controls of the last frame by label, in window pixels from the top left: x0, y0, x1, y1.
// Tests click by them.
class ControlMap {
 public:
  void clear() { rectangles_.clear(); }
  void note(const std::string& label);  // the rectangle of the widget made last
  void note(const std::string& label, const std::array<float, 4>& rectangle);
  std::string text() const;  // JSON {label: [x0, y0, x1, y1]}
  // Writes the text in one move, so that a reader never sees half a file. Throws UserError.
  void write(const std::filesystem::path& file) const;

 private:
  std::map<std::string, std::array<float, 4>> rectangles_;
};

class Gui {
 public:
  // Installs its GLFW callbacks around the window's own. The context must outlive it.
  explicit Gui(GlContext& context);
  // Without a window and without input, for pictures beside the window's; texts enlarged by scale. Calls of
  // it stand between its make_current and that of the window's Gui.
  explicit Gui(float scale);
  ~Gui();
  Gui(const Gui&) = delete;
  Gui& operator=(const Gui&) = delete;

  void make_current();  // for ImGui's functions; at first, the Gui that was made first
  void begin_frame(SizePx size, double frame_s);
  void end_frame();                                  // ends the description of the frame
  void draw(unsigned int framebuffer, SizePx size);  // draws the description

  // Sets the colours, and all sizes by scale in pixels per layout pixel. Another scale loads the font again.
  // Only between frames.
  void set_look(Theme theme, float scale);

  bool wants_mouse() const;
  bool wants_text() const;
  bool has_popup() const;  // a menu or a list is open
  void close_popups();
  void show_hand();  // as cursor, in this frame

 private:
  Gui(GLFWwindow* window, float scale);
  void apply_style(Theme theme, float scale);

  GLFWwindow* window_;
  ImGuiContext* imgui_;
  Theme theme_ = Theme::dark;
  float scale_ = 0.0F;
  bool is_rescaled_ = false;  // since the last frame
};

}  // namespace pf
