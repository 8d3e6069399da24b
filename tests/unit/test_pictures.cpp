// Drawings of paths, tiles of large pictures, and pictures with alpha.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "core/error.hpp"
#include "support/full_disk.hpp"
#include "temporary_folder.hpp"
#include "unit/frames.hpp"
#include "view/large_picture.hpp"
#include "view/path_svg.hpp"

namespace pf {
namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t num = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++num;
  return num;
}

TEST(PathSvg, HasCourtPathsAndBallInMetres) {
  Frames frames;
  frames.settings.description = "a < b & \"c\"\x01";
  frames.flight.points_m = {{-6.4F, -1.4F}, {0.0F, 0.5F}, {6.0F, 1.25F}};
  frames.old_flights.push_back(frames.flight);
  frames.view.ball.position_m = {6.0, 1.25};
  const std::vector<Ghost> ghosts = {{Air::vacuum, {{-6.4F, -1.4F}, {6.0F, -1.4F}}}};
  frames.view.ghosts = &ghosts;
  const std::string svg = path_svg(frames.view, {});
  EXPECT_EQ(count(svg, "<polyline"), 2U);
  EXPECT_NE(svg.find("points=\"-6.4,1.4 0,-0.5 6,-1.25\""), std::string::npos) << svg;
  EXPECT_NE(svg.find("<circle cx=\"6\" cy=\"-1.25\" r=\"0.185\""), std::string::npos) << svg;
  EXPECT_NE(svg.find("x=\"-6.6802\""), std::string::npos)
      << "the middle of the court's outline, 22 feet less an inch";
  EXPECT_NE(svg.find("a &lt; b &amp; &quot;c&quot;"), std::string::npos);
  EXPECT_EQ(svg.find('\x01'), std::string::npos);
  EXPECT_EQ(count(path_svg(frames.view, {.ghosts = true}), "<polyline"), 3U);
  EXPECT_EQ(count(path_svg(frames.view, {.ghosts = true}), "stroke-dasharray"), 2U) << "open world and ghost";
}

TEST(PathSvg, AFullDiskLeavesTheDrawingThatWasThere) {
  const TemporaryFolder folder;
  const auto file = folder.write("a.svg", "before");
  {
    const test::FullDisk full(8);
    EXPECT_THROW(write_svg(file, std::string(100, 'x')), UserError);
  }
  EXPECT_EQ(contents_of(file), "before");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.svg.part"));
  write_svg(file, "after");
  EXPECT_EQ(contents_of(file), "after");
}

TEST(LargePicture, TilesCoverItOnce) {
  for (const auto& [size, limit] :
       {std::pair(SizePx{100, 70}, 32), {SizePx{64, 64}, 64}, {SizePx{65, 1}, 64}}) {
    std::vector<int> covered(static_cast<std::size_t>(size.width * size.height));
    for (const Tile& tile : tiles_of(size, limit)) {
      EXPECT_LE(std::max(tile.size.width, tile.size.height), limit);
      for (int y = 0; y < tile.size.height; ++y) {
        for (int x = 0; x < tile.size.width; ++x)
          ++covered.at(static_cast<std::size_t>((tile.origin_px.y + y) * size.width + tile.origin_px.x + x));
      }
    }
    EXPECT_TRUE(std::all_of(covered.begin(), covered.end(), [](int times) { return times == 1; }));
  }
}

TEST(Png, KeptAlphaHasTheColoursOfItself) {
  TemporaryFolder folder;
  const std::vector<std::uint8_t> half_red = {64, 0, 0, 128};
  write_png(folder.path() / "kept.png", half_red, {1, 1}, {}, PngAlpha::kept);
  write_png(folder.path() / "left_out.png", half_red, {1, 1});
  const std::string kept = contents_of(folder.path() / "kept.png");
  const std::string left_out = contents_of(folder.path() / "left_out.png");
  constexpr std::size_t kColorType = 25;  // of IHDR: 6 with alpha, 2 without
  EXPECT_EQ(kept.at(kColorType), 6);
  EXPECT_EQ(left_out.at(kColorType), 2);
}

}  // namespace
}  // namespace pf
