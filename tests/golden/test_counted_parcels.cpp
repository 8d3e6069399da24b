// Pictures of floor and counted parcels, drawn without a window, against the formula on the host.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>

#include "core/error.hpp"
#include "unit/frames.hpp"
#include "view/capture.hpp"
#include "view/color_map.hpp"
#include "view/renderer.hpp"
#include "view/world_images.hpp"

namespace pf {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr SizePx kSize = {203, 101};  // no multiple of a work group
constexpr double kMetresPerPx = 0.07;
constexpr double kParcelRadius_m = 0.03;  // 0.86 px wide
constexpr float kMaxSpeed_mps = 8.0F;

struct Parcels {
  std::vector<Vec2f> position_m;
  std::vector<float> speed_mps;

  void add(Vec2d at_m, float of_mps) {
    position_m.push_back(to_float(at_m));
    speed_mps.push_back(of_mps);
  }
};

// Counts on the host, as domains do.
class HostImages final : public ParcelImages {
 public:
  explicit HostImages(const Parcels& parcels) : parcels_(parcels) {}

  std::vector<std::uint32_t> count(const PixelGrid& grid, const CountStyle& style) override {
    std::vector<std::uint32_t> sums(std::size_t{grid.width} * grid.height);
    for (std::size_t i = 0; i < parcels_.position_m.size(); ++i) {
      const std::uint32_t pixel = pixel_of(grid, parcels_.position_m[i]);
      if (pixel != kNoPixel) sums.at(pixel) += pixel_share(style, parcels_.speed_mps[i]);
    }
    return sums;
  }
  std::vector<DrawnParcel> gather(const PixelGrid&) override { return {}; }

 private:
  const Parcels& parcels_;
};

GlBuffer uploaded(const auto& values) {
  GlBuffer buffer = make_buffer();
  glNamedBufferStorage(buffer.get(), static_cast<GLsizeiptr>(values.size() * sizeof(values[0])),
                       values.data(), 0);
  return buffer;
}

int largest_difference(const Bytes& a, const Bytes& b) {
  int largest = a.size() == b.size() ? 0 : 256;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(largest, std::abs(int{a[i]} - int{b[i]}));
  return largest;
}

class CountedParcels : public testing::Test {
 protected:
  void SetUp() override {
    setenv("PICKLEFLIGHT_SHADERS", PF_SHADERS, 0);
    try {
      context_ = open_offscreen({});
    } catch (const DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
    renderer_.emplace();
    camera_.metres_per_px = kMetresPerPx;
    camera_.anchor_px = {0.5 * kSize.width, 0.5 * kSize.height};
    frames_.settings.parcel_speed_mps = 0.25 * kMaxSpeed_mps;
    frames_.physics.parcels.radius_m = kParcelRadius_m;
  }
  void TearDown() override {
    renderer_.reset();
    canvas_ = {};
  }

  // None to three parcels a pixel, of speeds from 0 to beyond the scale, over floor and lines.
  Parcels everywhere() const {
    Parcels parcels;
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        for (int k = 0; k < (5 * x + 3 * y) % 4; ++k)
          parcels.add(camera_.to_world({x + 0.5, y + 0.5}), static_cast<float>((7 * x + y + 11 * k) % 10));
      }
    }
    return parcels;
  }

  Viewport whole() {
    canvas_.resize(kSize.width, kSize.height);
    return {canvas_.framebuffer(), canvas_.texture(), kSize};
  }

  Bytes drawn(const ParcelBuffers* buffers, const Viewport& viewport) {
    const std::array pink = {1.0F, 0.0F, 1.0F, 0.5F};  // every pixel is drawn, whatever was there
    glClearNamedFramebufferfv(viewport.framebuffer, GL_COLOR, 0, pink.data());
    renderer_->set_look(look_);
    renderer_->draw_air(frames_.view, buffers, camera_, viewport);
    return read_pixels(viewport.framebuffer, viewport.size);
  }

  Bytes drawn(const Parcels& parcels, const Viewport& viewport) {
    const GlBuffer positions = uploaded(parcels.position_m), speeds = uploaded(parcels.speed_mps);
    frames_.view.num_parcels = static_cast<std::uint32_t>(parcels.speed_mps.size());
    const ParcelBuffers buffers = {positions.get(), 0, speeds.get(), 0};
    return drawn(&buffers, viewport);
  }

  // Blends each pixel's parcels over what is there: of each image of the world in turn.
  Bytes formula(const Parcels& parcels, const Bytes& floor) const {
    const double diameter_px = 2.0 * kParcelRadius_m / kMetresPerPx;
    const double share = 0.25 * kPi * diameter_px * diameter_px;
    const double bare = 1.0 - 0.95 * std::pow(share, 0.75);  // what a parcel leaves of a ground
    const CountStyle style = {1.0F / kMaxSpeed_mps, 1};
    std::vector<double> values(floor.begin(), floor.end());
    for (const Camera& image : image_cameras(camera_, frames_.physics.world, {}, kSize, kParcelRadius_m)) {
      PixelGrid grid = {to_float(image.center_m), to_float(image.anchor_px), {}};
      grid.m_per_px = static_cast<float>(kMetresPerPx);
      grid.width = static_cast<std::uint32_t>(kSize.width);
      grid.height = static_cast<std::uint32_t>(kSize.height);
      const std::vector<std::uint32_t> sums = HostImages(parcels).count(grid, style);
      for (std::size_t i = 0; i < sums.size(); ++i) {
        const std::uint32_t count = sums[i] & 8191U;
        if (count == 0) continue;
        const double free = std::pow(bare, count);
        const Rgb color = speed_color(static_cast<float>(sums[i] >> 13U) / (63.0F * count), look_);
        for (std::size_t k = 0; k < 4; ++k) {
          const double over = k < 3 ? color.at(k) : 1.0;
          values[4 * i + k] = std::round(values[4 * i + k] * free + 255.0 * over * (1.0 - free));
        }
      }
    }
    return {values.begin(), values.end()};
  }

