// Draws what is described to Dear ImGui in tiles of a larger picture, to the same pixels in any division.
#pragma once

#include <cstdint>
#include <vector>

#include "view/gl.hpp"
#include "view/renderer.hpp"

struct ImDrawData;

namespace pf {

class GuiTiles {
 public:
  GuiTiles();  // throws DeviceError if a shader is missing or does not compile

  // viewport: picture_height is the height of the whole picture. Leaves the description unchanged.
  void draw(ImDrawData& data, const Viewport& viewport);

 private:
  void upload(const ImDrawData& data);

  GlProgram program_;
  GlBuffer corners_;
  GlVertexArray empty_array_;
  std::vector<std::uint32_t> words_;
};

}  // namespace pf
