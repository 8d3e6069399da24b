// Two methods at once: the setting that differs, the layout of both halves, the figures on the card.
#include <gtest/gtest.h>

#include "app/options.hpp"
#include "app/split_setting.hpp"
#include "core/error.hpp"
#include "support/scene_support.hpp"
#include "unit/option_support.hpp"
#include "view/film_scene.hpp"
#include "view/split_card.hpp"
#include "view/split_layout.hpp"

namespace pf {
namespace {

std::string reason_of(const std::string& assignment) {
  try {
    split_setting(assignment);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

TEST(SplitSetting, TakesPathsAndKeys) {
  EXPECT_EQ(split_setting("run.method=spring"), "run.method = spring");
  EXPECT_EQ(split_setting(" method = exact "), "run.method = exact");
  EXPECT_EQ(split_setting("restitution=.5"), "air.restitution = 0.5");
  EXPECT_EQ(split_setting("next"), kNextMethod);
  EXPECT_EQ(split_settings({"dt_s=0.1", "next"}), (Difference{"run.dt_s = 0.1", kNextMethod}));
  EXPECT_EQ(split_settings({}), Difference{kNextMethod});
}

TEST(SplitSetting, RefusesWhatCannotDiffer) {
  for (const char* path : {"air.num_parcels", "run.seed", "run.time_scale", "ball.vx_mps", "world.width_m"}) {
    const std::string reason = reason_of(std::string(path) + "=1");
    EXPECT_NE(reason.find(std::string("--split: ") + path + " cannot differ"), std::string::npos) << reason;
    EXPECT_EQ(reason.find('\n'), std::string::npos);
  }
  EXPECT_NE(reason_of("run.methods=spring").find("run.method"), std::string::npos)
      << reason_of("run.methods=spring");
  EXPECT_NE(reason_of("air.restitution=2").find("0 to 1"), std::string::npos)
      << reason_of("air.restitution=2");
  EXPECT_NE(reason_of("spring").find("has no '='"), std::string::npos) << reason_of("spring");
}

TEST(SplitOption, RefusesAFlightThatIsTheSame) {
  const auto refused = [](std::vector<std::string> words) {
    words.emplace_back("--headless");
    return refusal(words);
  };
  EXPECT_NE(refused({"--method", "exact", "--split", "method=exact"}).find("is what the first flight has"),
            std::string::npos);
  EXPECT_NE(refused({"--split", "restitution=0.9"}).find("is what the first flight has"), std::string::npos);
  EXPECT_EQ(refused({"--split", "restitution=0.8"}), "accepted");
  EXPECT_EQ(refused({"--split"}), "accepted");
}

TEST(SplitSetting, RefusesTheSameTwice) {
  using Words = std::vector<std::string>;
  for (const Words& words :
       {Words{"method=exact", "run.method = spring"}, {"next", "method=spring"}, {"next", "next"}})
    EXPECT_THROW(split_settings(words), UserError) << words[0];
  EXPECT_THROW(split_settings({"dt_s=0.1", "dt_s=0.2"}), UserError);
}

// No setting that may differ changes where the parcels start, or the launch.
TEST(SplitSetting, ParcelsStartTheSame) {
  for (const std::string& path : settings_that_may_differ()) {
    EXPECT_EQ(path.find("world."), std::string::npos);
    const Field& field = find_field(path, "test");
    Settings first = test::court(300);
    Settings second = first;
    if (const auto* choice = std::get_if<Choice>(&field.member)) {
      choice->set(second, (choice->get(first) + 1) % static_cast<int>(choice->names.size()));
    } else if (const auto* is_on = std::get_if<bool Settings::*>(&field.member)) {
      second.** is_on = !(first.**is_on);
    } else {
      set_from_text(field, second, value_text(field, first) == "1" ? "0.5" : "1", "test");
    }
    EXPECT_FALSE(is_same(field, first, second)) << path;
    auto one = make_cpu_backend(1);
    auto other = make_cpu_backend(1);
    SceneRun a(first, std::move(one));
    SceneRun b(second, std::move(other));
    EXPECT_EQ(a.backend->snapshot().position, b.backend->snapshot().position) << path;
    EXPECT_EQ(a.backend->snapshot().velocity, b.backend->snapshot().velocity) << path;
  }
}

TEST(SplitSetting, NextMethodIsOneThatCanFly) {
  Settings settings = test::court(300);
  EXPECT_EQ(resolved({kNextMethod}, settings), Difference{"run.method = spring"});
  settings.dt_s = 1e-3;
  settings.spring_contact_s = 1e-6;  // beyond the bound of spring
  EXPECT_EQ(resolved({kNextMethod}, settings), Difference{"run.method = exact"});
  EXPECT_THROW(resolved({"run.method = spring"}, settings), UserError);
}

TEST(SplitSetting, ComparisonsChangeTheSecond) {
  const Settings settings = test::court(300);  // impulse
  const Difference spring = {"run.method = spring"};
  EXPECT_EQ(compared(spring, Comparison::next_method, settings, 0.01), Difference{"run.method = exact"});
  EXPECT_EQ(compared({"run.method = exact"}, Comparison::next_method, settings, 0.01), spring);
  const Difference half = compared(spring, Comparison::half_step, settings, 0.01);
  EXPECT_EQ(half, (Difference{"run.method = spring", "run.dt_s = 0.005"}));
  EXPECT_EQ(compared(half, Comparison::half_step, settings, 0.005), spring);
}

TEST(SplitSetting, NamesSayInWhatTheyDiffer) {
  Settings settings = test::court(300);
  const SplitNames names = split_names(settings, {"run.method = exact", "air.restitution = 0.5"});
  EXPECT_EQ(names.first, "impulse, restitution 0.9");
  EXPECT_EQ(names.second, "exact, restitution 0.5");
  EXPECT_EQ(split_names(settings, {"run.dt_s = 0.0001"}).first, "automatic step");
  EXPECT_EQ(split_names(settings, {"air.restitution = 0.12345678901234567"}).second, "restitution 0.12346");
  settings.restitution = 0.5;
  const SplitNames close = split_names(settings, {"air.restitution = 0.5000001"});
  EXPECT_EQ(close.first, "restitution 0.5");
  EXPECT_EQ(close.second, "restitution 0.5000001");
}

TEST(SplitOption, ValueIsOptional) {
  const std::vector<std::string> bare = {"run", "--split", "--headless"};
  EXPECT_EQ(with_split_values(bare), (std::vector<std::string>{"run", "--split=next", "--headless"}));
  const std::vector<std::string> set = {"--split", "method=exact", "--split", "restitution=0.5"};
  EXPECT_EQ(with_split_values(set),
            (std::vector<std::string>{"--split=method=exact", "--split=restitution=0.5"}));
  EXPECT_EQ(with_split_values({"--split"}), std::vector<std::string>{"--split=next"});
  EXPECT_EQ(with_split_values({"--split", "a.toml"}), (std::vector<std::string>{"--split=next", "a.toml"}));
}

class Layout : public testing::TestWithParam<std::pair<double, double>> {
 protected:
  ViewRegion free_{318.0, 150.0, GetParam().first, GetParam().second};
  LegendSize card_{400.0, 110.0};
  World world_ = derive_physics(test::court(100)).world;
};

TEST_P(Layout, HalvesAreApartAndWithinTheFreeRegion) {
  for (const double share : {0.0, 0.3, 0.5, 0.8}) {
    const SplitLayout at = lay_out_halves(free_, card_, world_, share, 1.0F);
    EXPECT_EQ(overlap_px2(at.first, at.second_half), 0.0) << share;
    EXPECT_EQ(overlap_px2(at.first, at.card), 0.0) << share;
    EXPECT_EQ(overlap_px2(at.second, at.card), 0.0) << share;
    for (const ViewRegion& region : {at.first, at.second, at.second_half, at.card}) {
      const double area = region.width_px * region.height_px;
      EXPECT_NEAR(overlap_px2(region, free_), area, 1e-3 * area) << share;
    }
    EXPECT_NEAR(overlap_px2(at.second, at.second_half), at.second.width_px * at.second.height_px, 2000.0);
    const Vec2d grip = at.divider.center_px();
    EXPECT_NEAR(share_at(grip, at), std::clamp(share, kMinShare, kMaxShare), 0.01);
  }
}

INSTANTIATE_TEST_SUITE_P(Windows, Layout,
                         testing::Values(std::pair{962.0, 570.0}, std::pair{482.0, 550.0},
                                         std::pair{1602.0, 930.0}, std::pair{800.0, 1400.0}));

TEST(SplitLayout, ACourtIsStackedAndASquareStandsBeside) {
  const LegendSize card = {400.0, 110.0};
  const ViewRegion free = {318.0, 150.0, 962.0, 570.0};
  const World court = derive_physics(test::court(100)).world;
  EXPECT_TRUE(lay_out_halves(free, card, court, 0.5, 1.0F).stacked);
  Settings square = test::court(100);
  square.width_m = square.height_m = 6.1;
  square.ball_x_m = square.ball_y_m = 0.0;
  EXPECT_FALSE(lay_out_halves(free, card, derive_physics(square).world, 0.5, 1.0F).stacked);
}

TEST(SplitLayout, LinkedCamerasShowTheSamePlace) {
  const World world = derive_physics(test::court(100)).world;
  const ViewRegion first = {318.0, 400.0, 600.0, 300.0};
  const ViewRegion second = {318.0, 100.0, 600.0, 300.0};
  Camera camera;
  fit_world(camera, world, first, 1.0F);
  EXPECT_EQ(camera_like(camera, first, second, world, 1.0F).metres_per_px, camera.metres_per_px);
  camera.zoom_at({500.0, 500.0}, 4.0, 13.4);
  const Camera linked = camera_like(camera, first, second, world, 1.0F);
  EXPECT_EQ(linked.metres_per_px, camera.metres_per_px);
  const Vec2d a = camera.to_world({400.0, 450.0});
  const Vec2d b = linked.to_world({400.0, 150.0});
  EXPECT_NEAR(a.x, b.x, 1e-12);
  EXPECT_NEAR(a.y, b.y, 1e-12);
}

TEST(SplitCard, RowsSayHowTheFlightsDiffer) {
  Simulation first(test::court(200), make_cpu_backend(1));
  FlightPair pair(first, [](const std::string&, std::int64_t) { return make_cpu_backend(1); });
  Commands commands;
  commands.split = {"air.restitution = 0.1"};
  for (int frame = 0; frame < 31; ++frame) {
    pair.begin(pair.admit(commands), nullptr, nullptr);
    pair.finish();
    commands = {};
  }
  const std::vector<SplitRow> rows = split_rows(pair);
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[0].name, "t = 0.052 s");
  EXPECT_EQ(rows[1].name, "1  restitution 0.9");
  EXPECT_EQ(rows[2].name, "2  restitution 0.1");
  EXPECT_TRUE(rows[2].energy.starts_with("-") && rows[2].energy.ends_with(" %")) << rows[2].energy;
  EXPECT_NE(rows[3].distance.find("m, max "), std::string::npos) << rows[3].distance;
  EXPECT_TRUE(rows[3].cost.ends_with(" times")) << rows[3].cost;
  const SplitColors colors = split_colors(Theme::dark, pair);
  EXPECT_NE(colors.first, colors.second) << "the same method in both";
}

// The pace is that of the first flight, also where only one of them has fewer steps than the pace asks for.
TEST(SplitPace, IsKeptByBothFlights) {
  Settings limited = test::court(500), by_substeps = limited;
  limited.time_scale = 10.0;
  limited.max_substeps = 2;
  by_substeps.dt_s = 1e-4;
  by_substeps.substeps = 2;
  for (const Settings& settings : {limited, by_substeps}) {
    for (const char* difference : {"run.method = spring", "air.restitution = 0.3", "run.dt_s = 2e-5"}) {
      Simulation first(settings, make_cpu_backend(1));
      FlightPair pair(first, [](const std::string&, std::int64_t) { return make_cpu_backend(1); });
      for (int frame = 0; frame < 10; ++frame) {
        Commands commands;
        if (frame == 0) commands.split = {difference};
        if (frame > 1) commands.time_scale_factor = frame < 6 ? 0.5 : 2.0;
        pair.begin(pair.admit(commands), nullptr, nullptr);
        pair.finish();
        ASSERT_TRUE(pair.second()) << difference << ", " << frame << ": " << pair.view().message;
        EXPECT_EQ(pair.second()->settings(), differing(first.settings(), {difference})) << difference;
      }
    }
  }
}

}  // namespace
}  // namespace pf
