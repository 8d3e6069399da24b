#include "view/splat.hpp"

#include <algorithm>

namespace pf {
namespace {

constexpr std::uint32_t kGroup = 256;        // local_size_x of splat.comp
constexpr std::uint32_t kChunk = 1U << 23U;  // parcels per dispatch: 64 MiB, which every GL can bind

GlTexture make_counts(SizePx size) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  glTextureStorage2D(name, 1, GL_R32UI, size.width, size.height);
  return GlTexture(name);
}

void bind_chunk(GLuint index, GLuint buffer, GLintptr offset, std::size_t item, std::uint32_t first,
                std::uint32_t count) {
  glBindBufferRange(GL_SHADER_STORAGE_BUFFER, index, buffer, offset + static_cast<GLintptr>(item * first),
                    static_cast<GLsizeiptr>(item * count));
}

}  // namespace

Splat::Splat()
    : count_(load_compute_program("splat")),
      resolve_(load_program("fullscreen", "splat")),
      empty_array_(make_vertex_array()) {}

void Splat::resize(SizePx size) {
  if (counts_ && size == size_) return;
  size_ = size;
  counts_ = make_counts(size);
  speed_sums_ = make_counts(size);
}

void Splat::draw(const ParcelBuffers& parcels, std::uint32_t num_parcels, const SplatStyle& style,
                 SizePx size) {
  resize(size);
  const GLuint zero = 0;
  for (const GlTexture* image : {&counts_, &speed_sums_})
    glClearTexImage(image->get(), 0, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
  glBindImageTexture(0, counts_.get(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_R32UI);
  glBindImageTexture(1, speed_sums_.get(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_R32UI);
  glUseProgram(count_.get());
  glProgramUniform1f(count_.get(), glGetUniformLocation(count_.get(), "per_color_mps"), style.per_color_mps);
  for (std::uint32_t first = 0; first < num_parcels; first += kChunk) {
    const std::uint32_t count = std::min(kChunk, num_parcels - first);
    bind_chunk(0, parcels.position_buffer, parcels.position_offset, sizeof(Vec2f), first, count);
    bind_chunk(1, parcels.speed_buffer, parcels.speed_offset, sizeof(float), first, count);
    glProgramUniform1ui(count_.get(), glGetUniformLocation(count_.get(), "num_parcels"), count);
    glDispatchCompute((count + kGroup - 1) / kGroup, 1, 1);
  }
  glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  glProgramUniform1f(resolve_.get(), glGetUniformLocation(resolve_.get(), "alpha"), style.alpha);
  glUseProgram(resolve_.get());
  glBindVertexArray(empty_array_.get());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace pf
