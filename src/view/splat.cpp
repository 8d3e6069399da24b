#include "view/splat.hpp"

#include <algorithm>
#include <cmath>

namespace pf {
namespace {

constexpr std::uint32_t kGroup = 256;              // local_size_x of splat.comp
constexpr int kGroupWidth = 32, kGroupHeight = 8;  // local sizes of splat_resolve.comp
// Parcels that a thread counts where a pixel holds kRunPerPixel or more. Milliseconds of a picture
// on an H200, if a triangle blends it over the floor: 10^8 2.81 with 1, 0.86 with 4, 0.87 with 8, 3.06 with
// 16; 10^7 0.43, 0.40, 0.41, 0.55.
constexpr std::uint32_t kRun = 4;
constexpr double kRunPerPixel = 4.0;
constexpr std::uint32_t kChunk = 1U << 23U;  // parcels per dispatch: 64 MiB, which every GL can bind

// Far below 8191, the most that a pixel can count: the air in front of the ball is denser than the average.
constexpr double kMaxPerPixel = 500.0;

void bind_chunk(GLuint index, GLuint buffer, GLintptr offset, std::size_t item, std::uint32_t first,
                std::uint32_t count) {
  glBindBufferRange(GL_SHADER_STORAGE_BUFFER, index, buffer, offset + static_cast<GLintptr>(item * first),
                    static_cast<GLsizeiptr>(item * count));
}

}  // namespace

Splat::Splat() : count_(load_compute_program("splat")), resolve_(load_compute_program("splat_resolve")) {}

void Splat::resize(SizePx size) {
  if (pixels_ && size == size_) return;
  size_ = size;
  pixels_ = make_buffer();
  const GLsizeiptr bytes = 4LL * size.width * size.height;
  glNamedBufferStorage(pixels_.get(), bytes, nullptr, GL_DYNAMIC_STORAGE_BIT);
  const GLuint zero = 0;
  glClearNamedBufferData(pixels_.get(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
}

std::uint32_t Splat::one_in(const SplatStyle& style) {
  return static_cast<std::uint32_t>(std::max(1.0, std::ceil(style.per_pixel / kMaxPerPixel)));
}

void Splat::draw(const ParcelBuffers& parcels, std::uint32_t num_parcels, const SplatStyle& style,
                 const SplatPicture& picture) {
  resize(picture.size);
  const std::uint32_t one_in = Splat::one_in(style);
  const std::uint32_t per_thread = style.per_pixel / one_in >= kRunPerPixel ? kRun : 1;
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, pixels_.get());
  glUseProgram(count_.get());
  set_uniform(count_, "color_per_mps", style.color_per_mps);
  set_uniform(count_, "one_in", one_in);
  set_uniform(count_, "per_thread", per_thread);
  for (std::uint32_t first = 0; first < num_parcels; first += kChunk) {
    const std::uint32_t num = std::min(kChunk, num_parcels - first);
    bind_chunk(0, parcels.position_buffer, parcels.position_offset, sizeof(Vec2f), first, num);
    bind_chunk(1, parcels.speed_buffer, parcels.speed_offset, sizeof(float), first, num);
    set_uniform(count_, "num_parcels", num);
    const std::uint32_t num_counted = num / one_in + 1, per_group = kGroup * per_thread;
    glDispatchCompute((num_counted + per_group - 1) / per_group, 1, 1);
  }
  resolve(style, one_in, picture);
}

void Splat::draw(const std::vector<std::uint32_t>& pixels, std::uint32_t one_in, const SplatStyle& style,
                 const SplatPicture& picture) {
  resize(picture.size);
  glNamedBufferSubData(pixels_.get(), 0, static_cast<GLsizeiptr>(pixels.size() * sizeof(pixels[0])),
                       pixels.data());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, pixels_.get());
  resolve(style, one_in, picture);
}

void Splat::resolve(const SplatStyle& style, std::uint32_t one_in, const SplatPicture& picture) {
  set_uniform(resolve_, "alpha", style.alpha);
  set_uniform(resolve_, "one_in", static_cast<float>(one_in));
  set_uniform(resolve_, "in_place", picture.ground == picture.texture ? 1 : 0);
  glUseProgram(resolve_.get());
  glBindImageTexture(0, picture.texture, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA8);
  glBindImageTexture(1, picture.ground, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA8);
  // Waits for the counts, for the image below, and for earlier reads of the texture.
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  const auto groups = [](int pixels, int side) { return static_cast<GLuint>((pixels + side - 1) / side); };
  glDispatchCompute(groups(size_.width, kGroupWidth), groups(size_.height, kGroupHeight), 1);
  // Later drawing, copies and the next counts, which start at zero, wait for this pass.
  glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

}  // namespace pf
