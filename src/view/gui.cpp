#include "view/gui.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <dlfcn.h>
#include <fmt/format.h>
#include <imgui.h>
#include <imgui_impl_glfw.h>
#include <imgui_impl_opengl3.h>
#include <imgui_internal.h>  // closing a popup from outside of it

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/program_files.hpp"
#include "core/replace_file.hpp"
#include "view/gl.hpp"

namespace pf {
namespace {

constexpr float kFontHeight_px = 14.0F;
constexpr float kTitleHeight_px = 31.0F;  // of the last font, for titles

// Fonts that scale, the best first. Without any of them ImGui's own bitmap font is enlarged.
std::vector<std::filesystem::path> font_files() {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& folder : program_folders("fonts"))
    files.push_back(folder / "DejaVuSans.ttf");
  for (const char* file :
       {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
        "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf",
        "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf"})
    files.emplace_back(file);
  return files;
}

void load_font(float scale) {
  ImGuiIO& io = ImGui::GetIO();
  constexpr float kMaxFont_px = 140.0F;  // larger letters, of a large picture, are enlarged ones
  const float font_px = std::min(kFontHeight_px * scale, kMaxFont_px);
  io.FontGlobalScale = kFontHeight_px * scale / font_px;
  for (const std::filesystem::path& file : font_files()) {
    std::error_code error;
    if (!std::filesystem::exists(file, error)) continue;
    // Latin, and the few signs that the labels use: minus, dots, multiplication.
    static const ImWchar kRanges[] = {0x0020, 0x00FF, 0x2010, 0x2027, 0x2190, 0x21FF, 0x2212, 0x2212, 0};
    if (io.Fonts->AddFontFromFileTTF(file.c_str(), font_px, nullptr, kRanges) == nullptr) continue;
    static const ImWchar kTitleRanges[] = {0x0020, 0x00FF, 0x2010, 0x2027, 0x2212, 0x2212, 0};
    io.Fonts->AddFontFromFileTTF(file.c_str(), kTitleHeight_px * font_px / kFontHeight_px, nullptr,
                                 kTitleRanges);
    return;
  }
  io.Fonts->AddFontDefault();
  io.FontGlobalScale = scale;
}

// Before 1.92 Dear ImGui keeps its font in one texture, which a font of another size replaces. Later versions
// make glyphs when they are drawn.
void drop_font_texture() {
#if IMGUI_VERSION_NUM < 19200
  ImGui_ImplOpenGL3_DestroyFontsTexture();
#endif
}

void make_font_texture() {
#if IMGUI_VERSION_NUM < 19200
  ImGui_ImplOpenGL3_CreateFontsTexture();
#endif
}

// From 1.92 on a letter enters the texture when it is first shown, and its edges depend a little on its place
// there. All letters enter at once, so that a picture does not depend on figures that were shown before it.
// Call after NewFrame.
void load_letters() {
#if IMGUI_VERSION_NUM >= 19200
  for (const float size : {0.8F, 0.85F, 0.9F, 0.92F, 1.0F, 1.25F}) {  // of texts over the scene
    ImFontBaked* letters = ImGui::GetFont()->GetFontBaked(size * ImGui::GetFontSize());
    for (ImWchar letter = ' '; letter <= '~'; ++letter) letters->FindGlyph(letter);
  }
#endif
}

struct GuiColors {
  ImVec4 ground, field, field_hot, field_active, accent, text, dim, border, grab, selection;
};

GuiColors gui_colors(Theme theme) {
  if (theme == Theme::light) {
    return {{0.957F, 0.969F, 0.973F, 0.97F}, {0.863F, 0.894F, 0.906F, 1.0F}, {0.792F, 0.843F, 0.863F, 1.0F},
            {0.722F, 0.792F, 0.820F, 1.0F},  {0.588F, 0.329F, 0.0F, 1.0F},   {0.086F, 0.129F, 0.157F, 1.0F},
            {0.329F, 0.404F, 0.443F, 1.0F},  {0.745F, 0.792F, 0.816F, 1.0F}, {0.165F, 0.471F, 0.502F, 1.0F},
            {0.60F, 0.78F, 0.83F, 0.8F}};
  }
  return {{0.055F, 0.090F, 0.114F, 0.96F}, {0.110F, 0.173F, 0.208F, 1.0F}, {0.149F, 0.239F, 0.282F, 1.0F},
          {0.176F, 0.290F, 0.337F, 1.0F},  {0.949F, 0.831F, 0.247F, 1.0F}, {0.886F, 0.914F, 0.918F, 1.0F},
          {0.545F, 0.620F, 0.647F, 1.0F},  {0.165F, 0.239F, 0.275F, 1.0F}, {0.404F, 0.714F, 0.733F, 1.0F},
          {0.25F, 0.47F, 0.53F, 0.7F}};
}

void set_colors(Theme theme, ImVec4* colors) {
  const GuiColors c = gui_colors(theme);
  colors[ImGuiCol_Text] = c.text;
  colors[ImGuiCol_TextDisabled] = c.dim;
  colors[ImGuiCol_WindowBg] = colors[ImGuiCol_PopupBg] = c.ground;
  colors[ImGuiCol_Border] = colors[ImGuiCol_Separator] = c.border;
  colors[ImGuiCol_FrameBg] = c.field;
  colors[ImGuiCol_FrameBgHovered] = c.field_hot;
  colors[ImGuiCol_FrameBgActive] = c.field_active;
  colors[ImGuiCol_Button] = colors[ImGuiCol_Header] = c.field;
  colors[ImGuiCol_ButtonHovered] = colors[ImGuiCol_HeaderHovered] = c.field_hot;
  colors[ImGuiCol_ButtonActive] = colors[ImGuiCol_HeaderActive] = c.field_active;
  colors[ImGuiCol_SliderGrab] = c.grab;
  colors[ImGuiCol_SliderGrabActive] = colors[ImGuiCol_CheckMark] = c.accent;
  colors[ImGuiCol_ScrollbarBg] = ImVec4(0.0F, 0.0F, 0.0F, 0.0F);
  colors[ImGuiCol_ScrollbarGrab] = c.field_hot;
  colors[ImGuiCol_TextSelectedBg] = c.selection;
}

}  // namespace

