#include "view/gui_tiles.hpp"

#include <imgui.h>
#include <imgui_impl_opengl3.h>

#include <algorithm>
#include <bit>

namespace pf {
namespace {

// ImTextureID was a pointer before it was a number.
[[maybe_unused]] GLuint name_of(const void* id) {
  return static_cast<GLuint>(reinterpret_cast<std::uintptr_t>(id));
}
[[maybe_unused]] GLuint name_of(std::uint64_t id) { return static_cast<GLuint>(id); }

// From 1.92 on, Dear ImGui makes its textures when they are drawn.
void make_textures([[maybe_unused]] ImDrawData& data) {
#if IMGUI_VERSION_NUM >= 19200
  if (data.Textures == nullptr) return;
  for (ImTextureData* texture : *data.Textures) {
    if (texture->Status != ImTextureStatus_OK) ImGui_ImplOpenGL3_UpdateTexture(texture);
  }
#endif
}

void append(const ImDrawVert& vertex, std::vector<std::uint32_t>& words) {
  for (const float part : {vertex.pos.x, vertex.pos.y, vertex.uv.x, vertex.uv.y})
    words.push_back(std::bit_cast<std::uint32_t>(part));
  words.push_back(vertex.col);
}

// Cuts to the clip rectangle, of whole pixels in the picture, within the tile. False if nothing is left.
bool set_scissor(const ImVec4& clip, const Viewport& viewport) {
  const int left = static_cast<int>(clip.x) - viewport.origin_px.x;
  const int right = static_cast<int>(clip.z) - viewport.origin_px.x;
  const int bottom = viewport.picture_height - static_cast<int>(clip.w) - viewport.origin_px.y;
  const int top = viewport.picture_height - static_cast<int>(clip.y) - viewport.origin_px.y;
  const int x0 = std::max(left, 0);
  const int y0 = std::max(bottom, 0);
  const int x1 = std::min(right, viewport.size.width);
  const int y1 = std::min(top, viewport.size.height);
  if (x1 <= x0 || y1 <= y0) return false;
  glScissor(x0, y0, x1 - x0, y1 - y0);
  return true;
}

}  // namespace

GuiTiles::GuiTiles() : program_(load_program("gui")), empty_array_(make_vertex_array()) {}

void GuiTiles::draw(ImDrawData& data, const Viewport& viewport) {
  make_textures(data);
  glBindFramebuffer(GL_FRAMEBUFFER, viewport.framebuffer);
  glViewport(0, 0, viewport.size.width, viewport.size.height);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glEnable(GL_SCISSOR_TEST);
  glUseProgram(program_.get());
  glBindVertexArray(empty_array_.get());
  set_uniform(program_, "origin_px",
              Vec2f{static_cast<float>(viewport.origin_px.x), static_cast<float>(viewport.origin_px.y)});
  set_uniform(program_, "size_px",
              Vec2f{static_cast<float>(viewport.size.width), static_cast<float>(viewport.size.height)});
  set_uniform(program_, "picture_height_px", static_cast<float>(viewport.picture_height));
  set_uniform(program_, "font", 0);
  upload(data);
  GLint first = 0;
  for (int i = 0; i < data.CmdListsCount; ++i) {
    for (const ImDrawCmd& command : data.CmdLists[i]->CmdBuffer) {
      const auto num = static_cast<GLsizei>(2 * command.ElemCount);  // a rectangle around each triangle
      if (command.UserCallback == nullptr && num > 0 && set_scissor(command.ClipRect, viewport)) {
        glBindTextureUnit(0, name_of(command.GetTexID()));
        glDrawArrays(GL_TRIANGLES, first, num);
      }
      first += num;
    }
  }
  glDisable(GL_SCISSOR_TEST);
}

// All corners at once, in a buffer of their own: a software rasteriser may still read those of an earlier
// draw.
void GuiTiles::upload(const ImDrawData& data) {
  words_.clear();
  for (int i = 0; i < data.CmdListsCount; ++i) {
    const ImDrawList& list = *data.CmdLists[i];
    for (const ImDrawCmd& command : list.CmdBuffer) {
      for (unsigned k = 0; k < command.ElemCount; ++k) {
        const unsigned index = list.IdxBuffer[static_cast<int>(command.IdxOffset + k)];
        append(list.VtxBuffer[static_cast<int>(command.VtxOffset + index)], words_);
      }
    }
  }
  if (words_.empty()) return;
  corners_ = make_buffer();
  glNamedBufferStorage(corners_.get(), static_cast<GLsizeiptr>(words_.size() * sizeof(std::uint32_t)),
                       words_.data(), 0);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, corners_.get());
}

}  // namespace pf