  std::unique_ptr<GlContext> context_;
  std::optional<Renderer> renderer_;
  ColorTarget canvas_;
  Frames frames_;
  Camera camera_;
  Look look_;
};

// One level is rounding: of the floats, and of the formula.
TEST_F(CountedParcels, LieOverTheFloorAsTheFormulaSays) {
  const Parcels parcels = everywhere();
  for (const Theme theme : {Theme::dark, Theme::light}) {
    look_.theme = theme;
    for (const bool transparent : {false, true}) {
      Viewport viewport = whole();
      viewport.transparent = transparent;
      const Bytes floor = drawn(nullptr, viewport);
      const auto [low, high] = std::minmax_element(floor.begin(), floor.end());
      EXPECT_GT(*high - *low, 60) << "it has lines";
      const Bytes picture = drawn(parcels, viewport);
      EXPECT_GT(largest_difference(picture, floor), 60);
      EXPECT_LE(largest_difference(picture, formula(parcels, floor)), 1)
          << "light " << (theme == Theme::light) << ", transparent " << transparent;
    }
  }
}

TEST_F(CountedParcels, EveryPictureCountsFromZero) {
  const Parcels parcels = everywhere();
  const Bytes first = drawn(parcels, whole());
  EXPECT_EQ(drawn(parcels, whole()), first);
  Parcels one;
  one.add({0.0, 0.0}, 3.0F);
  const Bytes floor = drawn(nullptr, whole());
  const Bytes picture = drawn(one, whole());
  const auto differs = [&](std::size_t i) {
    return !std::equal(&floor[4 * i], &floor[4 * i] + 4, &picture[4 * i]);
  };
  int num_different = 0;
  for (std::size_t i = 0; i < floor.size() / 4; ++i) num_different += differs(i) ? 1 : 0;
  EXPECT_EQ(num_different, 1);
}

TEST_F(CountedParcels, AreTheSameInAFramebufferWithoutATexture) {
  const Parcels parcels = everywhere();
  Viewport viewport = whole();
  const Bytes direct = drawn(parcels, viewport);
  viewport.texture = 0;
  EXPECT_EQ(drawn(parcels, viewport), direct);
}

TEST_F(CountedParcels, AreTheSameInATile) {
  const Parcels parcels = everywhere();
  const Bytes picture = drawn(parcels, whole());
  ColorTarget tile;
  constexpr SizePx kTile = {61, 37};
  constexpr Vec2i kOrigin = {90, 41};
  tile.resize(kTile.width, kTile.height);
  for (const GLuint texture : {tile.texture(), GLuint{0}}) {
    const Bytes part =
        drawn(parcels, {tile.framebuffer(), texture, kTile, 1.0F, kOrigin, kSize.height, false});
    Bytes expected;
    for (int y = 0; y < kTile.height; ++y) {
      const auto row = picture.begin() + 4 * ((kOrigin.y + y) * kSize.width + kOrigin.x);
      expected.insert(expected.end(), row, row + 4 * kTile.width);
    }
    EXPECT_EQ(part, expected);
  }
}

// Parcels beyond the world's edge share pixels with those of the next image, which is blended over them.
TEST_F(CountedParcels, OfSeveralImagesLieOverEachOther) {
  frames_.settings = test::court(1000, Boundary::periodic);
  frames_.settings.parcel_speed_mps = 0.25 * kMaxSpeed_mps;
  frames_.physics = derive_physics(frames_.settings);
  frames_.physics.parcels.radius_m = kParcelRadius_m;
  camera_.center_m = {3.0, 2.0};
  camera_.shows_images = true;
  const Parcels parcels = everywhere();
  ASSERT_GE(image_cameras(camera_, frames_.physics.world, {}, kSize, kParcelRadius_m).size(), 4U);
  for (const bool has_texture : {true, false}) {
    Viewport viewport = whole();
    if (!has_texture) viewport.texture = 0;
    const Bytes floor = drawn(nullptr, viewport);
    EXPECT_LE(largest_difference(drawn(parcels, viewport), formula(parcels, floor)), 1) << has_texture;
  }
}

TEST_F(CountedParcels, AreTheSameWhenTheyWereCountedElsewhere) {
  const Parcels parcels = everywhere();
  const Bytes picture = drawn(parcels, whole());
  HostImages images(parcels);
  const ParcelBuffers elsewhere = {0, 0, 0, 0, &images};
  EXPECT_EQ(drawn(&elsewhere, whole()), picture);
  EXPECT_EQ(drawn(parcels, whole()), picture) << "whose counts were zeroed, too";
}

}  // namespace
}  // namespace pf