void ControlMap::note(const std::string& label) {
  const ImVec2 low = ImGui::GetItemRectMin();
  const ImVec2 high = ImGui::GetItemRectMax();
  rectangles_[label] = {low.x, low.y, high.x, high.y};
}

void ControlMap::note(const std::string& label, const std::array<float, 4>& rectangle) {
  rectangles_[label] = rectangle;
}

std::string ControlMap::text() const { return nlohmann::json(rectangles_).dump(1); }

void ControlMap::write(const std::filesystem::path& file) const {
  const std::string problem = replace_file(file, text() + '\n');
  if (problem.empty()) return;
  throw OutputError(
      fmt::format("{}: the panel map cannot be written ({}); choose another file", file.string(), problem));
}

namespace {

// Dear ImGui 1.92 closes its GL library whenever one of its contexts ends, and the next context to end calls
// into the closed library. So the library stays in memory.
void keep_gl_library() {
  for (const char* library : {"libOpenGL.so.0", "libGL.so.1", "libGL.so"})
    ::dlopen(library, RTLD_LAZY | RTLD_LOCAL | RTLD_NODELETE);
}

#if IMGUI_VERSION_NUM < 18700

// Dear ImGui before 1.87 sees only which keys are down when a frame begins. So a key that is pressed and
// released between two frames counts as down in the next one.
std::vector<int> pressed_keys;  // since the last frame
GLFWkeyfun key_callback_of_imgui = nullptr;

void note_key(GLFWwindow* window, int key, int scancode, int action, int mods) {
  if (action == GLFW_PRESS) pressed_keys.push_back(key);
  if (key_callback_of_imgui != nullptr) key_callback_of_imgui(window, key, scancode, action, mods);
}

void note_keys(GLFWwindow* window) { key_callback_of_imgui = glfwSetKeyCallback(window, note_key); }
void note_pointer(GLFWwindow* /*window*/) {}  // count_in_pixels() changes what the library has read

void begin_imgui_frame() {
  auto& down = ImGui::GetIO().KeysDown;
  std::vector<int> held;
  for (const int key : std::exchange(pressed_keys, {})) {
    if (key < 0 || key >= IM_ARRAYSIZE(down) || down[key]) continue;
    down[key] = true;
    held.push_back(key);
  }
  ImGui::NewFrame();
  for (const int key : held) down[key] = false;
}

#else

void note_keys(GLFWwindow* /*window*/) {}

// The library takes places of the pointer as events.
void note_pointer(GLFWwindow* window) {
  glfwSetCursorPosCallback(window, [](GLFWwindow* in, double x, double y) {
    SizePx pixels, units;
    glfwGetFramebufferSize(in, &pixels.width, &pixels.height);
    glfwGetWindowSize(in, &units.width, &units.height);
    if (units.width <= 0 || units.height <= 0) return;
    ImGui_ImplGlfw_CursorPosCallback(in, x * pixels.width / units.width, y * pixels.height / units.height);
  });
}

void begin_imgui_frame() { ImGui::NewFrame(); }

#endif

}  // namespace

Gui::Gui(GlContext& context) : Gui(context.window(), context.content_scale()) {}
Gui::Gui(float scale) : Gui(nullptr, scale) {}

Gui::Gui(GLFWwindow* window, float scale) : window_(window) {
  IMGUI_CHECKVERSION();
  ImGuiContext* before = ImGui::GetCurrentContext();
  imgui_ = ImGui::CreateContext();
  ImGui::SetCurrentContext(imgui_);
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // leaves no file in the current folder
  apply_style(Theme::dark, scale);
  if (window_ != nullptr) {
    ImGui_ImplGlfw_InitForOpenGL(window_, true);
    note_pointer(window_);
    note_keys(window_);
  }
  keep_gl_library();
  if (!ImGui_ImplOpenGL3_Init("#version 450 core")) {
    if (window_ != nullptr) ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext(imgui_);
    ImGui::SetCurrentContext(before);
    throw DeviceError("ImGui_ImplOpenGL3_Init: no GL for the panel; install libgl1 (Debian, Ubuntu)");
  }
  if (before != nullptr) ImGui::SetCurrentContext(before);
}

Gui::~Gui() {
  ImGuiContext* before = ImGui::GetCurrentContext();
  make_current();
  ImGui_ImplOpenGL3_Shutdown();
  if (window_ != nullptr) ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext(imgui_);
  ImGui::SetCurrentContext(before == imgui_ ? nullptr : before);
}

void Gui::make_current() { ImGui::SetCurrentContext(imgui_); }

void Gui::set_look(Theme theme, float scale) {
  if (theme == theme_ && scale == scale_) return;
  const bool is_rescaled = scale != scale_;
  if (is_rescaled) drop_font_texture();
  apply_style(theme, scale);
  if (is_rescaled) make_font_texture();
}

void Gui::apply_style(Theme theme, float scale) {
  ImGuiStyle& style = ImGui::GetStyle();
  style = ImGuiStyle();
  style.WindowRounding = 0.0F;
  style.FrameRounding = style.PopupRounding = 4.0F;
  style.GrabRounding = 2.0F;
  style.WindowBorderSize = 0.0F;
  style.FramePadding = ImVec2(8.0F, 3.5F);
  style.ItemSpacing = ImVec2(8.0F, 2.0F);
  style.WindowPadding = ImVec2(14.0F, 10.0F);
  style.GrabMinSize = 6.0F;
  style.ScrollbarSize = 10.0F;
  set_colors(theme, style.Colors);
  style.ScaleAllSizes(scale);
  if (scale != scale_) {
    ImGui::GetIO().Fonts->Clear();
    load_font(scale);
    is_rescaled_ = true;
  }
  theme_ = theme;
  scale_ = scale;
}

namespace {

// GLFW counts in screen units, which may be two pixels each (Wayland, macOS); this program counts in pixels.
void count_in_pixels(SizePx size) {
  ImGuiIO& io = ImGui::GetIO();
  if (io.DisplaySize.x <= 0.0F || io.DisplaySize.y <= 0.0F) return;
  const ImVec2 per_unit(static_cast<float>(size.width) / io.DisplaySize.x,
                        static_cast<float>(size.height) / io.DisplaySize.y);
#if IMGUI_VERSION_NUM < 18700
  if (ImGui::IsMousePosValid(&io.MousePos))
    io.MousePos = ImVec2(io.MousePos.x * per_unit.x, io.MousePos.y * per_unit.y);
#endif
  io.DisplaySize = ImVec2(static_cast<float>(size.width), static_cast<float>(size.height));
  io.DisplayFramebufferScale = ImVec2(1.0F, 1.0F);
}

}  // namespace

void Gui::begin_frame(SizePx size, double frame_s) {
  ImGui_ImplOpenGL3_NewFrame();
  if (window_ != nullptr) {
    ImGui_ImplGlfw_NewFrame();
    count_in_pixels(size);
  } else {
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize = ImVec2(static_cast<float>(size.width), static_cast<float>(size.height));
    io.DeltaTime = static_cast<float>(std::max(frame_s, 1e-4));
  }
  begin_imgui_frame();
  if (is_rescaled_) load_letters();
  is_rescaled_ = false;
}

void Gui::end_frame() { ImGui::Render(); }

void Gui::draw(unsigned int framebuffer, SizePx size) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, size.width, size.height);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

bool Gui::wants_mouse() const { return ImGui::GetIO().WantCaptureMouse; }
bool Gui::wants_text() const { return ImGui::GetIO().WantTextInput; }

bool Gui::has_popup() const {
  return ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
}

void Gui::show_hand() { ImGui::SetMouseCursor(ImGuiMouseCursor_Hand); }

void Gui::close_popups() {
  if (has_popup()) ImGui::ClosePopupToLevel(0, false);
}

}  // namespace pf
